"""Attractors along a parameter, matched from value to value: shares of their basins, distances to the boundary, return times."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, Random, entropy_of
from nsmaps.coordinates import BoxLike, Coordinates, as_box
from nsmaps.dynamics.attractors.arrivals import ENDED, UNRESOLVED, follow
from nsmaps.dynamics.attractors.attractor import Attractor, find_attractors
from nsmaps.dynamics.attractors.basins import basins
from nsmaps.dynamics.attractors.coexistence import numbered
from nsmaps.dynamics.attractors.continued import GlobalContinuation
from nsmaps.dynamics.attractors.kicks import Kicks, nonlocal_stability
from nsmaps.dynamics.attractors.quantifiers import Function, Quantifier, quantified, quantifiers_of
from nsmaps.dynamics.returnmap import check_values, first_map, map_along, map_or_reason
from nsmaps.errors import NsmapsError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.parameters import System
from nsmaps.interrupts import Interrupted
from nsmaps.parallel import NOT_COMPUTED, SERIAL, Arrays, Parallel, divides, names_among, names_as_arrays
from nsmaps.results import units_of

MEASURES = "distance", "return_time", "return_error", "returned"  #: fields of `Stability`
FIELDS = "states", "period", "label", "words", "reach", "scale"  #: of an attractor, as arrays of a part
FOUND = 0.4  #: share of the work that the search for attractors is assumed to take, for `progress`


@divides
def global_continuation(
    system: System | Callable[[float], ReturnMap],
    parameter: str,
    values: ArrayLike,
    box: BoxLike,
    *,
    n_samples: int = 1000,
    max_returns: int = 1000,
    tolerance: float = 1e-6,
    max_period: int = 32,
    scale: ArrayLike | None = None,
    step: float = 0.1,
    kick: float = 0.01,
    n_kicks: int = 100,
    n_directions: int = 16,
    n_states: int = 8,
    quantifiers: Mapping[str, Function] | None = None,
    rng: Random = 0,
    parallel: Parallel = SERIAL,
) -> GlobalContinuation:
    """The attractors along a parameter with the shares of their basins, their distances to the boundary and return times.

    At each value attractors are found from random starts, as by `basins`, and from the states of the attractors at the
    neighbouring values, up and down, so that one whose basin holds none of the starts is kept while it lives. Attractors of
    neighbouring values are matched, the nearest pairs first, if their Hausdorff distance is at most `step`; two without periods,
    as samples, if most states of either are within the reach of the other. See `nonlocal_stability` for the kicks.

    Args:
        system: a system, or the return map as a function of the parameter's value.
        parameter: its name.
        values: shape (V,); a value without a map is skipped.
        box: a box of states, shape (n, 2), by name, or a `Box`, in which the starts are drawn, the same at all values.
        n_samples: number of starts.
        max_returns, tolerance, max_period: as for `basins`.
        scale: shape (n,), the unit of kicks and distances in each coordinate; by default the sides of the box.
        step: largest distance of an attractor from its continuation at the next value.
        kick, n_kicks: size and number of the kicks whose returns are timed, each of a random state in a random direction.
        n_directions, n_states: of directions, and of states of an attractor, in which the boundary is searched for.
        quantifiers: as for `basins`.
        rng: of the starts, directions and kicks, as `numpy.random.default_rng` takes it.
        parallel: see `nsmaps.Parallel`; every value is a part, of the search and of the stability.

    Raises:
        StateError, NsmapsError: there is no such parameter, the box does not have the map's coordinates, another argument is not
            valid, no value has a map, or a quantifier raises or returns something else.
        Interrupted: Ctrl-C; `result` has the finished values, None if there are none.
    """
    map_of, along = map_along(system, parameter), np.sort(np.atleast_1d(np.asarray(values, float)))
    _check(along, n_samples, step)
    some = first_map(map_of, along[:, None])
    coordinates, units = Coordinates(some.coordinates), units_of(some)
    ends = as_box(box, coordinates, whole_turn=True)
    unit = np.array(np.broadcast_to(np.ptp(ends, axis=1) if scale is None else np.asarray(scale, float), len(ends)))
    if not (np.isfinite(unit) & (unit > 0)).all():
        raise NsmapsError(f"the scale is {unit.tolist()}; expected: a length above 0 for each of {', '.join(coordinates)}")
    seed = entropy_of(rng)
    start = ends[:, 0] + np.ptp(ends, axis=1) * np.random.default_rng(seed).random((n_samples, len(ends)))
    how = max_returns, tolerance, max_period
    work = _Work(map_of, along, start, how, Kicks(kick, n_kicks, n_directions, n_states, seed), unit)
    about = coordinates, parameter, units, ends, step, quantifiers_of(quantifiers, GlobalContinuation, parameter)
    try:
        work.find(parallel.share(0.0, FOUND, "attractors"))
        work.follow()
        work.measure(parallel.share(FOUND, 1.0, "stability"))
    except KeyboardInterrupt as error:
        raise Interrupted.of(error, work.result(*about) if work.found else None) from error
    return work.result(*about)


def _check(values: Floats, samples: int, step: float) -> None:
    check_values(values)
    if samples < 1 or not step > 0:
        raise NsmapsError(f"{samples} samples, a step of {step}; expected: at least 1 sample, a step above 0")


@dataclass(slots=True, eq=False)
class _Work:
    """A continuation, as far as it is done: results by the index of the value."""

    map_of: Callable[[float], ReturnMap]
    values: Floats
    start: Floats
    how: tuple[int, float, int]  #: returns, tolerance, max_period
    kicks: Kicks
    scale: Floats
    found: dict[int, Arrays] = field(default_factory=dict)  #: of `_found`
    attractors: dict[int, list[Attractor]] = field(default_factory=dict)  #: where there is a map
    stability: dict[int, Arrays] = field(default_factory=dict)  #: of `_stability`, where there is a map

    def find(self, parallel: Parallel) -> None:
        """The attractors that the starts reach at each value."""
        try:
            parts = parallel.run(_found, [(self.map_of, value, self.start, *self.how) for value in self.values.tolist()])
            self.found.update(enumerate(parts))
        except Interrupted as stopped:
            self.found.update(sorted(stopped.result.items()))
            raise
        finally:
            self.attractors = {v: _attractors(part) for v, part in self.found.items() if not str(part["reason"])}

    def follow(self) -> None:
        """More attractors, from the states of those at the neighbouring values: up, then down."""
        up = list(self.attractors)
        for order in (up, up[::-1]):
            for before, here in pairwise(order):
                seeds = np.array([each.states[-1] for each in self.attractors[before]])
                if len(seeds):
                    known, return_map = self.attractors[here], self.map_of(self.values[here])
                    known += find_attractors(return_map, seeds, *self.how, known)

    def measure(self, parallel: Parallel) -> None:
        """The basins and the stability at each value with a map."""
        places = list(self.attractors)
        about = [(self.values[v], tuple(self.attractors[v]), self.found[v]["label"]) for v in places]
        parts = [(self.map_of, *each, self.start, self.kicks, self.scale, self.how[0]) for each in about]
        try:
            self.stability.update(zip(places, parallel.run(_stability, parts), strict=True))
        except Interrupted as stopped:
            self.stability.update((places[k], part) for k, part in sorted(stopped.result.items()))
            raise

    def result(
        self,
        coordinates: Coordinates,
        parameter: str,
        units: Mapping[str, str],
        box: Floats,
        step: float,
        quantifiers: Sequence[Quantifier],
    ) -> GlobalContinuation:
        """The attractors numbered along the parameter, and their quantities as far as they are known."""
        rows, count = self._numbers(step)
        shape = len(self.values), count
        measures: Arrays = {name: np.full(shape, np.nan) for name in MEASURES}
        share, unresolved, ended = np.full(shape, np.nan), np.full(shape[0], np.nan), np.full(shape[0], np.nan)
        for v, own in rows.items():
            label = self.stability.get(v, self.found[v])["label"]
            share[v, own] = [(label == k).mean() for k in range(len(own))]
            unresolved[v], ended[v] = (label == UNRESOLVED).mean(), (label == ENDED).mean()
            for name in MEASURES if v in self.stability else ():
                measures[name][v, own] = self.stability[v][name]
        every = tuple(replace(each, units=units) for v in rows for each in self.attractors[v])
        places, index = [(v, a) for v, own in rows.items() for a in own], np.full(shape, -1)
        index[tuple(np.array(places, int).reshape(-1, 2).T)] = range(len(every))
        maps = {v: self.map_of(float(self.values[v])) for v in rows if quantifiers}
        sets = ((place, each.states, maps[place[0]]) for place, each in zip(places, every, strict=True))
        reasons = tuple(str(self.found[v]["reason"]) if v in self.found else NOT_COMPUTED for v in range(shape[0]))
        about = reasons, box, self.scale, len(self.start), self.kicks.size
        tables: Any = {"index": index, "share": share, "unresolved": unresolved, "ended": ended, **measures}
        more = quantified(quantifiers, shape, sets)
        return GlobalContinuation(coordinates, parameter, self.values, *about, every, **tables, units=units, quantifiers=more)

    def _numbers(self, step: float) -> tuple[dict[int, list[int]], int]:
        """The number of each attractor by the index of the value, and how many numbers there are."""
        rows, last, count = dict[int, list[int]](), dict[int, Attractor](), 0
        for v, here in sorted(self.attractors.items()):
            last = numbered(here, last, count, self.scale, step)
            rows[v] = list(last)
            count = max(count, *(number + 1 for number in rows[v]), 0)
        return rows, count


def _found(
    map_of: Callable[[float], ReturnMap], value: float, start: Floats, returns: int, tolerance: float, max_period: int
) -> Arrays:
    """The attractors that starts reach at one value, and the label of each start, as in `Basins`; or the reason of no map."""
    return_map, reason = map_or_reason(map_of, value)
    if return_map is None:
        return {"reason": np.array(reason)}
    found = basins(return_map, start, attractors=None, max_returns=returns, tolerance=tolerance, max_period=max_period)
    return {"reason": np.array(""), "label": found.label, **_packed(found.coordinates, found.attractors)}


def _stability(
    map_of: Callable[[float], ReturnMap],
    value: float,
    attractors: Sequence[Attractor],
    label: NDArray[np.int32],
    start: Floats,
    kicks: Kicks,
    scale: Floats,
    returns: int,
) -> Arrays:
    """The labels of the starts with all attractors at one value, and the arrays of `Stability`."""
    return_map, open_, label = map_of(value), label == UNRESOLVED, label.copy()
    label[open_] = follow(return_map, start[open_], attractors, returns).label
    found = nonlocal_stability(return_map, attractors, kicks, scale, returns)
    return {"label": label, **{name: getattr(found, name) for name in MEASURES}}


def _packed(coordinates: Coordinates, attractors: Sequence[Attractor]) -> Arrays:
    """Attractors as arrays by name; see `_attractors`."""
    arrays = names_as_arrays(coordinates)
    for k, each in enumerate(attractors):
        scale = np.ones(len(coordinates)) if each.scale is None else each.scale
        fields = each.states, each.period, each.label, np.array(each.words, str), each.reach, scale
        arrays |= {f"{name}-{k}": np.asarray(value) for name, value in zip(FIELDS, fields, strict=True)}
    return arrays


def _attractors(arrays: Arrays) -> list[Attractor]:
    """The attractors that `_packed` has put there."""
    coordinates, count = names_among(arrays)[0], sum(name.startswith("states-") for name in arrays)
    found = []
    for k in range(count):
        states, period, label, words, reach, scale = (arrays[f"{name}-{k}"] for name in FIELDS)
        about = int(period), str(label), tuple(words.tolist()), float(reach)
        found.append(Attractor(coordinates, states, *about, scale))
    return found
