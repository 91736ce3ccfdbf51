"""Bifurcation diagrams in parts: the last states of orbits over the values of a parameter."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.dynamics.limits.settled import Settled, settled
from nsmaps.dynamics.returnmap import followed
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.parallel import Arrays, Parallel, names_as_arrays

PART = 100_000  #: fewest returns of a part of a diagram by default, many times the cost of its overhead
D = TypeVar("D")  #: a diagram over all values
Block = tuple[NDArray[np.int64], slice, Arrays]  #: indices of values, starts, and the result of `attractors_at` there


@dataclass(frozen=True, slots=True, eq=False)
class Sweep(Generic[D]):
    """A diagram in parts, computed by an executor or stored in a folder."""

    map_of: Callable[[float], ReturnMap]
    values: Floats
    order: NDArray[np.int64]  #: indices of the values in the order in which they are taken
    returns: int
    discard: int
    tolerance: float
    parallel: Parallel
    diagram: Callable[[list[Block]], D]  #: from the results at some of them

    @property
    def how(self) -> tuple[int, int, float]:
        """The arguments of `attractors_at` that all parts have."""
        return self.returns, self.discard, self.tolerance

    def independent(self, starts: Floats) -> list[Block]:
        """Every start at every value; parts are values."""
        cuts = self._cuts(len(starts))
        parts = [(self.map_of, self.values[cut], starts, *self.how, None) for cut in cuts]

        def blocks(found: Mapping[int, Arrays]) -> list[Block]:
            return [(cuts[k], slice(None), part) for k, part in found.items()]

        return blocks(dict(enumerate(self.parallel.run(attractors_at, parts, lambda found: self.diagram(blocks(found))))))

    def followed(self, starts: Floats) -> list[Block]:
        """Each start followed through the values; parts are starts, for successive ranges of values."""
        blocks: list[Block] = []
        done, count, first = 0, len(self.order), starts
        for cut in self._cuts(1):
            pairs = zip(starts[:, None], first[:, None], strict=True)
            parts = [(self.map_of, self.values[cut], start, *self.how, own) for start, own in pairs]
            parallel = self.parallel.share(done / count, (done + len(cut)) / count, f"from-{done:06d}")
            found = parallel.run(attractors_at, parts, partial(self._diagram_until, blocks, cut))
            blocks += _of_starts(cut, dict(enumerate(found)))
            starts, done = np.concatenate([part["last"] for part in found]), done + len(cut)
        return blocks

    def _diagram_until(self, blocks: list[Block], cut: NDArray[np.int64], found: Mapping[int, Arrays]) -> D:
        """The diagram of some blocks, and of those of some starts at the next values."""
        return self.diagram([*blocks, *_of_starts(cut, found)])

    def _cuts(self, starts: int) -> list[NDArray[np.int64]]:
        """The indices of the values of each part, in their order."""
        size = -(-PART // ((self.returns + self.discard) * starts))
        return [self.order[cut] for cut in self.parallel.cuts(len(self.order), size)]


def _of_starts(cut: NDArray[np.int64], found: Mapping[int, Arrays]) -> list[Block]:
    """The blocks of some starts, by their number, at some values."""
    return [(cut, slice(number, number + 1), part) for number, part in found.items()]


def attractors_at(
    map_of: Callable[[float], ReturnMap],
    values: Floats,
    starts: Floats,
    returns: int,
    discard: int,
    tolerance: float,
    first: Floats | None = None,
) -> Arrays:
    """The attractors of starts (S, n) at values, in this order, and the last states: arrays of a diagram.

    Args:
        first: where the last states at one value are the starts at the next, the starts at the first value, shape (S, n), beside
            which states that escape are vast; None where all values have the same starts.
    """

    def run(return_map: ReturnMap, states: Floats) -> Settled:
        return settled(return_map, states, discard, returns, starts if first is None else first, tolerance)

    found, reasons, last = followed(map_of, values, starts, run, first is not None)
    about = {"last": last, "reasons": np.array(reasons, str)}
    if not found:
        return about
    paths = [each.path for each in found]
    tables = {name: np.stack([np.swapaxes(getattr(path, name), 0, 1) for path in paths]) for name in ("turns", "codes")}
    tables["states"] = paths[0].coordinates.wrap(np.stack([np.swapaxes(path.states[1:], 0, 1) for path in paths]))
    tables |= {"scale": np.stack([each.scale for each in found]), "outcome": np.stack([path.outcome[-1] for path in paths])}
    for name in ("length", "period", "label", "is_open"):
        tables[name] = np.array([[getattr(one, name) for one in each.limits] for each in found])
    return {**about, **tables, **names_as_arrays(paths[0].coordinates, paths[0].walls)}
