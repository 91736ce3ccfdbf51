"""Cells of a partition: boxes cut by curves or surfaces of low order, written as conditions, with samples of the exact map."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import count, islice, product

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import TWO_PI, Coordinates, WithCoordinates, is_angle
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.family import ReturnFamily, membership
from nsmaps.exact.surfaces.surface import Axis, Grid, Surface
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region, as_condition

SIDE, HELD_OUT = 40, 2000  #: points along a cell's grid in the plane, and random held-out points
FIRST = np.iinfo(np.int64).min + 1  #: the number of the first family, which no word has
NO_IMAGE = (Outcome.rests, Outcome.escaped, Outcome.invalid)
FEW = 20  #: if a cell holds less than one in so many of the points around it, its grid is drawn around those


def side_of(n: int, side: int) -> int:
    """The points along each axis of a grid in n coordinates with 2^(n - 2) times as many points as one of side^2."""
    return max(4, round((2.0 ** (n - 2) * side**2) ** (1 / n)))


@lru_cache(maxsize=256)
def powers(others: int, terms: int) -> tuple[tuple[int, ...], ...]:
    """The exponents of the first monomials in some coordinates, by degree; in one coordinate its increasing powers."""
    graded = (each for degree in count() for each in product(range(degree, -1, -1), repeat=others) if sum(each) == degree)
    return tuple(islice(graded, terms)) if others else ((),)


@dataclass(frozen=True, slots=True)
class Cut:
    """The curve or surface x_dependent = q(others) and the selected side of it; q is a polynomial, constant for a plain bound."""

    dependent: int
    coefficients: tuple[float, ...]  #: of the first monomials in the other coordinates, see `powers`
    above: bool

    @property
    def order(self) -> int:
        """The number of coefficients beside the constant: in the plane, the degree of q."""
        return len(self.coefficients) - 1

    def text(self, coordinates: Sequence[str]) -> str:
        """The side as a condition, such as `v > 0.63 - 0.53*phi`."""
        others = [name for i, name in enumerate(coordinates) if i != self.dependent]
        terms = []
        for value, exponents in zip(self.coefficients, powers(len(others), len(self.coefficients)), strict=True):
            factors = [name if k == 1 else f"{name}**{k}" for name, k in zip(others, exponents, strict=True) if k]
            terms.append("*".join([repr(value), *factors]))
        curve = " + ".join(terms).replace("+ -", "- ")
        return f"{coordinates[self.dependent]} {'>' if self.above else '<='} {curve}"

    def beyond(self, states: Floats) -> Bools:
        """A mask of the states (N, n) above the curve, shape (N,)."""
        others = np.delete(states, self.dependent, axis=1)
        monomials = np.array(powers(others.shape[1], len(self.coefficients)))
        q = sum(c * np.prod(others**each, axis=1) for c, each in zip(self.coefficients, monomials, strict=True))
        return np.asarray(states[:, self.dependent] > q)

    def replaces(self, other: "Cut") -> bool:
        """True if this cut, made later, is the other one moved inwards."""
        same = (self.dependent, self.above, self.coefficients[1:]) == (other.dependent, other.above, other.coefficients[1:])
        return same and (self.coefficients[0] >= other.coefficients[0]) == self.above

    def sides(self) -> "tuple[Cut, Cut]":
        """The side below the curve and the side above it."""
        return replace(self, above=False), replace(self, above=True)


@dataclass(frozen=True)
class Cell(WithCoordinates):
    """A box cut by curves: the states of one region of a partition."""

    coordinates: Coordinates
    bounds: tuple[tuple[float, float], ...]  #: of the box, one pair a coordinate
    closed: tuple[bool, ...] = ()  #: True if the lower bound belongs to the cell, as all do if omitted
    cuts: tuple[Cut, ...] = ()  #: curves; plain bounds are in `bounds`
    conditions: tuple[str, ...] = ()  #: further ones, of the given regions in which it lies or does not
    hull: tuple[tuple[float, float], ...] = ()  #: a box around the cell within the curves; the bounds without them

    def cut(self, cut: Cut) -> "Cell":
        """The part of the cell on one side of a curve."""
        if cut.order:
            others = tuple(other for other in self.cuts if not cut.replaces(other))
            return replace(self, cuts=(*others, cut))._shrunk()
        i, value = cut.dependent, cut.coefficients[0]
        bounds, closed = list(self.bounds), list(self.closed or (True,) * len(self.bounds))
        bounds[i] = (value, bounds[i][1]) if cut.above else (bounds[i][0], value)
        closed[i] = closed[i] and not cut.above
        return replace(self, bounds=tuple(bounds), closed=tuple(closed))._shrunk()

    def where(self, conditions: Sequence[str]) -> "Cell":
        """The part of the cell in which conditions hold."""
        return replace(self, conditions=(*self.conditions, *conditions))._shrunk()

    @cached_property
    def text(self) -> str:
        """The cell as a condition."""
        texts = []
        ends = self.closed or (True,) * len(self.bounds)
        for name, (low, high), closed in zip(self.coordinates, self.bounds, ends, strict=True):
            around = is_angle(name)
            below = "" if around and closed and low == 0 else f"{low!r} {'<=' if closed else '<'} "
            above = "" if around and high == TWO_PI else f" <= {high!r}"
            texts += [f"{below}{name}{above}"] if below or above else []
        texts += [*(cut.text(self.coordinates) for cut in self.cuts), *(f"({each})" for each in self.conditions)]
        return " and ".join(texts) or f"{self.coordinates[0]} == {self.coordinates[0]}"

    @cached_property
    def region(self) -> ConditionRegion:
        """The cell as a region of a composite map."""
        return ConditionRegion(text=self.text, coordinates=self.coordinates)

    @cached_property
    def around(self) -> Floats:
        """The box in which samples are taken, shape (n, 2)."""
        return np.array(self.hull or self.bounds, float)

    def _shrunk(self) -> "Cell":
        """The cell with a hull around the part of its box within its curves, found on grids."""
        box = np.array(self.bounds, float)
        if self.cuts or self.conditions:
            for _ in range(3):
                grid = _grid(self.coordinates, box, 4 * SIDE)
                states = grid.states()
                inside = states[self.region.contains(states)]
                if not len(inside):
                    break
                margin = (box[:, 1] - box[:, 0]) / (np.array(grid.shape) - 1)
                low, high = inside.min(axis=0) - margin, inside.max(axis=0) + margin
                box = np.column_stack([np.maximum(low, box[:, 0]), np.minimum(high, box[:, 1])])
        hull = tuple((float(low), float(high)) for low, high in box)
        return replace(self, hull=hull)


@dataclass(frozen=True, slots=True)
class Sorting:
    """The families by which returns are sorted, the first that contains a return before the others; words without any."""

    families: tuple[ReturnFamily, ...] = ()

    def __call__(self, returns: Returns) -> Ints:
        """A number for each return, shape (N,): that of its family or word."""
        number = returns.codes
        for k, family in reversed(list(enumerate(self.families))):
            number = np.where(membership(family, returns) & returns.valid, FIRST + k, number)
        return number

    def pieces(self, return_map: ReturnMap, states: Floats) -> Ints:
        """Numbers of states (N, n) that change at every border of a smooth piece and of a family, shape (N, c)."""
        itineraries = return_map.itineraries(states)
        codes = np.where(np.isin(itineraries.outcome, NO_IMAGE), -(2**62), itineraries.codes)
        return np.column_stack([codes, *([self(return_map.first_return(states))] if self.families else [])])


BY_WORDS = Sorting()


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Exact returns in a cell: on a grid for the fits, and at random places for their errors."""

    grid: Grid
    inside: Bools  #: shape (grid.size,), mask of the grid points in the cell
    returns: Returns  #: of the whole grid
    held_out: Returns  #: of random states in the cell
    area: float  #: of the cell
    sorting: Sorting = BY_WORDS

    def restricted(self, cut: Cut) -> "Sample":
        """The part of the sample on one side of a curve."""
        inside = self.inside & (cut.beyond(self.returns.start) == cut.above)
        mask = cut.beyond(self.held_out.start) == cut.above
        share = float(mask.mean()) if len(mask) else 0.0
        return replace(self, inside=inside, held_out=self.held_out.select(mask), area=self.area * share)

    def surface(self, mask: Bools) -> Surface:
        """The selected returns of grid points in the cell with an image, as data for a fit."""
        member = self.inside & self.returns.valid & mask
        return Surface("cell", self.grid, member, self.returns.select(member))


def sample(
    return_map: ReturnMap,
    cell: Cell,
    taken: Sequence[Region] = (),
    side: int = SIDE,
    held_out: int = HELD_OUT,
    sorting: Sorting = BY_WORDS,
) -> Sample:
    """The exact returns in a cell, without the states of other regions."""
    low, high = cell.around.T
    random = np.random.default_rng(0).uniform(low, high, (held_out, len(low)))
    free = _free(random, cell, taken)
    area = float(np.prod(high - low) * free.mean())
    if free.any():  # as many in a thin cell as in a box
        more = np.random.default_rng(1).uniform(low, high, (int(held_out * min(20.0, 1 / free.mean() - 1)), len(low)))
        random = np.concatenate([random[free], more[_free(more, cell, taken)]])
    else:
        random = random[:0]
    few = 0 < len(random) < held_out / FEW
    grid = _grid(cell.coordinates, np.column_stack([random.min(axis=0), random.max(axis=0)]) if few else cell.around, side)
    states = grid.states()
    return Sample(
        grid, _free(states, cell, taken), return_map.first_return(states), return_map.first_return(random), area, sorting
    )


def rounded(value: float, width: float) -> float:
    """The value with as many decimals as resolve a thousandth of the width."""
    return round(float(value), max(0, 3 - int(np.floor(np.log10(width)))) if width > 0 else 17)


def _free(states: Floats, cell: Cell, taken: Sequence[Region]) -> Bools:
    inside = cell.region.contains(states)
    for region in taken:
        inside &= ~region.contains(states)
    return inside


def _grid(coordinates: Sequence[str], box: Floats, side: int) -> Grid:
    """A grid over a box (n, 2), of `side` points along each axis in the plane."""
    points = side_of(len(box), side)
    return Grid(axes={name: Axis(low=low, high=high, points=points) for name, (low, high) in zip(coordinates, box, strict=True)})


def roots(names: Sequence[str], box: Floats) -> list[Cell]:
    """The cells that make up a box, with angles in [0, 2 pi], as in conditions."""
    coordinates, spans = Coordinates(names), [[(float(low), float(high))] for low, high in box]
    for i in np.flatnonzero(coordinates.angles):
        low, high = box[i] - TWO_PI * np.floor(box[i, 0] / TWO_PI)
        spans[i] = (
            [(float(low), float(high))] if high <= TWO_PI else [(float(low), TWO_PI), (0.0, float(min(high - TWO_PI, low)))]
        )
    return [Cell(coordinates, bounds) for bounds in product(*spans) if all(low < high for low, high in bounds)]


def cells_of(names: Sequence[str], given: Region | Mapping[str, tuple[float, float]], box: Floats) -> list[Cell]:
    """The cells that make up a given box, or the part of another region in a box (n, 2)."""
    if isinstance(given, Region) and not isinstance(given, Box):
        return [cell.where([as_condition(given).text]) for cell in roots(names, box)]
    bounds = given.bounds if isinstance(given, Box) else given
    return roots(names, Box.model_validate({"coordinates": names, "bounds": bounds}).array)


def parts_of(cells: Sequence[Cell], regions: Sequence[Region]) -> list[Cell]:
    """The parts of cells in each of some regions and in none of those before it, and in none of them."""
    texts = [as_condition(region).text for region in regions]
    parts = [[*(f"not ({text})" for text in texts[:k]), *texts[k : k + 1]] for k in range(len(texts) + 1)]
    return [cell.where(part) if part else cell for cell in cells for part in parts]
