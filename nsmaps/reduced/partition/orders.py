"""Step iv: the lowest order of polynomials that meets a tolerance at held-out points."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import FitError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.reduced.fit.polyfit import PolyFit, PolynomialFit, SeparableFit
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.partition.cell import Sample

if TYPE_CHECKING:
    from nsmaps.reduced.partition.spec import Partition, Role

SURE = 0.8  #: share of a strict demand used at the held-out states, since other states may have slightly larger errors


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """The demand on a fit: an error of each coordinate that at most a share of the states may exceed."""

    errors: Floats  #: shape (n,)
    share: float  #: largest share of the held-out states with a larger error; 0 for none


@dataclass(frozen=True, slots=True, eq=False)
class Chosen:
    """The fit that was chosen for a cell, and its errors at the held-out states."""

    map: PolyMap
    order: str  #: such as `full v:3 phi:2` or `separable v:5 phi:5`; `constant` for a reset
    word: str  #: the most frequent word of the cell
    max_error: Floats  #: shape (n,), largest error at the held-out states of any word
    missed: float  #: share of the held-out states with a larger error than demanded
    met: bool  #: True if the demand is met
    states: int  #: held-out states


def orders(coordinates: Sequence[str], highest: int, separable: bool) -> Iterator[tuple[str, PolyFit, int, int]]:
    """The orders that are compared, by their number of terms: constant, separable if requested, and full ones.

    Each is its name, its fit, its number of terms, and the least degree in a coordinate.

    In the plane the degrees of full ones differ by at most one, as in the paper's poly23; in more coordinates they are equal,
    since a fit costs the more there.
    """
    n = len(coordinates)
    found: list[tuple[str, PolyFit, int, int]] = []
    for a in range(highest + 1):
        for beside in range(max(0, a - 1), min(highest, a + 1) + 1) if n == 2 else (a,):
            degrees = dict.fromkeys(coordinates, beside) | {coordinates[0]: a}
            fit = PolynomialFit(degrees=degrees, absolute=())
            name = f"full {_text(degrees)}" if any(degrees.values()) else "constant"
            found.append((name, fit, n * len(fit.exponents(coordinates, coordinates[0])), min(degrees.values())))
        if separable and a:
            degrees = dict.fromkeys(coordinates, a)
            found.append((f"separable {_text(degrees)}", SeparableFit(degrees=degrees, lines=None, absolute=()), n * (a + 1), a))
    yield from sorted(found, key=lambda each: each[2])


def _text(degrees: Mapping[str, int]) -> str:
    return " ".join(f"{name}:{degree}" for name, degree in degrees.items())


def orders_of(spec: "Partition", role: "Role", coordinates: Sequence[str]) -> dict[str, PolyFit]:
    """The fits that are tried in a region: the given ones and then a constant, or polynomials, those of fewest terms first.

    Of regions that attract, constants come after all others: a constant piece takes all states to one, so that
    a chaotic attractor through even the smallest is a stable cycle of the composite map.
    """
    if spec.orders:
        return {**spec.orders, "constant": PolynomialFit(degrees={}, absolute=())}
    lowest = int(role == "attracting")
    known = orders(coordinates, spec.max_order, spec.separable and not lowest)
    return {name: fit for name, fit, _, degree in sorted(known, key=lambda each: each[3] < lowest)}


def highest_of(spec: "Partition", coordinates: Sequence[str]) -> PolyFit:
    """The last of the given fits, or the polynomials of highest order."""
    return [*spec.orders.values(), PolynomialFit(degrees=dict.fromkeys(coordinates, spec.max_order), absolute=())][
        max(len(spec.orders) - 1, 0)
    ]


def choose_order(sample: Sample, demand: Demand, known: Mapping[str, PolyFit]) -> Chosen | None:
    """The first of the known orders that meets a demand, or otherwise the one that comes nearest; None without data.

    Each is fitted to the returns of the most frequent word or family on the cell's grid, and validated at the held-out states,
    which include other ones. If no state may miss the demand, no point of the grid may either.
    """
    data = commonest(sample)
    if data is None:
        return None
    word, surface = data
    best: Chosen | None = None
    for order, fit in known.items():
        try:
            polymap = fit.fit(surface)
        except FitError:
            continue
        error, missed = held_out_error(polymap, sample.held_out, demand)
        count = int(sample.held_out.valid.sum())
        assert polymap.report is not None
        at_most = np.fmax(error, polymap.report.max_error)
        met = missed <= demand.share and bool(demand.share or (at_most <= SURE * demand.errors).all())
        chosen = Chosen(polymap, order, word, error, missed, met, count)
        if chosen.met:
            return chosen
        if best is None or _worse(best, chosen, demand):
            best = chosen
    return best


def commonest(sample: Sample) -> tuple[str, Surface] | None:
    """The returns of the most frequent family or word on a cell's grid, and their commonest word; None if nothing returns."""
    sorts = sample.sorting(sample.returns)
    numbers, counts = np.unique(sorts[sample.inside & sample.returns.valid], return_counts=True)
    if not len(numbers):
        return None
    surface = sample.surface(sorts == numbers[np.argmax(counts)])
    words, counts = np.unique(surface.returns.words, return_counts=True)
    return str(words[np.argmax(counts)]), surface


def held_out_error(polymap: PolyMap, held_out: Returns, demand: Demand) -> tuple[Floats, float]:
    """The largest error of each coordinate at the held-out states that have an image, and the share that misses the demand."""
    exact = held_out.select(held_out.valid)
    if not len(exact):
        return np.zeros(len(held_out.coordinates)), 0.0
    start = exact.coordinates.lift(exact.start, polymap.middle)
    error = errors(polymap(start), exact)
    return error.max(axis=0), float((error > demand.errors).any(axis=1).mean())


def errors(image: Floats, exact: Returns) -> Floats:
    """The errors of images in each coordinate, angles the shorter way round, shape (N, n)."""
    return np.abs(exact.coordinates.difference(image, exact.image))


def _worse(best: Chosen, other: Chosen, demand: Demand) -> bool:
    """True if the other fit is nearer to a demand: fewer states miss it, or as many with a smaller largest error."""
    one, two = ((each.missed, (each.max_error / demand.errors).max()) for each in (best, other))
    return two < one
