"""The limit set of an orbit: a cycle, found by Newton's method from its last states, or states without a period."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.limits.cycles import refined
from nsmaps.dynamics.limits.decision import limits_on
from nsmaps.dynamics.limits.path import Path
from nsmaps.dynamics.motion import MEANING, has_rest, kind_of
from nsmaps.dynamics.orbit import Orbit
from nsmaps.dynamics.periodic import stability
from nsmaps.dynamics.scale import scale_of
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.results import NONE, Result, array, units_of

if TYPE_CHECKING:
    from nsmaps.exact.events import ModeTrack, Track

TOLERANCE = 1e-6  #: share of the scale within which the states of a cycle repeat
VISITED = 1000  #: number of states that represent an attractor without period
TOLD = 4  #: number of states of a cycle that a sentence lists
LONG = 40  #: number of letters from which a sentence omits a label


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class LimitSet(WithCoordinates, Result):
    """The limit set of one orbit in n coordinates."""

    picture: ClassVar[str] = "nsmaps.figures.attractors.poincare"

    coordinates: Coordinates
    period: int  #: in returns; 0 where none was found
    looked: int  #: longest period that would have been found
    more: int  #: returns beyond those of the orbit that were computed
    label: str  #: name of the motion, such as 1:1/2T; see `nsmaps.dynamics.motion.label`
    words: tuple[str, ...]  #: of the return from each state of a period; without a period, every word of the sample
    #: those that are images of the map
    states: Floats = field(metadata=array("point coordinate", "one period in order, or states visited; angles in [0, 2 pi)"))
    #: empty where Newton's method did not find the cycle
    multipliers: NDArray[np.complex128] = field(metadata=array("multiplier", "multipliers of the cycle, the largest first", NONE))
    exponent: float = math.nan  #: largest Lyapunov exponent per return; NaN with a period and of an escape
    exponent_error: float = math.nan  #: its standard error
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates, by name

    def summary(self) -> str:
        """A description in a few words."""
        return self.text

    @property
    def stable(self) -> bool | None:
        """True if every multiplier lies within the unit circle; None where the multipliers are unknown."""
        return stability(self.multipliers)

    @property
    def name(self) -> str:
        """The label without the period; empty where there is none or one of many words, as for motion that chatters."""
        name = self.label.partition("period ")[0].removesuffix(", ")
        return name if len(name) <= LONG else ""

    @property
    def meaning(self) -> str:
        """What a motion without a period is, such as `chaos`; "" with one."""
        return "" if self.period else MEANING.get(kind_of(self.label), "an orbit that ends")

    @property
    def text(self) -> str:
        """A description in a few words."""
        if not self.period:
            text = f"{self.meaning}{f' ({self.name})' if self.name else ''}, followed for {self.more} more returns"
            exponent = f"largest Lyapunov exponent {self.exponent:.3g} +- {self.exponent_error:.1g} per return"
            if math.isinf(self.exponent):
                why = "orbits that rest become one" if any(map(has_rest, self.words)) else "an image does not depend on the state"
                exponent = f"largest Lyapunov exponent {self.exponent}, as where {why}"
            return text if math.isnan(self.exponent) else f"{text}, {exponent}"
        kind = {True: "stable", False: "unstable", None: "seen"}[self.stable]
        what = "fixed point" if self.period == 1 else f"cycle of {self.period} returns"
        factors = ", ".join(_number(value) for value in self.multipliers.tolist())
        listed = ", ".join("(" + ", ".join(f"{x:.5g}" for x in state) + ")" for state in self.states)
        parts = [self.name, factors and f"multipliers {factors}", f"at {listed}" if self.period <= TOLD else ""]
        seen = f"found after {self.more} more returns" if self.more else ""
        return ", ".join(part for part in (f"{kind} {what}", *parts, seen) if part)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class OrbitPair(Result):
    """The orbits of one start: of the exact map and, if the study has one, of the composite map."""

    picture: ClassVar[str] = "nsmaps.figures.composite.orbits"

    start: Floats = field(metadata=array("coordinate", "initial state of both"))
    exact: Orbit
    composite: Orbit | None
    track: "Track | ModeTrack | None" = (
        None  #: the exact motion at and between its first impacts or events, if the study requests it
    )
    ends: LimitSet | None = None  #: the limit set of the exact orbit; None if the orbit ended
    composite_ends: LimitSet | None = None
    counterpart_ends: LimitSet | None = None  #: as `ends`, but only of the states after as many returns as the pieces have

    def summary(self) -> str:
        """The numbers that matter."""
        other = "" if self.composite is None else f"; of the composite map on {self.composite_ends}"
        return f"from {self.start.round(6).tolist()}: the orbit of the exact map ends on {self.ends}{other}"

    @property
    def coordinates(self) -> Coordinates:
        """Those of the exact map, which are those of both."""
        return self.exact.coordinates

    @property
    def units(self) -> Mapping[str, str]:
        """Of coordinates, by name."""
        return self.exact.units


def limit_set(return_map: ReturnMap, path: Orbit) -> LimitSet | None:
    """The limit set of the orbit of one start under a map; None where it has no image before its last return.

    An orbit that ends only when it is followed on has the states that it visits, and no name.

    What it ends on is decided as by `nsmaps.dynamics.limits.decision.limits_on`, with the extent of its motion as the scale
    (`scale_of`): by its returns, or where they do not show it by those that follow.
    """
    if not np.isfinite(path.states).all() or not len(path.codes):
        return None
    scale = scale_of(return_map, path.states)
    (found,) = limits_on(return_map, Path.of_orbit(path, path.states[:1]), scale, TOLERANCE)
    if found.length and found.cycle is None:
        found = replace(refined(return_map, found, scale, TOLERANCE) or found, more=found.more)
    first = int(np.argmin(found.states[:, 0])) if found.length else 0
    visited = found.states[np.isfinite(found.states).all(axis=1)]  # of an orbit that ends only when it is followed
    states, words = np.roll(visited, -first, axis=0)[-VISITED:], (*found.words[first:], *found.words[:first])
    factors = np.zeros(0, complex) if found.cycle is None or np.isnan(found.cycle.multipliers).any() else found.cycle.multipliers
    about = path.coordinates, found.period, len(found.path.codes) // 2, found.more, found.label, words, states, factors
    return LimitSet(*about, found.exponent, found.error, units_of(return_map))


def _number(value: complex) -> str:
    return f"{value.real:.4g}" if not value.imag else f"{value.real:.4g}{value.imag:+.4g}i"
