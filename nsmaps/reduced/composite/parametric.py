"""Composite maps whose coefficients are polynomials of a parameter, in well-conditioned form (appendix, coefficients in d)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from nsmaps.arrays import Floats, Ints
from nsmaps.coordinates import Coordinates, WithCoordinates
from nsmaps.errors import FitError, NsmapsError, near_match
from nsmaps.errors.arguments import checked
from nsmaps.exact.surfaces.surface import Surface
from nsmaps.reduced.composite.composite import CompositeMap, Piece, piece_named
from nsmaps.reduced.fit.lifts import unwrapped
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.results import Result, array

Degrees = int | Mapping[str, int]  #: degree in the parameter, of all images or by coordinate


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ParametricReport(Result):
    """Errors of a parametric map at held-out values of the parameter; P fitted pieces, H values."""

    names: tuple[str, ...]
    values: Floats = field(metadata=array("value", "held-out values of the parameter"))
    refit: Floats = field(
        metadata=array("piece value component", "largest error of a map fitted at the value itself, at its data")
    )
    error: Floats = field(
        metadata=array("piece value component", "largest error of the parametric map at the same data of the exact map")
    )
    difference: Floats = field(metadata=array("piece value component", "largest difference between both maps there"))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ParametricMap(WithCoordinates, Result):
    """A composite map for every value of a parameter from `low` to `high`.

    The map of a piece is a PolyMap in the coordinates and the parameter, which it leaves unchanged; all values share one
    scaling. So `piece("R1").map.symbolic("v")` is the polynomial in (v, phi, d), and `monomial_error` its rounding error.
    """

    parameter: str
    low: float
    high: float
    coordinates: Coordinates
    walls: tuple[str, ...]
    pieces: tuple[Piece, ...]
    nodes: Floats = field(metadata=array("node", "the values from which it is computed"))
    condition: float  #: of the least squares problem of the coefficients over the parameter
    report: ParametricReport | None = None  #: None if no piece is fitted, as for printed maps

    def summary(self) -> str:
        """The numbers that matter."""
        names = ", ".join(each.name for each in self.pieces)
        over = f"{self.parameter} in [{self.low:g}, {self.high:g}]"
        return f"{len(self.pieces)} pieces over {over} from {len(self.nodes)} values: {names}"

    def at(self, value: float) -> CompositeMap:
        """The composite map at one value. NsmapsError outside [low, high]: polynomials are meaningless beyond the data."""
        if not self.low <= value <= self.high:
            ends = f"{self.parameter} from {self.low!r} to {self.high!r}, where the map was fitted"
            raise NsmapsError(f"{self.parameter} is {value!r}; expected: {ends}")
        pieces = tuple(replace(piece, map=_at(piece.map, self.coordinates, value)) for piece in self.pieces)
        return CompositeMap(self.coordinates, self.walls, pieces)

    def piece(self, name: str) -> Piece:
        """The piece of a name; its map is one of the coordinates and the parameter."""
        return piece_named(self.pieces, name)


@checked
def chebyshev_nodes(bounds: tuple[float, float], n_nodes: int) -> Floats:
    """The zeros of the Chebyshev polynomial of degree `n_nodes` between two bounds, rising, shape (n_nodes,)."""
    low, high = bounds
    return np.asarray((low + high) / 2 - (high - low) / 2 * np.cos(np.pi * (np.arange(n_nodes) + 0.5) / n_nodes), float)


@checked
def parametric_map(
    composites: Mapping[float, CompositeMap],
    parameter: str,
    bounds: tuple[float, float],
    degree: int,
    degrees: Mapping[str, Degrees] = MappingProxyType({}),
) -> ParametricMap:
    """The parametric map of composite maps of the same pieces at K values of a parameter, by least squares of some degree.

    Coefficients are first transformed, exactly, to one scaling for each piece, and angles to one turn.

    Args:
        composites: by value of the parameter.
        parameter: its name.
        bounds: least and greatest value, between which the map is valid.
        degree: the degree of coefficients in the parameter.
        degrees: other degrees, by piece, of all its images or by coordinate, as the paper's 4 of f2 and 5 of g2.

    Raises:
        FitError: fewer values than the highest degree needs, composites of different pieces, or degrees of other names.
    """
    low, high = bounds
    if not composites:
        raise FitError("there are no composites; expected: a composite map at each of several values")
    composites = dict(sorted(composites.items()))  # so that angles can be followed from value to value
    nodes = np.array(list(composites), float)
    first, *others = composites.values()
    table = _degrees(first, degree, degrees)
    highest = max(max(row) for row in table)
    if len(np.unique(nodes)) <= highest:
        raise FitError(f"degree {highest} of {parameter!r} from {len(nodes)} values; expected: at least {highest + 1} values")
    if composed := next((p.name for c in composites.values() for p in c.pieces if p.map.variables is not None), None):
        raise FitError(f"the piece {composed!r} has other variables than the coordinates; expected: `full` or `separable` fits")
    if any([piece.name for piece in other.pieces] != [piece.name for piece in first.pieces] for other in others):
        raise FitError("composite maps of different pieces; expected: the same pieces at every value")
    powers = np.asarray(chebvander((nodes - (low + high) / 2) / ((high - low) / 2), highest), float)
    pieces = []
    for k, piece in enumerate(composites[nodes[len(nodes) // 2]].pieces):
        maps = [composite.pieces[k].map for composite in composites.values()]
        own = [powers[:, : degree + 1] for degree in table[k]]
        pieces.append(replace(piece, map=_joined(maps, parameter, np.array([low, high]), own)))
    condition = float(np.linalg.cond(powers))
    return ParametricMap(parameter, low, high, first.coordinates, first.walls, tuple(pieces), nodes, condition)


def _degrees(composite: CompositeMap, degree: int, degrees: Mapping[str, Degrees]) -> list[list[int]]:
    """The degree in the parameter of every image of every piece."""
    for name, of in degrees.items():
        composite.piece(name)
        for coordinate in of if isinstance(of, Mapping) else ():
            if coordinate not in composite.coordinates:
                near = near_match(coordinate, composite.coordinates)
                expected = ", ".join(composite.coordinates)
                raise FitError(f"the degree of {coordinate!r}{near} in the piece {name!r}; expected: {expected}")
    given = [degrees.get(piece.name, degree) for piece in composite.pieces]
    return [[of.get(name, degree) if isinstance(of, Mapping) else of for name in composite.coordinates] for of in given]


def report_on(parametric: ParametricMap, held: Sequence[tuple[float, CompositeMap, Mapping[str, Surface]]]) -> ParametricReport:
    """The errors at held-out values: each with the map fitted there and the exact data of each piece."""
    names = tuple(held[0][2])
    errors = [[_errors(parametric.at(value), refit, name, data[name]) for value, refit, data in held] for name in names]
    refit, error, difference = np.moveaxis(np.array(errors).reshape(len(names), len(held), 3, -1), 2, 0)
    return ParametricReport(names, np.array([value for value, _, _ in held]), refit, error, difference)


def _errors(ours: CompositeMap, refit: CompositeMap, name: str, data: Surface) -> Floats:
    """Largest errors of the refit and of ours, and the largest difference between both, shape (3, n)."""
    start, target = unwrapped(data)
    a, b = (
        formulas(composite._near(formulas, start)) for composite in (ours, refit) for formulas in (composite.piece(name).map,)
    )
    return np.abs(data.coordinates.difference([b, a, a], [target, target, b])).max(axis=1)


def _joined(maps: Sequence[PolyMap], parameter: str, ends: Floats, powers: Sequence[Floats]) -> PolyMap:
    """One map of the coordinates and the parameter from the maps at its values; powers (K, degree + 1) of each image."""
    first, maps = maps[0], _on_one_turn(maps)
    domains = np.array([each.domain for each in maps])
    box = np.stack([domains[:, :, 0].min(axis=0), domains[:, :, 1].max(axis=0)], axis=1)
    flat = np.ptp(box, axis=1, keepdims=True) == 0  # data on one line of the grid at every value
    sides = np.where(flat, box + np.array([-1.0, 1.0]), box)
    alike = maps if np.isinf(box).any() else [each.over(sides) for each in maps]  # a reset has no box and needs none
    whole = [_joined_output(alike, i, powers[i]) for i in range(len(first.coordinates))]
    n, middle, half = len(first.coordinates), ends.mean(), np.ptp(ends) / 2
    identity = np.array([[0] * n + [0], [0] * n + [1]]), np.array([middle, half])
    exponents, coefficients = zip(*whole, identity, strict=True)
    centre, scale = np.append(alike[0].centre, middle), np.append(alike[0].scale, half)
    names, domain = Coordinates((*first.coordinates, parameter)), np.vstack([box, ends])
    return PolyMap(names, exponents, coefficients, centre, scale, domain, first.absolute)


def _on_one_turn(maps: Sequence[PolyMap]) -> list[PolyMap]:
    """The maps at increasing values of a parameter, with their angles on consecutive turns."""
    centres = np.array([each.centre for each in maps])
    shifts = np.where(maps[0].coordinates.angles, np.unwrap(centres, axis=0) - centres, 0.0)
    moved = [(each.centre + shift, each.domain + shift[:, None]) for each, shift in zip(maps, shifts, strict=True)]
    return [replace(each, centre=centre, domain=domain) for each, (centre, domain) in zip(maps, moved, strict=True)]


def _joined_output(maps: Sequence[PolyMap], i: int, powers: Floats) -> tuple[Ints, Floats]:
    """Exponents and coefficients of one output with the parameter as its last coordinate."""
    names = maps[0].coordinates
    constant = (0,) * len(names)
    terms = [dict(zip(map(tuple, each.exponents[i].tolist()), each.coefficients[i], strict=True)) for each in maps]
    if names.angles[i]:
        middles = np.array([each(each.centre[None])[0, i] for each in maps])
        for own, shift in zip(terms, np.unwrap(middles) - middles, strict=True):
            own[constant] = own.get(constant, 0.0) + shift
    keys = list(dict.fromkeys(key for own in terms for key in own))
    table = np.array([[own.get(key, 0.0) for key in keys] for own in terms])
    fitted = np.linalg.lstsq(powers, table, rcond=None)[0]
    exponents = [[*key, power] for power in range(len(fitted)) for key in keys]
    return np.array(exponents, int), np.asarray(fitted.ravel(), float)


def _at(polymap: PolyMap, coordinates: Coordinates, value: float) -> PolyMap:
    """The map of the coordinates alone, at one value of the parameter that is its last."""
    n = len(coordinates)
    exponents: list[Ints] = []
    coefficients: list[Floats] = []
    for each, c in zip(polymap.exponents[:n], polymap.coefficients[:n], strict=True):
        scaled = np.array([(value - polymap.centre[n]) / polymap.scale[n]])
        weighted = c * chebvander(scaled, int(each[:, n].max()))[0, each[:, n]]
        keys, which = np.unique(each[:, :n], axis=0, return_inverse=True)
        exponents.append(keys)
        coefficients.append(np.asarray(np.bincount(which.ravel(), weights=weighted), float))
    centre, scale, domain = polymap.centre[:n], polymap.scale[:n], polymap.domain[:n]
    return PolyMap(coordinates, tuple(exponents), tuple(coefficients), centre, scale, domain, polymap.absolute)
