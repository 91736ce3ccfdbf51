"""The arguments of a plane, read and refused."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.dynamics.planes.pixels import Way
from nsmaps.dynamics.returnmap import Model, first_map, map_along
from nsmaps.errors import NsmapsError, check_choice
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.surfaces.surface import Axis
from nsmaps.exact.systems.parameters import System


def observables_of(system: ReturnMap, observables: Sequence[ObservableLike]) -> tuple[Observable, ...]:
    """The observables of a system, in order; there may be none."""
    if not observables:
        return ()
    from nsmaps.exact.observables.formulas import resolve_observables

    return resolve_observables(System.require(system, "observables"), observables)


def values_of(name: str, given: "Axis | ArrayLike") -> Floats:
    """The values of a parameter; NsmapsError unless they are finite and ascend."""
    values = given.values() if isinstance(given, Axis) else np.asarray(given, float)
    if values.ndim != 1 or not len(values) or not np.isfinite(values).all() or not (np.diff(values) > 0).all():
        raise NsmapsError(f"the values of {name!r} are {given!r:.80}; expected: finite numbers in ascending order, or an Axis")
    return values


def maps_over(system: Model, axes: Mapping[str, Floats]) -> tuple[Callable[..., ReturnMap], ReturnMap]:
    """The map as a function of both parameters, and the first one over their values.

    Raises:
        NsmapsError: there are not two parameters of the system, or no values of them have a map.
    """
    if len(axes) != 2:
        known = ", ".join(getattr(system, "parameters", ())) or "the map, with their values"
        raise NsmapsError(f"the plane is of {', '.join(axes) or 'no parameter'}; expected: two different parameters of {known}")
    map_of = map_along(system, *axes)
    pixels = np.stack(np.meshgrid(*axes.values()), axis=-1).reshape(-1, 2)
    return map_of, first_map(map_of, pixels, "pixels")


def check_length(returns: int, discard: int, max_period: int, tolerance: float) -> None:
    """Refuse numbers of returns in which no period can be found."""
    if max_period < 1 or discard < 0 or returns < 2 * max_period:
        text = f"{returns} returns after {discard}, periods up to {max_period}"
        raise NsmapsError(f"{text}; expected: at least 2 max_period returns, after at least 0, and periods from 1 on")
    if not tolerance > 0:
        raise NsmapsError(f"the tolerance is {tolerance}; expected: a number above 0")


def check_refine(refine: int | None, direction: Way | None) -> None:
    """Refuse a refinement of other steps, or of orbits that are followed from pixel to pixel."""
    check_choice("direction", direction, ("up", "down", "both", None))
    if refine is not None and (refine < 1 or refine.bit_count() != 1):
        raise NsmapsError(f"refine is {refine}; expected: a power of two, such as 16, or None")
    if refine is not None and direction is not None:
        raise NsmapsError("orbits that are followed need every pixel; expected: no 'direction', or no 'refine'")
