"""A branch of periodic orbits in one parameter: as a result, and while it is followed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.continuation.events import BifurcationPoint
from nsmaps.dynamics.continuation.problem import OrbitCurve, OrbitPoint
from nsmaps.dynamics.periodic import PeriodicOrbit
from nsmaps.exact.returns import Returns
from nsmaps.results import NONE, Result, array, array_property


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Branch(Result):
    """A branch of periodic orbits of q returns: K orbits of n coordinates in the order of the branch."""

    picture: ClassVar[str] = "nsmaps.figures.parameters.branches"

    returns: Returns  #: of the K q states, those of each orbit in succession, with derivatives
    period: int  #: number of returns q of an orbit
    tolerance: float  #: tolerance of the residuals
    parameter: str
    values: Floats = field(metadata=array("orbit", "values of the parameter", name="parameter"))
    arclength: Floats = field(metadata=array("orbit", "length from the first orbit; units: range of the parameter, scale", NONE))
    events: tuple[BifurcationPoint, ...]  #: in the order of the branch
    ended: str  #: the reason why it ends
    scale: Floats = field(metadata=array("coordinate", "unit of residuals and arclength"))
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name

    def summary(self) -> str:
        """The motion, the range and the events."""
        if not len(self.values):
            return f"without orbits: {self.ended}"
        events = "; ".join(f"{event.kind} at {event.value:.9g}" for event in self.events) or "no events"
        ends = f"{self.parameter} from {self.values[0]:.6g} to {self.values[-1]:.6g}"
        return f"{self.labels[-1]}, {len(self.values)} orbits, {ends}: {events}"

    @property
    def coordinates(self) -> Coordinates:
        """Those of its states."""
        return self.returns.coordinates

    @classmethod
    def empty(cls, orbit: PeriodicOrbit, parameter: str, ended: str) -> "Branch":
        """A branch without orbits, where its supposed first orbit does not exist."""
        none = orbit.returns.select(np.arange(0))
        return cls(none, len(orbit.states), orbit.tolerance, parameter, np.empty(0), np.empty(0), (), ended, orbit.scale)

    @property
    def orbits(self) -> tuple[PeriodicOrbit, ...]:
        """The K orbits."""
        rows = np.arange(len(self.returns)).reshape(-1, self.period)
        return tuple(PeriodicOrbit(self.returns.select(own), self.tolerance, self.scale) for own in rows)

    @array_property("orbit point coordinate", "states of the orbits; angles in [0, 2 pi)")
    def points(self) -> Floats:
        """The states, shape (K, q, n), angles in [0, 2 pi)."""
        return self.returns.start.reshape(-1, self.period, self.returns.start.shape[1])

    @array_property("orbit point", "impact words of the returns", NONE)
    def words(self) -> NDArray[np.str_]:
        """The words of their returns, shape (K, q)."""
        return self.returns.words.reshape(-1, self.period)

    @array_property("orbit multiplier", "multipliers, the largest first", NONE)
    def multipliers(self) -> NDArray[np.complex128]:
        """Shape (K, n), the largest first."""
        return np.array([orbit.multipliers for orbit in self.orbits], complex).reshape(-1, self.returns.start.shape[1])

    @property
    def stable(self) -> NDArray[np.object_]:
        """True if every multiplier lies within the unit circle, else False; None where they are unknown, shape (K,)."""
        return np.array([orbit.stable for orbit in self.orbits], object)

    @array_property("orbit", "names of the motions", NONE)
    def labels(self) -> NDArray[np.str_]:
        """The motions n:m/pT, shape (K,)."""
        return np.array([orbit.label for orbit in self.orbits], str)

    def after(self, before: "Branch") -> "Branch":
        """One branch of the orbits of another one in reverse and then of its own; both begin at the same orbit."""
        back = np.arange(len(before.returns)).reshape(-1, before.period)[:0:-1].ravel()
        return replace(
            self,
            returns=Returns.concatenate([before.returns.select(back), self.returns]),
            values=np.concatenate([before.values[:0:-1], self.values]),
            arclength=np.concatenate([-before.arclength[:0:-1], self.arclength]),
            events=(*before.events[::-1], *self.events),
            ended=f"{before.ended}; {self.ended}",
        )

    def of_kind(self, kind: str) -> tuple[BifurcationPoint, ...]:
        """The events of one kind, such as `fold`."""
        return tuple(event for event in self.events if event.kind == kind)

    @property
    def doubling(self) -> BifurcationPoint | None:
        """The first event at which a branch of twice the period begins: a period doubling, or a border with one."""
        return next((event for event in self.events if event.doubles), None)


@dataclass(frozen=True, slots=True)
class GrowingBranch:
    """A branch while it is followed: every point that was reached, and its arclength."""

    curve: OrbitCurve
    points: list[OrbitPoint] = field(default_factory=list)
    arclength: list[float] = field(default_factory=list)
    events: list[BifurcationPoint] = field(default_factory=list)

    def add(self, point: OrbitPoint, step: float) -> None:
        """Add a point a step after the last one."""
        self.points.append(point)
        self.arclength.append((self.arclength[-1] if self.arclength else 0.0) + step)

    def branch(self, ended: str, least: float) -> Branch:
        """The result, without points that accumulate where steps are short."""
        kept = [0]
        for k in range(1, len(self.points)):
            if k == len(self.points) - 1 or self.arclength[k] - self.arclength[kept[-1]] >= least:
                kept.append(k)
        points, curve = [self.points[k] for k in kept], self.curve
        values, arclength = np.array([point.value for point in points]), np.array([self.arclength[k] for k in kept])
        returns = Returns.concatenate([point.orbit.returns for point in points])
        events = tuple(replace(event, parameter=curve.parameter) for event in self.events)
        found = values, arclength, events, ended, curve.scale, curve.units
        return Branch(returns, curve.period, curve.tolerance, curve.parameter, *found)
