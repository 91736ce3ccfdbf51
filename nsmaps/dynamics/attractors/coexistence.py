"""Coexisting attractors of bifurcation diagrams: distinguished at each value and matched along the parameter."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.dynamics.attractors.attractor import Attractor, kept, may_be_one
from nsmaps.dynamics.attractors.distance import extents, hausdorff
from nsmaps.dynamics.diagrams.diagram import BifurcationDiagram
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.results import NONE, Result, array


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """Neighbouring values over which one attractor was found and has one name."""

    attractor: int  #: the same number along a sweep, also where its name changes, as at a period doubling
    label: str  #: such as 1:1/2T
    low: float  #: least of the values
    high: float  #: greatest of them


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Coexistence(Result):
    """The attractors that S orbits reached at each of V values, in ascending order."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.spans"

    values: Floats = field(metadata=array("value", "values of the parameter", name="parameter"))
    attractor: NDArray[np.int64] = field(
        metadata=array("value orbit", "a number for each attractor; -1 for an orbit that ended", NONE)
    )
    labels: NDArray[np.str_] = field(metadata=array("value orbit", "name of the attractor, one for each number at a value", NONE))
    parameter: str
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many attractors were found at each value, shape (V,)."""
        return np.array([len(set(row.tolist()) - {-1}) for row in self.attractor])

    @property
    def spans(self) -> tuple[Span, ...]:
        """Where each attractor was found under each of its names, by number and value."""
        found: list[Span] = []
        for number in range(int(self.attractor.max(initial=-1)) + 1):
            before = ""
            for value, row, labels in zip(self.values.tolist(), self.attractor, self.labels, strict=True):
                label = next(iter(labels[row == number].tolist()), "")
                if label and label == before:
                    found[-1] = Span(number, label, found[-1].low, value)
                elif label:
                    found.append(Span(number, label, value, value))
                before = label
        return tuple(found)


@checked
def match_attractors(diagrams: Sequence[BifurcationDiagram], *, tolerance: float = 0.03, step: float = 0.1) -> Coexistence:
    """The attractors of bifurcation diagrams over the same values, such as one swept up and one swept down.

    Distances are measured in each coordinate by the extent of all states of the diagrams (`extents`, with the circle). Two
    orbits with periods have the same attractor at a value if all states of either are near one of the other. An orbit without
    a period is a sample of its last 1000 states, which may belong to any attractor that it approaches, by the criterion of
    `basins`: its reach is the distance of its second half from its first, at least `tolerance`, and it is identified with a
    cycle or another sample if most states of either are within the reach of the other. The reach of a sample of less than 50
    states is infinite. Two attractors are therefore distinguished only by orbits that stay apart, and attractors closer than
    their samples resolve count as one. A motion without a period may still be a long transient.

    Args:
        tolerance: share of the extents within which states count as near.
        step: largest distance, as a share, between an attractor and its continuation at the next value.

    Raises:
        NsmapsError: no diagrams, or diagrams over different values; shares that are not above 0.
    """
    if not diagrams or any(not np.array_equal(np.sort(each.values), np.sort(diagrams[0].values)) for each in diagrams):
        raise NsmapsError("the diagrams have different values; expected: one or more diagrams over the same values")
    if not (tolerance > 0 and step > 0):
        raise NsmapsError(f"tolerance is {tolerance}, step {step}; expected: shares of the extents above 0")
    orders = [np.argsort(each.values, kind="stable") for each in diagrams]
    states, labels, held, length = (
        np.concatenate([getattr(each, name)[order] for each, order in zip(diagrams, orders, strict=True)], axis=1)
        for name in ("settled", "labels", "held", "length")
    )
    numbers, names = np.full(held.shape, -1), labels.astype(object)
    if held.any():
        coordinates = diagrams[0].coordinates
        unit = np.max([each.scale for each in diagrams], axis=0)
        scale = extents(states[held].reshape(-1, len(coordinates)), coordinates, unit)
        last: dict[int, Attractor] = {}
        for k, there in enumerate(held):
            every = zip(states[k], length[k].tolist(), labels[k].tolist(), strict=True)
            sets = [kept(coordinates, *each, tolerance, scale) for each, on in zip(every, there, strict=True) if on]
            groups = grouped(sets)
            last = numbered([_shown([sets[s] for s in group]) for group in groups], last, numbers.max() + 1, scale, step)
            for (number, shown), group in zip(last.items(), groups, strict=True):
                own = np.flatnonzero(there)[group]
                numbers[k, own], names[k, own] = number, shown.label
    return Coexistence(np.sort(diagrams[0].values), numbers, names.astype(str), diagrams[0].parameter, diagrams[0].units)


def grouped(sets: list[Attractor]) -> list[list[int]]:
    """The sets, by their places, grouped by attractors to which they may belong, also through other sets."""
    groups: list[list[int]] = []
    for s, own in enumerate(sets):
        alike = [group for group in groups if any(may_be_one(sets[other], own) for other in group)]
        groups = [group for group in groups if group not in alike] + [sorted([*chain(*alike), s])]
    return sorted(groups)


def _shown(sets: list[Attractor]) -> Attractor:
    """The representative of several sets of one attractor: that of the least period, otherwise of the most general name."""
    return min(sets, key=lambda each: (each.period or np.inf, len(each.label)))


def numbered(sets: list[Attractor], last: dict[int, Attractor], unused: int, scale: Floats, step: float) -> dict[int, Attractor]:
    """Sets of states by number: that of the last one that they continue, the nearest pairs first, otherwise an unused number."""
    pairs = sorted(
        (hausdorff(old.states, new.states, new.coordinates, scale), number, i)
        for number, old in last.items()
        for i, new in enumerate(sets)
    )
    known: dict[int, int] = {}
    for distance, number, i in pairs:
        samples = not (last[number].period or sets[i].period)
        continues = may_be_one(last[number], sets[i]) if samples else distance <= step
        if continues and i not in known and number not in known.values():
            known[i] = number
    fresh = count(unused)
    return {known[i] if i in known else next(fresh): each for i, each in enumerate(sets)}
