"""The four kinds of auxiliary maps of a map: outer, inflated by an error, enclosed or sampled."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats, Random
from nsmaps.auxiliary.bounded import Enclosed, of_polynomials
from nsmaps.auxiliary.envelope import AnyMap, AuxiliaryMaps, Envelope, image_function
from nsmaps.auxiliary.sampled import Sampled
from nsmaps.coordinates import BoxLike, as_box
from nsmaps.enclosures.box_images import box_map
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.exact.enclosure.images import BoxMap
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.fit.polymap import PolyMap

How = Literal["outer", "inflated", "enclosed", "sampled"]
ESTIMATED = "inflated by held-out error"  #: the status of what is estimated: the error was sampled at states
Maker = Callable[[Floats], AuxiliaryMaps]


@dataclass(frozen=True, slots=True, eq=False)
class ErrorBound:
    """The distance of a polynomial from the map that it approximates, and how that is known."""

    values: Floats  #: shape (n,), the largest error of each coordinate
    how: Literal["certified", "held-out"]
    of: str = "exact map"  #: the map that it approximates


def auxiliary_maps(return_map: AnyMap, how: How | None = None, error: ErrorBound | None = None, samples: int = 201) -> Maker:
    """A function that computes the auxiliary maps of a map on boxes (n, 2).

    Args:
        how: `outer`: a polynomial map's own, by Bernstein form, rounding included. `inflated`: the same, moved out by `error`,
            for the map that it approximates. `enclosed`: of composite maps, maps given by formulas, and any map with
            `image_boxes`. `sampled`: on grids of `samples` points an axis, of any map, not a bound. None is `outer` or `inflated`
            of a polynomial map, `enclosed` where that can be, and else `sampled`.

    Raises:
        NsmapsError: the map has no such bounds, or `inflated` is given without an error or an error without it.
    """
    best: How = "sampled"
    if isinstance(return_map, PolyMap):
        best = "inflated" if error is not None else "outer"
    elif isinstance(return_map, BoxMap | CompositeMap | PiecewiseMap):
        best = "enclosed"
    chosen = how or best
    if (chosen == "inflated") != (error is not None):
        given = "no error is" if error is None else "an error is"
        raise NsmapsError(f"bounds_kind is {chosen!r} and {given} given; expected: an error with inflated bounds, and only there")
    if chosen in ("outer", "inflated") and isinstance(return_map, PolyMap):
        values = np.zeros(len(return_map.coordinates)) if error is None else error.values
        status = "outer" if error is None else f"inflated by {error.how} error"
        return partial(of_polynomials, return_map, values, status)
    if chosen == "enclosed" and isinstance(return_map, BoxMap | CompositeMap | PiecewiseMap):
        return partial(Enclosed, box_map(return_map), samples)
    if chosen != "sampled":
        enclosed = "enclosed of a composite map, one given by formulas or one with image_boxes"
        choices = f"outer and inflated of a polynomial map, {enclosed}, sampled of any"
        raise NsmapsError(f"bounds_kind is {chosen!r}, of a {type(return_map).__name__}; expected: {choices}")
    return lambda box: Sampled.of(return_map, box, samples)


def held_out_error(polynomial: PolyMap, truth: AnyMap, box: BoxLike, states: int = 20_000, rng: Random = 0) -> ErrorBound:
    """The largest error of a polynomial map at random states and at the corners of a box (n, 2); infinite without image."""
    array = as_box(box, polynomial.coordinates)
    corners = np.stack(np.meshgrid(*array, indexing="ij"), axis=-1).reshape(-1, len(array))
    inside = array[:, 0] + np.ptp(array, axis=1) * np.random.default_rng(rng).random((states, len(array)))
    x = np.concatenate([corners, inside])
    ours, exact = image_function(polynomial, array)(x), image_function(truth, array)(x)
    difference = np.abs(polynomial.coordinates.difference(exact, ours))
    return ErrorBound(np.where(np.isfinite(difference), difference, np.inf).max(axis=0), "held-out")


@checked
def envelopes(system: AnyMap, box: BoxLike, *, n_samples: int = 201, bounds_kind: How | None = None) -> tuple[Envelope, ...]:
    """The auxiliary maps of every coordinate on a box, see `as_box`; `bounds_kind` as in `auxiliary_maps`."""
    return auxiliary_maps(system, bounds_kind, None, n_samples)(as_box(box, system.coordinates)).envelopes()
