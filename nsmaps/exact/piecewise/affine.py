"""The images of affine pieces as matrices, and the cycles of a word by linear equations."""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product

import numpy as np
import sympy as sp
from sympy.core.relational import Relational
from sympy.solvers.solveset import NonlinearError

from nsmaps.arrays import Floats, Ints
from nsmaps.errors import NsmapsError
from nsmaps.exact.piecewise.formulas import Choices, PieceFormulas, formulas_of
from nsmaps.exact.systems.parameters import System

REGULAR = 1e-12  #: least singular value of the equations of a cycle, as a share of the largest, that determine it


def affine_pieces(system: System) -> tuple[Floats, Floats]:
    """The matrices A, shape (P, n, n), and the vectors b, shape (P, n), of the images A x + b of the P pieces.

    Raises:
        NsmapsError: the image of a piece is not affine, or a coordinate is an angle.
    """
    n = len(system.coordinates)
    rows = _rows(system, [image for images in _formulas(system).images for image in images], "an image")
    found = np.array(rows, float).reshape(-1, n, n + 1)
    return found[..., :n], found[..., n]


def lines(system: System) -> list[tuple[Fraction, Fraction]]:
    """The slope and the shift of each piece of a map of one coordinate, as rational numbers; errors as `affine_pieces`."""
    return [(slope, shift) for slope, shift in _rows(system, [image for (image,) in _formulas(system).images], "an image")]


def borders(system: System) -> list[Fraction]:
    """The places at which a relation in the conditions of a map of one coordinate changes; errors as `affine_pieces`."""
    relations = {relation for condition in _formulas(system).conditions for relation in condition.atoms(Relational)}
    rows = _rows(system, [relation.lhs - relation.rhs for relation in relations], "a condition")
    return sorted({-shift / slope for slope, shift in rows if slope})


def _formulas(system: System) -> PieceFormulas:
    return formulas_of(Choices.of(system))


def _rows(system: System, expressions: Sequence[sp.Expr], what: str) -> list[list[Fraction]]:
    """The coefficients of the coordinates, and the constant, of expressions that are affine; numbers are those of the floats."""
    formulas, name = _formulas(system), type(system).__name__
    if system.coordinates.angles.any():
        raise NsmapsError(f"linear equations of {name}, which has an angle; expected: coordinates without a period")
    values = {symbol: sp.Rational(value) for symbol, value in zip(formulas.symbols, system.parameters.values(), strict=True)}
    found = []
    for expression in expressions:
        exact = sp.nsimplify(expression, rational=True).subs(values)
        try:
            matrix, (right,) = sp.linear_eq_to_matrix([exact], list(formulas.variables))
            found.append([Fraction(int(each.p), int(each.q)) for each in (*matrix, -right)])
        except (NonlinearError, AttributeError) as error:
            plain = expression.subs(dict(zip(formulas.variables, map(sp.Symbol, system.coordinates), strict=True)))
            raise NsmapsError(f"{what} of {name} is {plain}; expected: affine, with rational coefficients") from error
    return found


def words(letters: int, length: int) -> Ints:
    """All words of a length that do not repeat a shorter one, shape (W, length): of the rotations of each the first in order."""
    found = [word for word in product(range(letters), repeat=length) if all(word < word[k:] + word[:k] for k in range(1, length))]
    return np.array(found, int).reshape(-1, length)


def _units(matrices: Floats, vectors: Floats) -> Floats:
    """The power of 2 by the size of each coordinate that constants of the pieces cause, directly or by the others, shape (n,).

    It is 1 without any. Powers of 2 leave the digits of equations as they are.
    """
    sizes, constants = np.abs(matrices).max(axis=0), np.abs(vectors).max(axis=0)
    unit = constants
    for _ in range(len(constants)):
        unit = np.maximum(constants, ((sizes - np.diag(np.diag(sizes))) * unit).max(axis=1))
    return np.exp2(np.round(np.log2(np.where(unit > 0, unit, 1.0))))


def cycles_of_words(system: System, max_period: int) -> Iterator[tuple[str, Floats]]:
    """The word and the states, shape (q, n), of every cycle up to a period whose states lie in the pieces of its word.

    Words whose equations do not determine a cycle, as 1 is a multiplier, are left out.
    """
    matrices, vectors = affine_pieces(system)
    n, letters, unit = len(system.coordinates), np.array(system.letters), _units(matrices, vectors)
    matrices, vectors = matrices * unit / unit[:, None], vectors / unit
    for length in range(1, max_period + 1):
        for word in words(len(letters), length):
            k, equations = np.arange(length), np.zeros((length, n, length, n))
            equations[np.roll(k, -1), :, k] -= matrices[word]
            equations[k, :, k] += np.eye(n)
            square, right = equations.reshape(length * n, length * n), np.roll(vectors[word], 1, axis=0).ravel()
            sizes = np.linalg.svd(square, compute_uv=False)
            if min(sizes) <= REGULAR * max(sizes):
                continue
            states = np.linalg.solve(square, right).reshape(length, n) * unit
            if np.array_equal(system.first_return(states).words, letters[word]):
                yield "".join(letters[word]), states
