"""Bifurcation diagrams: the attractors of a return map over the values of a parameter (figs. bifexact, bifapprox)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Bools, Floats, brief
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates
from nsmaps.dynamics.diagrams.names import Motion, alphabet_among, are_exact, names, open_ends
from nsmaps.dynamics.diagrams.parts import Block, Sweep, attractors_at
from nsmaps.dynamics.limits.path import diverges
from nsmaps.dynamics.motion import ESCAPE, UNRESOLVED, periods
from nsmaps.dynamics.returnmap import starts_under
from nsmaps.errors import NsmapsError
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.words import PLAIN, words_of
from nsmaps.parallel import NOT_COMPUTED, SERIAL, Arrays, Jobs, divides, names_among

if TYPE_CHECKING:
    from xarray import Dataset

FAR = 1e-3  #: share of the scale: distance of the last state from a cycle, beyond which an orbit is far from it
STATES = 0.7  #: share of the work that the states are assumed to take, for `progress`; the rest is that of these orbits


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Bifurcation(WithCoordinates):
    """Orbits after a transient, for V values of a parameter and S starts each: K states of n coordinates.

    States are NaN where there is no map or the orbit ended; `reasons` and `outcome` give the reason.
    """

    __repr__ = brief

    coordinates: Coordinates
    walls: tuple[str, ...]
    values: Floats  #: shape (V,), as given
    states: Floats  #: shape (V, S, K, n), in the order of the returns; angles in [0, 2 pi)
    turns: NDArray[np.int32]  #: shape (V, S, K, n), whole turns an angle made on the return to each state
    codes: NDArray[np.int64]  #: shape (V, S, K), words of the returns to each state as numbers; see `words`
    outcome: NDArray[np.int8]  #: shape (V, S), values of `Outcome`: of the last return, or of the return that ended the orbit
    reasons: tuple[str, ...]  #: V texts, the reason why there is no map; "" where there is one
    period: NDArray[np.int64]  #: shape (V, S), least count of returns after which states and words repeat; 0 where none was found
    scale: Floats | None = None  #: shape (n,), unit of tolerances in each coordinate, see `scale_of`; None in earlier runs
    labels: NDArray[np.str_] = field(default_factory=lambda: np.zeros(0, str))  #: shape (V, S), such as 1:1/2T; "" where it ended
    length: NDArray[np.int64] | None = None  #: shape (V, S), count of states in a period; None: one a return
    ends: Floats | None = (
        None  #: shape (V, S, K, n), the period of orbits whose last state is far from it; NaN of others, or None
    )

    def __post_init__(self) -> None:
        """Names from the words of what is kept, where no others are given."""
        WithCoordinates.__post_init__(self)
        if not self.labels.size and self.period.size:
            found = names(self.coordinates, self.walls, PLAIN, self.codes, self.turns, self.lengths, self.period)
            object.__setattr__(self, "labels", np.where(self.held & (self.period == 0), UNRESOLVED, found).astype(str))

    @property
    def unit(self) -> Floats:
        """The unit of tolerances in each coordinate, shape (n,); of an earlier run the largest magnitude in the diagram."""
        return self.coordinates.magnitudes(self.states) if self.scale is None else self.scale

    @property
    def lengths(self) -> NDArray[np.int64]:
        """The number of states in a period, shape (V, S), below its returns where images are those of several returns."""
        return self.period if self.length is None else self.length

    @property
    def settled(self) -> Floats:
        """The states (V, S, K, n), with the cycle of an orbit whose last state is still far from it."""
        return self.states if self.ends is None else self.ends

    @property
    def words(self) -> NDArray[np.str_]:
        """The word of the return to each state, shape (V, S, K); "" where there is none."""
        return words_of(self.codes, self.walls)

    @property
    def held(self) -> NDArray[np.bool_]:
        """True for orbits that did not end, shape (V, S)."""
        return np.asarray(np.isfinite(self.states[:, :, -1]).all(axis=-1))

    def to_xarray(self) -> "Dataset":
        """An xarray dataset with dimensions `value`, `start`, `return`, `coordinate`. Raises NsmapsError without xarray."""
        from nsmaps.datasets import EACH, NONE, TURNS, dataset

        rows = {
            "state": ("value start return coordinate", self.states, EACH, "states after the transient; angles in [0, 2 pi)"),
            "turns": ("value start return coordinate", self.turns, TURNS, "whole turns on the return to each state"),
            "word": ("value start return", self.words, NONE, "impact word of the return to each state"),
            "motion": ("value start", self.labels, NONE, "name of the motion, such as 1:1/2T"),
            "period": ("value start", self.period, "returns", "least number after which states and words repeat; 0: none found"),
            "outcome": ("value start", self.outcome, NONE, OUTCOMES),
        }
        return dataset(self.coordinates, rows, {"value": self.values}, walls=self.walls)


@divides
def bifurcation(
    map_of: Callable[[float], ReturnMap],
    values: ArrayLike,
    starts: StateLike,
    returns: int = 60,
    discard: int = 2000,
    direction: Literal["up", "down", "both"] | None = None,
    tolerance: float = 1e-6,
    *,
    jobs: Jobs = SERIAL,
) -> Bifurcation:
    """The attractors over the values of a parameter, as in remark num_bif.

    A period up to K/2 is sought in the K returns that are stored. Orbits without one are followed for up to 5000 more: what
    they end on is decided as by `nsmaps.dynamics.limits.limit.limits`, so that C names chaos alone, Q of quasi-periodic motion,
    `?` where neither was shown, and `escapes` of orbits that leave every bound. One that is on an unstable cycle to the last bit
    starts again from beside it.

    Args:
        map_of: the return map at a value, such as `lambda d: system.at(d=d)`. A value at which it raises a ValueError, as for a
            parameter out of range, has no map and is skipped.
        values: shape (V,).
        starts: one state, shape (n,) or by name, or some, shape (S, n), phases in radians; at each value they are one batch.
        returns: number stored at each value.
        discard: number computed before these and discarded as the transient.
        direction: the last states at one value are the starts at the next, in ascending ("up") or descending ("down") order. An
            orbit that ended starts again from its start at that value. With "both" there are 2 S orbits, the ascending ones
            first. With None the orbits at every value begin at the given starts.
        tolerance: largest difference of a coordinate after a period, of an angle in radians, of others relative to the extent
            of the motion, between events too, and at least to the median of the extents in the diagram.
        jobs: see `nsmaps.Jobs`; `map_of` may then be such as `nsmaps.Along(system, "d")`. Parts are values, as many as make
            100,000 returns; with `direction` every start is followed through the values of a part separately.

    Raises:
        StateError: the starts do not have the map's coordinates.
        NsmapsError: another argument is not valid, or no value has a map.
    """
    along = np.atleast_1d(np.asarray(values, float))
    now = np.atleast_2d(starts_under(map_of, along, starts))
    _check(along, returns, discard, direction)
    if direction == "both":
        how = returns, discard
        up = bifurcation(map_of, along, now, *how, "up", tolerance, jobs=jobs.share(0.0, 0.5, "up"))
        return _beside(up, bifurcation(map_of, along, now, *how, "down", tolerance, jobs=jobs.share(0.5, 1.0, "down")))
    order = np.argsort(-along if direction == "down" else along, kind="stable")
    if not jobs.divided or not len(now):
        blocks = [(order, slice(None), attractors_at(map_of, along[order], now, returns, discard, now if direction else None))]
    else:
        part = jobs.share(0.0, STATES, "states")
        so_far = partial(_diagram_so_far, along, now, tolerance)
        sweep = Sweep(map_of, along, order, returns, discard, part, so_far)
        blocks = sweep.followed(now) if direction else sweep.independent(now)
    return _unnamed(along, now, blocks, tolerance).named(map_of, tolerance, jobs.share(STATES, 1.0, "limits"))


def continued_diagram(
    map_of: Callable[[float], ReturnMap],
    value: float,
    states: Floats,
    starts: Floats,
    returns: int,
    discard: int,
    tolerance: float = 1e-6,
) -> Bifurcation:
    """The attractors at one value, of orbits that continue those of a diagram with some starts (S, n) from states (S, n)."""
    along, order = np.array([value]), np.zeros(1, np.int64)
    blocks = [(order, slice(None), attractors_at(map_of, along, states, returns, discard, starts))]
    return _unnamed(along, states, blocks, tolerance).named(map_of, tolerance, SERIAL)


@dataclass(frozen=True, slots=True, eq=False)
class _Unnamed:
    """A diagram, in which the motions of orbits are not known that do not repeat up to rounding."""

    diagram_so_far: Bifurcation
    open_: Bools  #: shape (V, S), these orbits
    scale: Floats  #: shape (n,)

    def diagram(self, found: Sequence[Motion] = ()) -> Bifurcation:
        """The diagram with periods and names of the first open orbits; others are unresolved."""
        plain = self.diagram_so_far
        length, period, labels = plain.lengths.copy(), plain.period.copy(), plain.labels.astype(object)
        labels[self.open_], period[self.open_], length[self.open_] = UNRESOLVED, 0, 0
        settled, far = plain.states.copy(), False
        for (v, s), motion in zip(np.argwhere(self.open_).tolist(), found, strict=False):
            length[v, s], period[v, s], labels[v, s] = motion.length, motion.period, motion.label
            own, cycle = settled[v, s], motion.states
            if 0 < len(cycle) <= len(own) and not plain.coordinates.near(cycle, own[-1], FAR, self.scale).any():
                settled[v, s], far = cycle[np.arange(len(own)) % len(cycle)], True
        gone = labels == ESCAPE
        states = np.where(gone[..., None, None], np.nan, plain.states)
        outcome = np.where(gone, np.int8(Outcome.escaped), plain.outcome)
        about: Any = {"outcome": outcome, "ends": settled if far else None}
        return replace(plain, length=length, period=period, labels=labels.astype(str), states=states, **about)

    def named(self, map_of: Callable[[float], ReturnMap], tolerance: float, jobs: Jobs) -> Bifurcation:
        """The diagram whose open orbits are followed on."""
        if not self.open_.any():
            if jobs.progress is not None:
                jobs.progress(1.0)
            return self.diagram()
        about = self.diagram_so_far.values, self.diagram_so_far.states[:, :, -1], self.open_, self.scale, tolerance
        return self.diagram(open_ends(map_of, *about, jobs, self.diagram))


def _diagram_so_far(values: Floats, starts: Floats, tolerance: float, blocks: list[Block]) -> Bifurcation:
    """The diagram of what is computed, in which no orbit is followed on."""
    return _unnamed(values, starts, blocks, tolerance).diagram()


def _unnamed(values: Floats, starts: Floats, blocks: list[Block], tolerance: float) -> _Unnamed:
    """The diagram over all values from the results at some of them."""
    reasons = np.full(len(values), NOT_COMPUTED, object)
    for cut, _, part in blocks:
        reasons[cut] = part["reasons"]
    some = next((part for *_, part in blocks if "states" in part), None)
    if some is None:
        raise NsmapsError(f"there is no map at any of {len(values)} values; at {values[0]:g}: {reasons[0]}")
    shape = len(values), len(starts), *some["states"].shape[2:]
    states, turns, time = np.full(shape, np.nan), np.zeros(shape, np.int32), np.full(shape[:3], np.nan)
    codes, outcome = np.zeros(shape[:3], np.int64), np.full(shape[:2], Outcome.invalid, np.int8)
    numbers, scales, unstable = np.ones(shape[:3], np.int32), np.ones((*shape[:2], shape[-1])), np.zeros(shape[:2], bool)
    tables: Arrays = {"states": states, "turns": turns, "codes": codes, "outcome": outcome, "time": time}
    tables |= {"numbers": numbers, "scale": scales, "unstable": unstable}
    for cut, own, part in blocks:
        for name in tables if "states" in part else ():
            tables[name][cut[part["reasons"] == ""], own] = part[name]
    coordinates, walls = names_among(some)
    held = np.isfinite(states[:, :, -1]).all(axis=-1) & ~diverges(coordinates, states, starts)
    scale = np.median(scales[held], axis=0) if held.any() else np.ones(len(coordinates))
    length = np.where(unstable, 0, periods(states, codes, coordinates, tolerance * np.maximum(scales, scale), time))
    period = np.where(np.arange(shape[2]) < length[..., None], numbers, 0).sum(axis=-1)
    labels = names(coordinates, walls, alphabet_among(some), codes, turns, length, period)
    labels[unstable] = UNRESOLVED
    labels[~held & np.isin(outcome, (Outcome.returned, Outcome.escaped)) & (reasons == "")[:, None]] = ESCAPE
    open_ = held & ~unstable & ((length == 0) | ~are_exact(coordinates, states, length, scale))
    named = np.where(held | (labels == ESCAPE), labels, "")
    about = outcome, tuple(reasons.tolist()), np.where(held, period, 0), scale, named, np.where(held, length, 0)
    return _Unnamed(Bifurcation(coordinates, walls, values, states, turns, codes, *about), open_, scale)


def _beside(one: Bifurcation, other: Bifurcation) -> Bifurcation:
    """The diagram of the orbits of both over the same values."""
    rows: Any = {
        name: np.concatenate([getattr(one, name), getattr(other, name)], axis=1)
        for name in ("states", "settled", "turns", "codes", "outcome", "period", "labels", "lengths")
    }
    ends = None if one.ends is None and other.ends is None else rows["settled"]
    return replace(one, length=rows.pop("lengths"), ends=ends, **{name: row for name, row in rows.items() if name != "settled"})


def _check(values: Floats, returns: int, discard: int, direction: object) -> None:
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all():
        raise NsmapsError(f"the values have shape {values.shape}; expected: one or more finite numbers, shape (V,)")
    if returns < 1 or discard < 0:
        raise NsmapsError(f"{returns} returns after {discard}; expected: at least 1 after at least 0")
    if direction not in (None, "up", "down", "both"):
        raise NsmapsError(f"direction is {direction!r}; expected: 'up', 'down', 'both' or None")
