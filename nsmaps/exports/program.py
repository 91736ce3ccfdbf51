"""The exported program without a language: polynomials in scaled coordinates, and how they make up a map."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from itertools import chain, count
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates, is_angle
from nsmaps.errors import NsmapsError
from nsmaps.exports.headers import curve_titles, order_of
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.composite.parametric import ParametricMap
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.symbolic.curve_iterates import HeldIterate
from nsmaps.symbolic.map_iterates import ClosedMap

if TYPE_CHECKING:
    from nsmaps.symbolic.formula import Domain

Exportable = PolyMap | CompositeMap | ParametricMap | HeldIterate | ClosedMap


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One polynomial map: sums of Chebyshev products of the scaled inputs."""

    name: str  #: an identifier
    title: str
    polymap: PolyMap
    outputs: int  #: of its outputs the first so many; a parameter behind them is left as it is
    region: Region | None = None

    @property
    def tensor(self) -> Floats:
        """The coefficients, shape (outputs, degree + 1 of each input)."""
        exponents = self.polymap.exponents[: self.outputs]
        shape = np.max([each.max(axis=0, initial=0) for each in exponents], axis=0) + 1
        tensor = np.zeros((self.outputs, *shape))
        for i, each in enumerate(exponents):
            np.add.at(tensor[i], tuple(each.T), self.polymap.coefficients[i])
        return tensor

    @property
    def absolute(self) -> tuple[bool, ...]:
        """Of which outputs the absolute value is taken."""
        return tuple(name in self.polymap.absolute for name in self.polymap.coordinates[: self.outputs])

    @property
    def middles(self) -> tuple[float | None, ...]:
        """The middle that an angle among the inputs is brought next to, None where it is taken as it is."""
        return tuple(middle if isfinite(middle) else None for middle in self.polymap.middle.tolist())

    @property
    def about(self) -> list[str]:
        """Where it was fitted, and how well."""
        polymap = self.polymap
        ends = zip(polymap.coordinates, polymap.domain.tolist(), strict=True)
        box = ", ".join(f"{name} in [{low:.6g}, {high:.6g}]" for name, (low, high) in ends if np.isfinite([low, high]).all())
        if polymap.report is not None or np.isfinite(polymap.domain).all():
            lines = [f"{self.title}: fitted on {box}"]
        else:
            lines = [f"{self.title}: given by a formula"]
        if polymap.report is not None:
            for row in polymap.report.rows():
                numbers = f"largest error {row['max_error']:.3g}, R^2 {row['r2']:.9g}, {row['points']} points"
                lines.append(f"  {row['output']}': {numbers}, {row['terms']} terms")
        return lines


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """A map to be written in a language."""

    name: str  #: an identifier
    title: str
    kind: str  #: `map` (one part), `pieces` (the first whose region holds the state) or `chain` (parts one after the other)
    inputs: Coordinates  #: coordinates, and behind them parameters
    outputs: Coordinates
    parts: tuple[Part, ...]
    limits: tuple[tuple[int, float, float], ...] = ()  #: inputs with their admissible intervals
    notes: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()  #: the study, piece and domain of the map

    @property
    def variables(self) -> dict[str, str]:
        """An identifier for each input, by name."""
        return dict(zip(self.inputs, identifiers(self.inputs), strict=True))

    @property
    def about(self) -> list[str]:
        """The lines of the comment on top."""
        units = [f"{name} ({'radians' if is_angle(name) else 'in the units of the system'})" for name in self.inputs]
        lines = [self.title, *self.provenance, f"Written by nsmaps {own_version()}.", ""]
        return [*lines, f"State: {', '.join(units)}.", *self.notes, "", *(line for part in self.parts for line in part.about)]


def program_of(result: Exportable, name: str, about: Sequence[str] = ()) -> Program:
    """The program of a map or closed form, with lines about where it is from.

    NsmapsError for coefficients that are not numbers, or for a map without pieces.
    """
    return replace(_program(result, name), provenance=(*about, *order_of(result)))


def _program(result: Exportable, name: str) -> Program:
    if isinstance(result, ClosedMap):
        _check_numbers(result.symbols, result.domain)
        sides = [result.domain.get(each, (-1.0, 1.0)) for each in (*result.coordinates, *result.symbols)]
        return _single(name, f"A closed form of degree {result.degree}", result.over(sides), len(result.coordinates))
    if isinstance(result, PolyMap):
        return _single(name, "A polynomial map", result, len(result.coordinates))
    if isinstance(result, CompositeMap):
        return _pieces(name, "A composite map: the first piece that holds a state decides", result, result.coordinates)
    if isinstance(result, ParametricMap):
        title = f"A composite map for every {result.parameter} from {result.low!r} to {result.high!r}"
        names = Coordinates((*result.coordinates, result.parameter))
        return _pieces(name, title, result, names, ((len(names) - 1, result.low, result.high),))
    return _chain(result, name)


def _check_numbers(symbols: Sequence[str], domain: "Domain") -> None:
    if general := [each for each in symbols if each not in domain]:
        raise NsmapsError(f"the coefficients have symbols: {', '.join(general)}; expected: numbers, as by at({general[0]}=0.3)")


def _single(name: str, title: str, polymap: PolyMap, outputs: int) -> Program:
    names = polymap.coordinates
    part = Part("polynomials", "Polynomials", polymap, outputs)
    notes = ("Image: the same coordinates; angles are not wrapped.",)
    return Program(name, title, "map", names, names[:outputs], (part,), notes=notes)


def _pieces(
    name: str,
    title: str,
    result: CompositeMap | ParametricMap,
    inputs: Coordinates,
    limits: tuple[tuple[int, float, float], ...] = (),
) -> Program:
    if not result.pieces:
        raise NsmapsError("the map has no piece; expected: one or more")
    outputs = result.coordinates
    parts = zip(identifiers([f"piece {piece.name}" for piece in result.pieces]), result.pieces, strict=True)
    notes = (
        "Image: the same coordinates, angles in [0, 2 pi); NaN for a state in no piece, or NaN or infinite itself.",
        "Regions see angles in [0, 2 pi).",
        *(f"The image of piece {_title(each)} is that after all of them." for each in result.pieces if each.returns > 1),
    )
    branches = tuple(Part(each, _title(piece), piece.map, len(outputs), piece.region) for each, piece in parts)
    return Program(name, title, "pieces", inputs, outputs, branches, limits, notes)


def _title(piece: Piece) -> str:
    return piece.title.replace("*/", "* /")  # it stands in comments


def _chain(result: HeldIterate, name: str) -> Program:
    """Curves one after the other, each in Chebyshev products of where the map was fitted: stabler than their expanded product."""
    variable = str(result.variable)
    parameters = sorted({str(s) for curve in result.curves for s in curve.free_symbols} - {variable})
    _check_numbers(parameters, result.domain)
    names = Coordinates((variable, *parameters))
    title = f"The iterate {len(result.curves)} of {variable} in closed form: its curves one after the other"
    pairs = zip(curve_titles(result), result.curves, strict=True)
    parts = [Part(f"curve_{k}", each, curve_map(c, names, result.domain), 1) for k, (each, c) in enumerate(pairs, 1)]
    return Program(name, title, "chain", names, names[:1], tuple(parts), notes=(f"Image: {variable}.",))


def curve_map(curve: Any, names: Sequence[str], domain: "Domain") -> PolyMap:
    """A sympy polynomial in named variables as a PolyMap, which leaves all but the first as they are."""
    variable, *parameters = names
    closed = ClosedMap(Coordinates((variable,)), tuple(parameters), {variable: curve}, (), 0, domain)
    return closed.over([domain.get(name, (-1.0, 1.0)) for name in names])


def identifiers(names: Iterable[str]) -> list[str]:
    """Names as identifiers of every language, no two the same but for case and none a word of a language.

    R1+ is R1_plus, R1' is R1_prime.
    """
    taken: list[str] = []
    for name in names:
        spelt = "".join(f" {SPELT[c]} " if c in SPELT else c for c in str(name))
        plain = re.sub(r"[^0-9A-Za-z]+", "_", spelt).strip("_") or "x"
        stem = plain if re.match(r"[A-Za-z]", plain) else f"x_{plain}"
        stem = f"{stem}_" if stem.lower() in RESERVED.split() else stem
        numbered = chain([stem], (f"{stem}_{k}" for k in count(2)))
        taken.append(next(each for each in numbered if each.lower() not in map(str.lower, taken)))
    return taken


def own_version() -> str:
    """The version of nsmaps, for the comment on top."""
    try:
        return version("nsmaps")
    except PackageNotFoundError:  # a source tree on the path that is not installed
        return ""


SPELT = {"+": "plus", "*": "star", "'": "prime"}  #: signs by which names of regions differ

#: words of one of the languages, and names that the programs use themselves
RESERVED = """
    abs abstract acos alignas alignof and angles ans any arguments array as asin assert async atan auto await baremodule
    begin bool break case catch char chebvander class const constexpr continue cos cosh debugger def default del delete do
    document double e elif else elseif end endif enum eval except exp export exports extern fabs false finally float
    float64array floats floor for from function global goto holds i if image images implements import in inf infinity inline
    instanceof int interface is isa isfinite j k lambda left let linux local location log long m_pi macro math max min module
    mutable n names nan near new none nonlocal not np null nullptr number numpy ones or otherwise outer outputs package
    parfor parts pass persistent pi piece piece_of pieces polynomials pow primitive print private protected public quote
    raise real_acos real_asin real_cos real_log real_max real_min real_power real_sign real_sin real_sqrt real_tan regions
    register require restrict return rows s series short sign signed sin sinh size sizeof spmd sqrt start state states static
    static_assert struct super switch tan tanh this thread_local throw top true try two_pi type typedef typeof undefined
    union unix unsigned using var void volatile where while window with work wrap x yield zeros
"""

#: functions and macros of C's <math.h>, whose names no other function can have
MATH_H = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cosh drem erf erfc exp2 expm1 fabs fdim finite floor fma fmax fmin
    fmod fpclassify frexp gamma huge_val hypot ilogb isgreater isless isnan isnormal j0 j1 jn ldexp lgamma llrint llround log10
    log1p log2 logb lrint lround modf nearbyint nextafter nexttoward remainder remquo rint round scalb scalbln scalbn signbit
    significand sinh tan tanh tgamma trunc y0 y1 yn
"""
