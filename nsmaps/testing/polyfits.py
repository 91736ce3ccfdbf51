"""check_polyfit: whether a fit finds the maps that it says it can."""

from collections.abc import Mapping, Sequence

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import TWO_PI, Angle, BoxLike, Coordinates, as_box, is_angle, wrap
from nsmaps.errors import CheckError, FitError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.reduced.fit.lifts import with_windings
from nsmaps.reduced.fit.polyfit import PolyFit, scaling
from nsmaps.reduced.fit.polymap import PolyMap, design
from nsmaps.reduced.fit.variables import values_of

LOW, HIGH = 0.5, 1.5  #: of every coordinate of the data, unless a box is given
CLOSE = 1e-7  #: of the fitted map to the one that the data come from
ALIKE = 1e-10  #: singular value of normed terms, relative to the largest, below which they are linearly dependent
TAKES_PART = 1e-3  #: of a vanishing combination of terms


def check_polyfit(fit: PolyFit, coordinates: Sequence[str] = ("v", Angle("phi")), box: BoxLike | None = None) -> None:
    """Check that a fit names its terms and data as it should, and finds again a map that is made of its terms.

    Args:
        coordinates: those that it is made for.
        box: where the data lie, see `nsmaps.Box`; by default [0.5, 1.5] of every coordinate, and of angles that images wind
            with the whole circle.

    Raises:
        CheckError: says what is wrong, for which coordinate's image, and what is expected.
    """
    if not isinstance(fit, PolyFit):
        raise CheckError(f"{fit!r} is not a fit; expected: an object of a class that inherits from nsmaps.PolyFit")
    names, subject = Coordinates(coordinates), type(fit).__name__
    try:
        texts, windings = fit.texts(names), fit.windings(names)
        exponents = [_exponents(fit, names, texts, name) for name in names]
        grid = _grid(names, windings, box, 2 * max(int(each.max()) for each in exponents) + 10)
        polymap = _trial(names, texts, exponents, grid, subject)
        surface = _surface(with_windings(polymap, windings), grid)
        for name in names:
            _check_data(fit, surface, name)
        fitted = fit.fit(surface)
    except FitError as error:
        raise CheckError(f"{subject}: {error}") from error
    for i, name in enumerate(names):
        wanted, found = surface.lifted[:, i], fitted(surface.start)[:, i]
        off = found - (np.abs(wanted) if name in fit.absolute else wanted)
        off = np.abs(wrap(off + np.pi) - np.pi if is_angle(name) else off)[fit.data(surface, name)].max()
        if not off < CLOSE:
            raise CheckError(
                f"{subject} does not find a map of its own terms again: fitted to {len(surface.start)} "
                f"exact values of {name}', it is {off:.3g} off where it was fitted; expected: less than {CLOSE:g}"
            )


def _exponents(fit: PolyFit, names: Coordinates, texts: Sequence[str] | None, output: str) -> Ints:
    """The exponents of an output, checked."""
    given, k = fit.exponents(names, output), len(names if texts is None else texts)
    subject = f"{type(fit).__name__}.exponents for {output}'"
    if not (isinstance(given, np.ndarray) and given.ndim == 2 and given.shape[1] == k and len(given)):
        what = f"an array of shape {given.shape}" if isinstance(given, np.ndarray) else type(given).__name__
        of = f" in {', '.join(texts)}" if texts is not None else ""
        raise CheckError(f"{subject} is {what}; expected: a row a monomial{of}, shape (m, {k}), one at least")
    if not np.issubdtype(given.dtype, np.integer) or given.min() < 0:
        raise CheckError(f"{subject} has {given.dtype} down to {given.min()}; expected: whole numbers, at least zero")
    rows, counts = np.unique(given, axis=0, return_counts=True)
    if counts.max() > 1:
        raise CheckError(f"{subject} has the monomial {rows[counts.argmax()].tolist()} {counts.max()} times; expected: once")
    return given


def _grid(names: Coordinates, windings: Mapping[int, int], box: BoxLike | None, points: int) -> Grid:
    """The starts of the data."""
    ends = np.tile([LOW, HIGH], (len(names), 1)) if box is None else as_box(box, names)
    if box is None:
        ends[list(windings)] = [0.0, TWO_PI * (1 - 1 / points)]
    return Grid(axes={name: Axis(low=low, high=high, points=points) for name, (low, high) in zip(names, ends, strict=True)})


def _trial(names: Coordinates, texts: tuple[str, ...] | None, exponents: Sequence[Ints], grid: Grid, subject: str) -> PolyMap:
    """A map of these terms with random coefficients, over the box of the data, where they must differ."""
    rng, start = np.random.default_rng(2), grid.states()
    x = start if texts is None else values_of(texts, names, start)
    for text, values in zip(texts or names, x.T, strict=True):
        if len(lost := start[~np.isfinite(values)]):
            at = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, lost[0], strict=True))
            expected = "expected: variables that are finite on the data, or a `box` on which they are"
            raise CheckError(
                f"{subject}: the variable {text} is not finite at {len(lost)} of {len(x)} states, as {at}; {expected}"
            )
    centre, scale = scaling(x, None if texts is None else exponents)
    for name, each in zip(names, exponents, strict=True):
        _check_independent(f"{subject} for {name}'", texts or names.names, each, (x - centre) / scale)
    coefficients = [rng.uniform(0.5, 1, len(each)) * rng.choice([-1, 1], len(each)) / len(each) for each in exponents]
    domain = np.stack([start.min(axis=0), start.max(axis=0)], axis=1)
    return PolyMap(names, tuple(exponents), tuple(coefficients), centre, scale, domain, variables=texts)


def _check_independent(subject: str, texts: Sequence[str], exponents: Ints, scaled: Floats) -> None:
    """Raise a CheckError if the terms of exponents (m, k) are linearly dependent at scaled variables (N, k)."""
    columns = design(exponents, scaled)
    size = np.linalg.norm(columns, axis=0)
    _, singular, rows = np.linalg.svd(columns / np.where(size > 0, size, 1.0), full_matrices=False)
    if singular[-1] > ALIKE * singular[0]:
        return
    part = np.abs(rows[-1]) > TAKES_PART
    terms = ", ".join(_title(texts, each) for each in exponents[part].tolist())
    raise CheckError(
        f"{subject}: its {len(exponents)} terms are linearly dependent on the data, among them {terms}; expected: terms of which "
        "none is a sum of others, or a `box` in which none is"
    )


def _title(texts: Sequence[str], exponents: Sequence[int]) -> str:
    """A monomial in text."""
    factors = [text if power == 1 else f"({text})**{power}" for text, power in zip(texts, exponents, strict=True) if power]
    return "*".join(factors) or "1"


def _surface(polymap: PolyMap, grid: Grid) -> Surface:
    """Returns that a map would make, on a grid."""
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
