"""Bifurcation diagrams: what a return map does in the long run over the values of a parameter (figs. bifexact, bifapprox)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nsmaps.dynamics.motion import label, periods
from nsmaps.dynamics.orbit import Orbit, orbit, returns_of
from nsmaps.dynamics.returnmap import ReturnMap
from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Floats, Outcome, angle_mask, decoded

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True, slots=True, eq=False)
class Bifurcation:
    """What orbits do after a transient, for V values of a parameter and S starts each: K states of n coordinates.

    Where no map could be made, or an orbit ended, states are NaN; `reasons` and `outcome` say why.
    """

    coordinates: tuple[str, ...]
    walls: tuple[str, ...]
    values: Floats  #: shape (V,), as given
    states: Floats  #: shape (V, S, K, n), in the order of the returns; angles in [0, 2 pi)
    turns: NDArray[np.int32]  #: shape (V, S, K, n), whole turns an angle made on the return to each state
    codes: NDArray[np.int64]  #: shape (V, S, K), words of the returns to each state as numbers; see `words`
    outcome: NDArray[np.int8]  #: shape (V, S), values of `Outcome`: of the last return, or of that which ended the orbit
    reasons: tuple[str, ...]  #: V texts, why no map could be made; "" where one was
    period: NDArray[np.int64]  #: shape (V, S), least number of returns after which states and words repeat; 0: not within K/2

    @property
    def words(self) -> NDArray[np.str_]:
        """The word of the return to each state, shape (V, S, K); "" where there is none."""
        return decoded(self.codes, self.walls)

    @property
    def labels(self) -> NDArray[np.str_]:
        """The motion of each orbit, shape (V, S), such as 1:1/2T; "" where it ended. See `nsmaps.dynamics.motion.label`."""
        turns = self.turns[..., angle_mask(self.coordinates)].sum(axis=-1)
        words, table = self.words, np.empty(self.period.shape, object)
        for k in np.ndindex(table.shape):
            table[k] = label(words[k].tolist(), turns[k].tolist(), int(self.period[k]), self.walls)
        return table.astype(str)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which orbits went on to the end, shape (V, S)."""
        return np.asarray(np.isfinite(self.states[:, :, -1]).all(axis=-1))

    def to_xarray(self) -> "Dataset":
        """An xarray dataset with dimensions `value`, `start`, `return`, `coordinate`. NsmapsError without xarray."""
        from nsmaps.exact.data import EACH, NONE, OUTCOMES, TURNS, dataset

        rows = {
            "state": ("value start return coordinate", self.states, EACH, "the states kept; angles in [0, 2 pi)"),
            "turns": ("value start return coordinate", self.turns, TURNS, "whole turns on the return to each state"),
            "word": ("value start return", self.words, NONE, "impact word of the return to each state"),
            "motion": ("value start", self.labels, NONE, "name of the motion, such as 1:1/2T"),
            "period": ("value start", self.period, "returns", "least number after which states and words repeat; 0: none found"),
            "outcome": ("value start", self.outcome, NONE, OUTCOMES),
        }
        return dataset(self.coordinates, rows, {"value": self.values}, walls=self.walls)


def bifurcation(
    map_of: Callable[[float], ReturnMap],
    values: ArrayLike,
    starts: ArrayLike,
    returns: int = 60,
    transient: int = 2000,
    follow: Literal["up", "down", "both"] | None = None,
    tolerance: float = 1e-6,
    progress: Callable[[int], None] | None = None,
) -> Bifurcation:
    """The attractors over the values of a parameter, as in remark num_bif.

    Args:
        map_of: the return map at a value, such as `lambda d: system.at(d=d)`. Where it raises a ValueError, as a system does
            whose parameter is out of range, there is no map, and the value is passed over.
        values: shape (V,).
        starts: one state, shape (n,), or some, shape (S, n), phases in radians; at each value they run as one batch.
        returns: how many are kept at each value.
        transient: how many are made before them and forgotten.
        follow: the last states at one value are the starts at the next, through growing ("up") or falling ("down") values. An
            orbit that ended starts again from where the last value left it. With "both" there are 2 S orbits, those through
            growing values first. Without it every value has the starts given.
        tolerance: within which each coordinate must repeat to be periodic, in its units.
        progress: called with the number of values done, after each.

    Raises:
        StateError: the starts have not the map's coordinates.
        NsmapsError: other arguments that are not accepted, or there is a map at none of the values.
    """
    along, now = np.atleast_1d(np.asarray(values, float)), np.atleast_2d(np.asarray(starts, float))
    _check(along, returns, transient, follow)
    if follow == "both":
        ways: tuple[Literal["up", "down"], ...] = ("up", "down")
        return _beside(*(bifurcation(map_of, along, now, returns, transient, way, tolerance, progress) for way in ways))
    order = np.argsort(-along if follow == "down" else along, kind="stable")
    runs: dict[int, Orbit] = {}
    reasons = [""] * len(along)
    for done, k in enumerate(order.tolist(), 1):
        try:
            map = map_of(float(along[k]))
        except ValueError as error:
            reasons[k] = " ".join(str(error).split())
        else:
            runs[k] = _attractor(map, now, transient, returns)
            if follow:
                now = np.where(np.isfinite(runs[k].final).all(axis=-1, keepdims=True), runs[k].final, now)
        if progress is not None:
            progress(done)
    if not runs:
        raise NsmapsError(f"there is no map at any of {len(along)} values; at {along[0]:g}: {reasons[0]}")
    return _diagram(along, runs, tuple(reasons), tolerance)


def _attractor(map: ReturnMap, states: Floats, transient: int, returns: int) -> Orbit:
    """The orbits of states (S, n) after a transient; one that ended in it keeps its outcome."""
    part = None
    for part in returns_of(map, states, transient):
        states = part.image[-len(states) :]
    kept = orbit(map, states, returns)
    if part is not None:
        ended = np.isnan(states).any(axis=1)
        kept.outcome[:, ended] = part.outcome[-len(states) :][ended]
    return kept


def _diagram(values: Floats, runs: dict[int, Orbit], reasons: tuple[str, ...], tolerance: float) -> Bifurcation:
    """The orbits kept at some of the values as one table over all of them."""
    some = next(iter(runs.values()))
    returns, starts, dim = some.turns.shape
    shape = len(values), starts, returns
    states, turns = np.full((*shape, dim), np.nan), np.zeros((*shape, dim), np.int32)
    codes, outcome = np.zeros(shape, np.int64), np.full(shape[:2], Outcome.invalid, np.int8)
    for k, run in runs.items():
        states[k], turns[k], codes[k] = (np.swapaxes(part, 0, 1) for part in (run.states[1:], run.turns, run.codes))
        outcome[k] = run.outcome[-1]
    period = periods(states, codes, some.coordinates, tolerance)
    return Bifurcation(some.coordinates, some.walls, values, states, turns, codes, outcome, reasons, period)


def _beside(one: Bifurcation, other: Bifurcation) -> Bifurcation:
    """The orbits of both over the same values."""
    rows = {
        name: np.concatenate([getattr(one, name), getattr(other, name)], axis=1)
        for name in ("states", "turns", "codes", "outcome", "period")
    }
    return replace(one, **rows)  # type: ignore[arg-type]


def _check(values: Floats, returns: int, transient: int, follow: object) -> None:
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
        raise NsmapsError(f"the values have shape {values.shape}; accepted: one or more finite numbers in a row")
    if returns < 1 or transient < 0:
        raise NsmapsError(f"{returns} returns after {transient}; accepted: at least 1 that is kept, at least 0 before")
    if follow not in (None, "up", "down", "both"):
        raise NsmapsError(f"follow is {follow!r}; accepted: 'up', 'down', 'both' or None")
