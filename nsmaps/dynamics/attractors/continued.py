"""Attractors along a parameter as a result: their basins' shares, distances to the boundary, return times, births and deaths."""

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints, brief
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.dynamics.attractors.attractor import Attractor

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True, slots=True)
class Change:
    """An attractor that is found at one value of the parameter and not at its neighbour."""

    attractor: int
    kind: Literal["birth", "death"]  #: on the way up
    label: str  #: its motion at the value where it is found
    low: float  #: the neighbouring values
    high: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class GlobalContinuation(WithCoordinates):
    """The A attractors that were found at V values of a parameter in ascending order, and their stability against kicks.

    Kicks and distances are Euclidean lengths in which each coordinate has its `scale` as the unit. Arrays of shape (V, A) are NaN
    where an attractor was not found, and distances and times where no kicked orbit arrives in time; `reasons` says where there is
    no map.
    """

    __repr__ = brief

    coordinates: Coordinates
    values: Floats  #: shape (V,)
    reasons: tuple[str, ...]  #: V texts, the reason why there is no map; "" where there is one
    region: Floats  #: shape (n, 2), lower and upper end in each coordinate, where the starts were drawn
    scale: Floats  #: shape (n,)
    samples: int  #: number of starts at each value
    kick: float  #: size of the kicks whose return is timed
    attractors: tuple[Attractor, ...]  #: those found at all values
    index: Ints  #: shape (V, A), the place of each attractor at each value in `attractors`; -1 where it was not found
    share: Floats  #: shape (V, A), share of the starts that arrive at each attractor
    unresolved: Floats  #: shape (V,), share of the starts that arrive at none
    ended: Floats  #: shape (V,), share of the starts whose orbits end
    distance: Floats  #: shape (V, A), the smallest kick found that leads elsewhere, an upper estimate; inf where none does
    return_time: Floats  #: shape (V, A), mean number of returns until a kicked orbit arrives at the attractor again
    return_error: Floats  #: shape (V, A), its standard error
    returned: Floats  #: shape (V, A), share of the timed kicks that come back

    @property
    def share_error(self) -> Floats:
        """The binomial standard error of each share, shape (V, A); the starts are the same at all values."""
        return np.asarray(np.sqrt(self.share * (1 - self.share) / self.samples))

    @property
    def found(self) -> Bools:
        """Where each attractor was found, shape (V, A)."""
        return np.asarray(self.index >= 0)

    @property
    def labels(self) -> NDArray[np.str_]:
        """The motion of each attractor, shape (V, A), such as 1:1/2T; "" where it was not found."""
        return np.array([*(each.label for each in self.attractors), ""], str)[self.index]

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

    def to_xarray(self) -> "Dataset":
        """An xarray dataset with dimensions `value` and `attractor`. Raises NsmapsError without xarray."""
        from nsmaps.datasets import NONE, dataset

        each = "value attractor"
        period = np.array([*(each.period for each in self.attractors), -1])[self.index]
        rows = {
            "share": (each, self.share, NONE, "share of the starts that arrive at the attractor"),
            "share_error": (each, self.share_error, NONE, "binomial standard error of the share"),
            "distance": (each, self.distance, NONE, "smallest kick found that leads elsewhere, in the scale; an upper estimate"),
            "return_time": (each, self.return_time, "returns", "mean number of returns after a kick until arrival"),
            "return_error": (each, self.return_error, "returns", "its standard error"),
            "returned": (each, self.returned, NONE, "share of the timed kicks that come back"),
            "motion": (each, self.labels, NONE, "name of the motion; empty where it was not found"),
            "period": (each, period, "returns", "of the attractor; 0: none, -1: it was not found"),
            "index": (each, self.index, NONE, "place of the attractor among those of all values; -1: it was not found"),
            "unresolved": ("value", self.unresolved, NONE, "share of the starts that arrive at no attractor"),
            "ended": ("value", self.ended, NONE, "share of the starts whose orbits end"),
            "scale": ("coordinate", self.scale, "", "unit of kicks and distances in each coordinate"),
            "region": ("coordinate end", self.region, "", "where the starts were drawn"),
        }
        along = {"value": self.values, "attractor": range(self.share.shape[1])}
        return dataset(self.coordinates, rows, along, samples=self.samples, kick=self.kick)
