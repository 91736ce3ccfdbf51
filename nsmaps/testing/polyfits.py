"""check_polyfit: whether a fit finds the polynomials that it says it has."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, Angle, Coordinates, is_angle, wrap
from nsmaps.errors import CheckError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.reduced.fit.polyfit import PolyFit
from nsmaps.reduced.fit.polymap import PolyMap

LOW, HIGH = 0.5, 1.5  #: of every coordinate of the data
CLOSE = 1e-7  #: of the fitted map to the polynomials that the data come from


def check_polyfit(fit: PolyFit, coordinates: Sequence[str] = ("v", Angle("phi"))) -> None:
    """Check that a fit names monomials and data as it should, and finds again polynomials that are made of its monomials.

    Args:
        coordinates: those that it is made for.

    Raises:
        CheckError: says what is wrong, for which coordinate's image, and what is expected.
    """
    if not isinstance(fit, PolyFit):
        raise CheckError(f"{fit!r} is not a fit; expected: an object of a class that inherits from nsmaps.PolyFit")
    names = Coordinates(coordinates)
    exponents = [_exponents(fit, names, name) for name in names]
    polymap = _polynomials(names, exponents)
    surface = _surface(polymap, 2 * max(int(each.max()) for each in exponents) + 10)
    for name in names:
        _check_data(fit, surface, name)
    fitted = fit.fit(surface)
    for i, name in enumerate(names):
        wanted, found = polymap(surface.start)[:, i], fitted(surface.start)[:, i]
        off = found - (np.abs(wanted) if name in fit.absolute else wanted)
        off = np.abs(wrap(off + np.pi) - np.pi if is_angle(name) else off)[fit.data(surface, name)].max()
        if not off < CLOSE:
            raise CheckError(
                f"{type(fit).__name__} does not find a polynomial of its own monomials again: fitted to {len(surface.start)} "
                f"exact values of {name}', it is {off:.3g} off where it was fitted; expected: less than {CLOSE:g}"
            )


def _exponents(fit: PolyFit, names: Coordinates, output: str) -> np.ndarray:
    """The exponents of an output, checked."""
    given = fit.exponents(names, output)
    subject = f"{type(fit).__name__}.exponents for {output}'"
    if not (isinstance(given, np.ndarray) and given.ndim == 2 and given.shape[1] == len(names) and len(given)):
        what = f"an array of shape {given.shape}" if isinstance(given, np.ndarray) else type(given).__name__
        raise CheckError(f"{subject} is {what}; expected: a row a monomial, shape (m, {len(names)}), one at least")
    if not np.issubdtype(given.dtype, np.integer) or given.min() < 0:
        raise CheckError(f"{subject} has {given.dtype} down to {given.min()}; expected: whole numbers, at least zero")
    rows, counts = np.unique(given, axis=0, return_counts=True)
    if counts.max() > 1:
        raise CheckError(f"{subject} has the monomial {rows[counts.argmax()].tolist()} {counts.max()} times; expected: once")
    return given


def _polynomials(names: Coordinates, exponents: list[np.ndarray]) -> PolyMap:
    """Polynomials of these monomials with random coefficients, over the box of the data."""
    rng, n = np.random.default_rng(2), len(names)
    coefficients = [rng.uniform(0.5, 1, len(each)) * rng.choice([-1, 1], len(each)) / len(each) for each in exponents]
    centre, scale = np.full(n, (LOW + HIGH) / 2), np.full(n, (HIGH - LOW) / 2)
    domain = np.tile([LOW, HIGH], (n, 1))
    return PolyMap(names, tuple(exponents), tuple(coefficients), centre, scale, domain)


def _surface(polymap: PolyMap, points: int) -> Surface:
    """Returns that a map of polynomials would make, on a grid; less than half a turn away from zero."""
    grid = Grid(axes={name: Axis(low=LOW, high=HIGH, points=points) for name in polymap.coordinates})
    start, m = grid.states(), grid.size
    lifted: Floats = polymap(start)
    image = polymap.coordinates.wrap(lifted)
    turns = np.round((lifted - image) / TWO_PI).astype(np.int32)
    rows = np.zeros(m, np.int64), np.full(m, Outcome.returned, np.int8), np.full(m, np.nan)
    return Surface("trial", grid, np.ones(m, bool), Returns(polymap.coordinates, ("B",), start, image, turns, *rows, fitted=True))


def _check_data(fit: PolyFit, surface: Surface, output: str) -> None:
    use = fit.data(surface, output)
    m = len(surface.start)
    if not (isinstance(use, np.ndarray) and use.dtype == bool and use.shape == (m,) and use.any()):
        what = (
            f"{use.dtype} of shape {use.shape}, {np.count_nonzero(use)} of them true"
            if isinstance(use, np.ndarray)
            else repr(use)
        )
        raise CheckError(
            f"{type(fit).__name__}.data for {output}' is {what}; expected: which of the surface's {m} states it is fitted to, an "
            f"array of bool, shape ({m},), some of them true"
        )
