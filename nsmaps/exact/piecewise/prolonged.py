"""The pieces of a map given by formulas beyond their borders, and the functions that are zero at these."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats
from nsmaps.coordinates import TWO_PI, Coordinates, as_states
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ExactMap
from nsmaps.exact.returns import Returns

if TYPE_CHECKING:
    import sympy as sp
    from sympy.core.relational import Relational

    from nsmaps.exact.piecewise.formulas import PieceFormulas

Rows = tuple[Floats, Floats, Floats]  #: values (N, B), derivatives by states (N, B, n) and along parameters (N, B)


@dataclass(frozen=True, eq=False)
class Pieces:
    """The images of each piece at any state, and the functions at whose zeros another piece may begin.

    The first functions are the differences of the two sides of relations in the conditions, each once; the last are the angles,
    from -pi to pi, as formulas have these in [0, 2 pi).
    """

    coordinates: Coordinates
    formulas: "PieceFormulas"
    values: Floats  #: of the parameters

    @property
    def names(self) -> tuple[str, ...]:
        """The borders as equations of coordinates and parameters."""
        from sympy import Symbol

        of = self.formulas
        plain = {x: Symbol(name) for x, name in zip(of.variables, self.coordinates, strict=True)}
        plain |= {symbol: Symbol(str(symbol).removeprefix("_p_")) for symbol in of.symbols}
        cuts = [name for name, angle in zip(self.coordinates, self.coordinates.angles, strict=True) if angle]
        sides = [(relation.lhs.subs(plain), relation.rhs.subs(plain)) for relation in _relations(of)]
        return tuple(f"{one} = {other}" for one, other in [*sides, *((name, 0) for name in cuts)])

    @property
    def affine(self) -> bool:
        """True if all images, and all functions whose zeros are borders, are affine in the coordinates."""
        return not self.coordinates.angles.any() and _is_affine(self.formulas)

    def borders(self, states: Floats, rates: Floats | None = None) -> Rows:
        """The functions at states, shape (N, n), whose angles are on any turn."""
        known = self._rows(_differences(self.formulas), states, rates)
        circle = np.flatnonzero(self.coordinates.angles)
        cuts = np.remainder(states[:, circle] + np.pi, TWO_PI) - np.pi
        by_states = np.broadcast_to(np.eye(len(self.coordinates))[circle], (len(states), len(circle), len(self.coordinates)))
        more = cuts, by_states, np.zeros_like(cuts)
        return tuple(np.concatenate(pair, axis=1) for pair in zip(known, more, strict=True))  # type: ignore[return-value]

    def images(self, piece: int, states: Floats, rates: Floats | None = None) -> Rows:
        """The images of states (N, n) by the formulas of a piece, on any turn; the derivatives as those of `borders`."""
        return self._rows(self.formulas.images[piece], states, rates)

    def _rows(self, rows: "Sequence[sp.Expr]", states: Floats, rates: Floats | None) -> Rows:
        of, count, n = self.formulas, len(rows), len(self.coordinates)
        symbols = of.variables if rates is None else (*of.variables, *of.symbols)
        run, out = _function(tuple(rows), symbols, of), np.empty((len(states), count * (1 + len(symbols))))
        for state, row in zip(states, out, strict=True):
            run(state, self.values, row)
        values, slopes = out[:, :count], out[:, count:].reshape(len(states), count, len(symbols))
        along = np.zeros_like(values) if rates is None else slopes[..., n:] @ rates
        return values, slopes[..., :n], along


@lru_cache(maxsize=64)
def _relations(formulas: "PieceFormulas") -> "tuple[Relational, ...]":
    """The relations in the conditions, those between the same two sides once."""
    from sympy import expand
    from sympy.core.relational import Relational

    found = dict[Any, Relational]()
    for condition in formulas.conditions:
        for relation in sorted(condition.atoms(Relational), key=str):
            difference = expand(relation.lhs - relation.rhs)
            if -difference not in found:
                found.setdefault(difference, relation)
    return tuple(found.values())


@lru_cache(maxsize=64)
def _differences(formulas: "PieceFormulas") -> "tuple[sp.Expr, ...]":
    return tuple(relation.lhs - relation.rhs for relation in _relations(formulas))


@lru_cache(maxsize=64)
def _is_affine(formulas: "PieceFormulas") -> bool:
    from sympy import diff

    rows = [*_differences(formulas), *(image for images in formulas.images for image in images)]
    return not any(diff(row, x).has(*formulas.variables) for row in rows for x in formulas.variables)


@lru_cache(maxsize=256)
def _function(rows: "tuple[sp.Expr, ...]", symbols: "tuple[sp.Symbol, ...]", of: "PieceFormulas") -> Callable[..., None]:
    """A function that writes rows, and then their derivatives by some symbols, of a state: NaN where one has no value."""
    from sympy import diff

    from nsmaps.exact.flows.laws import rows_source

    formulas = [*rows, *(diff(row, symbol) for row in rows for symbol in symbols)]
    names: dict[str, Any] = {"math": math}
    exec(rows_source(formulas, range(len(formulas)), of.variables, of.symbols), names)

    def run(state: Floats, values: Floats, out: Floats) -> None:
        out[:] = np.nan
        try:
            names["law"](0.0, state.tolist(), values.tolist(), out)
        except (ValueError, ZeroDivisionError, OverflowError):
            out[:] = np.nan

    return run


@dataclass(frozen=True, eq=False)
class Prolonged(ExactMap):
    """A map on the states of cycles (q, n) one after the other, the state k by the formulas of a given piece.

    The states whose piece is `free` may lie beyond its border; another one beyond that of its piece has no image.
    """

    map: ExactMap
    of: Pieces
    pieces: tuple[int, ...]  #: of the q states
    lowest: Floats  #: shape (q, n), from which the turn of an angle begins
    free: tuple[int, ...] = ()  #: numbers of states
    coordinates: Coordinates = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "coordinates", self.of.coordinates)

    @property
    def parameters(self) -> Mapping[str, float]:
        """Those of the map."""
        return self.map.parameters

    def parameter_names(self) -> Sequence[str]:
        """Those of the map."""
        return self.map.parameter_names()

    def phase_rate(self) -> float:
        """Zero, as there is no forcing."""
        return 0.0

    def rests(self, states: ArrayLike) -> Floats:
        """NaN, as nothing rests, shape (N,)."""
        return np.full(len(np.asarray(states)), np.nan)

    def on_own_turns(self, states: Floats) -> Floats:
        """States with their angles on the turns that belong to the pieces."""
        low = np.tile(self.lowest, (len(states) // len(self.pieces), 1))
        return np.where(self.coordinates.angles, low + np.remainder(states - low, TWO_PI), states)

    def borders(self, states: Floats, rates: Mapping[str, float] | None = None) -> Rows:
        """The functions of `Pieces.borders` at states (M q, n)."""
        return self.of.borders(self.on_own_turns(states), None if rates is None else self._along(rates))

    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """The images of M cycles, shape (M q, n)."""
        start = as_states(states, self.coordinates)
        image, slopes, _ = self._rows(start, None)
        words = [self.of.formulas.letters[self.pieces[k % len(self.pieces)]] for k in range(len(start))]
        image = np.where(self._belongs(start)[:, None], image, np.nan)
        found = Returns.of_map(self.coordinates, start, image, slopes, words, self.of.formulas.letters)
        outcome = np.where(found.outcome == Outcome.escaped, Outcome.uncovered, found.outcome)
        return replace(found, outcome=outcome.astype(np.int8))

    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float]) -> Floats:
        """The derivatives of the images of M cycles by the parameters, shape (M q, n)."""
        _, _, along = self._rows(as_states(states, self.coordinates), self._along(rates))
        return along

    def _along(self, rates: Mapping[str, float]) -> Floats:
        return np.array([float(rates.get(name, 0.0)) for name in self.parameter_names()])

    def _belongs(self, states: Floats) -> Bools:
        """True for the states that are free, or in their piece."""
        q = len(self.pieces)
        found = self.map.first_return(states)
        own = np.array([self.of.formulas.letters[piece] for piece in self.pieces], str)
        return np.asarray((found.words == np.tile(own, len(states) // q)) | np.isin(np.arange(len(states)) % q, self.free))

    def _rows(self, states: Floats, rates: Floats | None) -> Rows:
        placed, q = self.on_own_turns(states), len(self.pieces)
        if not len(states):
            return self.of.images(0, placed, rates)
        each = [self.of.images(self.pieces[k % q], row[None], rates) for k, row in enumerate(placed)]
        return tuple(np.concatenate(rows) for rows in zip(*each, strict=True))  # type: ignore[return-value]
