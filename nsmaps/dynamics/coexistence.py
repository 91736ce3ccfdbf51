"""Which attractors of bifurcation diagrams coexist: told apart at each value and matched along the parameter."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.dynamics.bifurcation import Bifurcation
from nsmaps.dynamics.distance import hausdorff
from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Span:
    """Neighbouring values over which one attractor was found and has one name."""

    attractor: int  #: the same number along a sweep, also where its name changes, as at a period doubling
    label: str  #: such as 1:1/2T
    low: float  #: least of the values
    high: float  #: greatest of them


@dataclass(frozen=True, slots=True, eq=False)
class Coexistence:
    """The attractors that S orbits reached at each of V values, in rising order."""

    values: Floats  #: shape (V,)
    attractor: NDArray[np.int64]  #: shape (V, S), a number for each attractor; -1 for an orbit that ended
    labels: NDArray[np.str_]  #: shape (V, S)

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


def coexistence(diagrams: Sequence[Bifurcation], near: float = 0.1) -> Coexistence:
    """The attractors of bifurcation diagrams over the same values, such as one swept up and one swept down.

    Orbits have the same attractor at a value if their states lie within `near` of one another (Hausdorff distance, the circle
    counted); an attractor goes on at the next value as the nearest one within `near` there.

    Raises:
        NsmapsError: no diagrams, or of other values.
    """
    if not diagrams or any(not np.array_equal(np.sort(each.values), np.sort(diagrams[0].values)) for each in diagrams):
        raise NsmapsError("the diagrams have not the same values; accepted: one or more diagrams over the same values")
    orders = [np.argsort(each.values, kind="stable") for each in diagrams]
    states, labels, held = (
        np.concatenate([getattr(each, name)[order] for each, order in zip(diagrams, orders, strict=True)], axis=1)
        for name in ("states", "labels", "held")
    )
    coordinates = diagrams[0].coordinates
    numbers = np.full(held.shape, -1)
    last: dict[int, Floats] = {}
    used = 0
    for k in range(len(numbers)):
        groups = _groups(states[k], np.flatnonzero(held[k]).tolist(), coordinates, near)
        sets = [states[k, group[0]] for group in groups]
        known = _matches(last, sets, coordinates, near)
        last = {}
        for i, group in enumerate(groups):
            number = known.get(i, used)
            used += i not in known
            numbers[k, group], last[number] = number, sets[i]
    return Coexistence(np.sort(diagrams[0].values), numbers, labels.astype(str))


def _groups(states: Floats, held: list[int], coordinates: Sequence[str], near: float) -> list[list[int]]:
    """Which of the orbits that are held, of states (S, K, n), are on one attractor."""
    groups: list[list[int]] = []
    for s in held:
        alike = [g for g in groups if hausdorff(states[g[0]], states[s], coordinates) <= near]
        if alike:
            alike[0].append(s)
        else:
            groups.append([s])
    return groups


def _matches(last: dict[int, Floats], sets: list[Floats], coordinates: Sequence[str], near: float) -> dict[int, int]:
    """The numbers of sets of states that go on from the last ones, by their place; the nearest pairs first."""
    pairs = sorted((hausdorff(old, new, coordinates), number, i) for number, old in last.items() for i, new in enumerate(sets))
    known: dict[int, int] = {}
    for apart, number, i in pairs:
        if apart <= near and i not in known and number not in known.values():
            known[i] = number
    return known
