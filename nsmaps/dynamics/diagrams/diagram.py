"""The result of a bifurcation diagram, and its assembly from the last states of orbits."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Storable
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.diagrams.names import ResolvedMotion, open_ends
from nsmaps.dynamics.diagrams.parts import Block, attractors_at
from nsmaps.dynamics.motion import ESCAPE, UNRESOLVED
from nsmaps.dynamics.returnmap import reasons_over
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.words import words_of
from nsmaps.parallel import SERIAL, Parallel, names_among
from nsmaps.results import NONE, RETURNS, TURNS, Result, array, array_property, range_text

NAMED = 6  #: motions in the text of a diagram
FAR = 1e-3  #: share of the scale: distance of the last state from a cycle, beyond which an orbit is far from it


@dataclass(frozen=True, slots=True)
class Border(Storable):
    """An end of a window."""

    value: float  #: of the parameter; NaN where it was not located
    precision: float  #: largest error of the value, that of transients included where orbits had to show it
    kind: str  #: event of a cycle, as `period doubling`; `change of words`, `no return`, `change of motion`; `not located`


@dataclass(frozen=True, slots=True)
class Window(Storable):
    """An interval of the parameter over which the first orbit of a diagram has one motion; "" where it has none."""

    label: str  #: the motion, such as 1:1/2T
    by_returns: str  #: its name where whole turns are unknown, as of fitted maps, such as 1:1, period 2
    low: Border
    high: Border
    seen: tuple[float, float]  #: least and greatest value of the diagram in it
    rotation: str = ""  #: rotation number p/q of a cycle of a map given by formulas with one angle, or in two pieces


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BifurcationDiagram(WithCoordinates, Result):
    """Orbits after a transient, for V values of a parameter and S starts each: K states of n coordinates.

    States are NaN where there is no map or the orbit ended; `reasons` and `outcome` give the reason.
    """

    picture: ClassVar[str] = "nsmaps.figures.parameters.bifurcation_diagram"

    coordinates: Coordinates
    walls: tuple[str, ...]
    parameter: str
    values: Floats = field(metadata=array("value", "values of the parameter, as given", name="parameter"))
    states: Floats = field(metadata=array("value start return coordinate", "states after the transient; angles in [0, 2 pi)"))
    turns: NDArray[np.int32] = field(
        metadata=array("value start return coordinate", "whole turns on the return to each state", TURNS)
    )
    codes: NDArray[np.int64] = field(metadata=array("value start return", "words as numbers; see `words`", NONE))
    outcome: NDArray[np.int8] = field(
        metadata=array("value start", f"of the last return, or of that which ended the orbit: {OUTCOMES}", NONE)
    )
    reasons: tuple[str, ...]  #: V texts, the reason why there is no map; "" where there is one
    period: NDArray[np.int64] = field(
        metadata=array("value start", "least number after which states and words repeat; 0: none found", RETURNS)
    )
    scale: Floats = field(metadata=array("coordinate", "unit of tolerances in each coordinate, see `scale_of`"))
    labels: NDArray[np.str_] = field(metadata=array("value start", 'motion, such as 1:1/2T; "" where the orbit ended', NONE))
    length: NDArray[np.int64] = field(
        metadata=array("value start", "states in a period; fewer than its returns if images are those of several returns", NONE)
    )
    ends: Floats | None = field(
        default=None,
        metadata=array("value start return coordinate", "as `states`, the period of orbits whose last state is far from it"),
    )
    windows: tuple[Window, ...] = ()  #: the widest windows of the first orbit, if their borders were asked for
    units: Mapping[str, str] = field(default_factory=dict)  #: of coordinates and parameters, by name
    direction: str = ""  #: in which orbits were followed, "up", "down" or "both"; "" where each value has the same starts

    def summary(self) -> str:
        """The range, and the motions of the first orbit in the order of the values."""
        order = np.argsort(self.values, kind="stable")
        labels = self.labels[order, 0].tolist()
        names = list(dict.fromkeys(name for name in labels if name not in {"", UNRESOLVED}))
        motions = ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")
        if open_values := labels.count(UNRESOLVED):
            motions += f"; at {open_values} of them neither a period nor chaos was shown"
        _, starts, returns, _ = self.states.shape
        over = f"{range_text(self.parameter, self.values)}, {starts} start{'s' * (starts != 1)}"
        return f"{over}, {returns} returns each: {motions or 'no attractor'}"

    @property
    def settled(self) -> Floats:
        """The states (V, S, K, n), with the cycle of an orbit whose last state is still far from it."""
        return self.states if self.ends is None else self.ends

    @array_property("value start return", "word of the return to each state; empty where there is none", NONE)
    def words(self) -> NDArray[np.str_]:
        """The word of the return to each state, shape (V, S, K); "" where there is none."""
        return words_of(self.codes, self.walls)

    @property
    def held(self) -> NDArray[np.bool_]:
        """True for orbits that did not end, shape (V, S)."""
        return np.asarray(np.isfinite(self.states[:, :, -1]).all(axis=-1))


def continued_diagram(
    map_of: Callable[[float], ReturnMap],
    value: float,
    states: Floats,
    starts: Floats,
    n_returns: int,
    transient: int,
    tolerance: float = 1e-6,
) -> BifurcationDiagram:
    """The attractors at one value, of orbits that continue those of a diagram with some starts (S, n) from states (S, n)."""
    along, order = np.array([value]), np.zeros(1, np.int64)
    blocks = [(order, slice(None), attractors_at(map_of, along, states, n_returns, transient, tolerance, starts))]
    return unnamed("", along, starts, blocks).named(map_of, tolerance, SERIAL)


@dataclass(frozen=True, slots=True, eq=False)
class Unnamed:
    """A diagram, in which the motions of orbits are not known that do not repeat up to rounding."""

    diagram_so_far: BifurcationDiagram
    open_: Bools  #: shape (V, S), these orbits
    scale: Floats  #: shape (V, S, n), of each orbit
    starts: Floats  #: shape (S, n)

    def diagram(self, found: Sequence[ResolvedMotion] = ()) -> BifurcationDiagram:
        """The diagram with periods and names of the first open orbits; others are unresolved."""
        plain = self.diagram_so_far
        length, period, labels = plain.length.copy(), plain.period.copy(), plain.labels.astype(object)
        labels[self.open_], period[self.open_], length[self.open_] = UNRESOLVED, 0, 0
        settled, far = plain.states.copy(), False
        for (v, s), motion in zip(np.argwhere(self.open_).tolist(), found, strict=False):
            length[v, s], period[v, s], labels[v, s] = motion.length, motion.period, motion.label
            own, cycle = settled[v, s], motion.states
            if 0 < len(cycle) <= len(own) and not plain.coordinates.near(cycle, own[-1], FAR, self.scale[v, s]).any():
                settled[v, s], far = cycle[np.arange(len(own)) % len(cycle)], True
        gone = labels == ESCAPE
        states = np.where(gone[..., None, None], np.nan, plain.states)
        outcome = np.where(gone, np.int8(Outcome.escaped), plain.outcome)
        about: Any = {"outcome": outcome, "ends": settled if far else None}
        return replace(plain, length=length, period=period, labels=labels.astype(str), states=states, **about)

    def named(self, map_of: Callable[[float], ReturnMap], tolerance: float, parallel: Parallel) -> BifurcationDiagram:
        """The diagram whose open orbits are followed on."""
        if not self.open_.any():
            if parallel.progress is not None:
                parallel.progress(1.0)
            return self.diagram()
        last = self.diagram_so_far.states[:, :, -1]
        about = self.diagram_so_far.values, last, self.open_, self.scale, self.starts, tolerance
        return self.diagram(open_ends(map_of, *about, parallel, self.diagram))


def diagram_so_far(parameter: str, values: Floats, starts: Floats, blocks: list[Block]) -> BifurcationDiagram:
    """The diagram of what is computed, in which no orbit is followed on."""
    return unnamed(parameter, values, starts, blocks).diagram()


def unnamed(parameter: str, values: Floats, starts: Floats, blocks: list[Block]) -> Unnamed:
    """The diagram over all values from the results at some of them."""
    reasons, some = reasons_over(values, [(cut, part) for cut, _, part in blocks])
    shape = len(values), len(starts), *some["states"].shape[2:]
    tables: dict[str, Any] = {
        "states": np.full(shape, np.nan),
        "turns": np.zeros(shape, np.int32),
        "scale": np.ones((*shape[:2], shape[3])),
    }
    tables |= {"codes": np.zeros(shape[:3], np.int64), "outcome": np.full(shape[:2], Outcome.invalid, np.int8)}
    tables |= {"length": np.zeros(shape[:2], np.int64), "period": np.zeros(shape[:2], np.int64)}
    tables |= {"label": np.full(shape[:2], "", object), "is_open": np.zeros(shape[:2], bool)}
    for cut, own, part in blocks:
        for name in tables if "states" in part else ():
            tables[name][cut[part["reasons"] == ""], own] = part[name]
    coordinates, walls = names_among(some)
    labels, scales, open_ = (tables.pop(name) for name in ("label", "scale", "is_open"))
    held = np.isfinite(tables["states"][:, :, -1]).all(axis=-1) & (labels != ESCAPE)
    found = BifurcationDiagram(
        coordinates=coordinates,
        walls=walls,
        parameter=parameter,
        values=values,
        reasons=tuple(reasons.tolist()),
        scale=np.median(scales[held], axis=0) if held.any() else np.ones(len(coordinates)),
        labels=labels.astype(str),
        **tables,
    )
    return Unnamed(found, open_, scales, starts)
