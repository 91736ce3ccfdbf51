"""Attractors along a parameter as a result: their basins' shares, distances to the boundary, return times, births and deaths."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints, Storable
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.attractors.attractor import Attractor
from nsmaps.dynamics.attractors.quantifiers import quantifier_array
from nsmaps.results import NONE, RETURNS, Result, array, array_property, range_text


@dataclass(frozen=True, slots=True)
class Change(Storable):
    """An attractor that is found at one value of the parameter and not at its neighbour."""

    attractor: int
    kind: Literal["birth", "death"]  #: on the way up
    label: str  #: its motion at the value where it is found
    low: float  #: the neighbouring values
    high: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GlobalContinuation(WithCoordinates, Result):
    """The A attractors that were found at V values of a parameter in ascending order, and their stability against kicks.

    Kicks and distances are Euclidean lengths in which each coordinate has its `scale` as the unit. Arrays of shape (V, A) are NaN
    where an attractor was not found, and distances and times where no kicked orbit arrives in time; `reasons` says where there is
    no map.
    """

    picture: ClassVar[str] = "nsmaps.figures.longrun.global_continuation"

    coordinates: Coordinates
    parameter: str
    values: Floats = field(metadata=array("value", "values of the parameter, ascending", name="parameter"))
    reasons: tuple[str, ...]  #: V texts, the reason why there is no map; "" where there is one
    box: Floats = field(metadata=array("coordinate end", "lower and upper end of the box where the starts were drawn"))
    scale: Floats = field(metadata=array("coordinate", "unit of kicks and distances"))
    samples: int  #: number of starts at each value
    kick: float  #: size of the kicks whose return is timed
    attractors: tuple[Attractor, ...]  #: those found at all values
    index: Ints = field(
        metadata=array("value attractor", "place of the attractor among those of all values; -1: it was not found", NONE)
    )
    share: Floats = field(metadata=array("value attractor", "share of the starts that arrive at the attractor", NONE))
    unresolved: Floats = field(metadata=array("value", "share of the starts that arrive at no attractor", NONE))
    ended: Floats = field(metadata=array("value", "share of the starts whose orbits end", NONE))
    distance: Floats = field(
        metadata=array("value attractor", "smallest kick found that leads elsewhere, an upper estimate; inf: none does", NONE)
    )
    return_time: Floats = field(metadata=array("value attractor", "mean number of returns after a kick until arrival", RETURNS))
    return_error: Floats = field(metadata=array("value attractor", "standard error of the return time", RETURNS))
    returned: Floats = field(metadata=array("value attractor", "share of the timed kicks that come back", NONE))
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name
    quantifiers: Mapping[str, Floats] = field(default_factory=dict, metadata=quantifier_array("value attractor"))

    def summary(self) -> str:
        """The numbers that matter."""
        kinds = [change.kind for change in self.changes]
        text = f"{len(self.attractors)} attractors at {range_text(self.parameter, self.values)}"
        return f"{text}; {kinds.count('birth')} births, {kinds.count('death')} deaths"

    @array_property("value attractor", "binomial standard error of the share", NONE)
    def share_error(self) -> Floats:
        """The binomial standard error of each share, shape (V, A); the starts are the same at all values."""
        return np.asarray(np.sqrt(self.share * (1 - self.share) / self.samples))

    @property
    def found(self) -> Bools:
        """Where each attractor was found, shape (V, A)."""
        return np.asarray(self.index >= 0)

    @array_property("value attractor", "name of the motion; empty where it was not found", NONE)
    def labels(self) -> NDArray[np.str_]:
        """The motion of each attractor, shape (V, A), such as 1:1/2T; "" where it was not found."""
        return np.array([*(each.label for each in self.attractors), ""], str)[self.index]

    @array_property("value attractor", "returns of a period; 0: without one, -1: it was not found", RETURNS)
    def period(self) -> Ints:
        """The period of each attractor, shape (V, A): 0 without one, -1 where it was not found."""
        return np.array([*(each.period for each in self.attractors), -1])[self.index]

    @property
    def changes(self) -> tuple[Change, ...]:
        """The births and deaths of attractors between neighbouring values with maps, in ascending order."""
        known = [v for v, reason in enumerate(self.reasons) if not reason]
        there, labels, values, changes = self.found, self.labels, self.values.tolist(), list[Change]()
        for low, high in pairwise(known):
            for number in np.flatnonzero(there[low] != there[high]).tolist():
                born = bool(there[high, number])
                label = str(labels[high if born else low, number])
                changes.append(Change(number, "birth" if born else "death", label, values[low], values[high]))
        return tuple(changes)
