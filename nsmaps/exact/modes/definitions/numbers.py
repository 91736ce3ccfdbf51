"""Rows of formulas in numbers over the features: the states, 1, and cosine and sine of the multiples of the phase."""

from collections.abc import Sequence
from itertools import chain
from typing import TYPE_CHECKING

import sympy as sp
from flint import arb

from nsmaps.arrays import Floats
from nsmaps.exact.flows.balls import Number, Program, Recorded
from nsmaps.exact.flows.exponentials import Decomposition

if TYPE_CHECKING:
    from nsmaps.exact.modes.definitions.rows import Row

BallRow = list[arb]  #: over the features, in many digits


class Numbers:
    """Rows, prepared for values of the parameters, with so many multiples of the phase, or with all that they have."""

    def __init__(
        self, rows: "Sequence[Row]", symbols: Sequence[sp.Symbol], harmonics: int | None = None, blurred: bool = False
    ) -> None:
        self.rows, self.harmonics = list(rows), harmonics
        self.recorded = Recorded(symbols, self._build, blurred)

    def at(self, values: Sequence[float]) -> list[BallRow]:
        """The rows at these values, in many digits."""
        found, width = self.recorded.at(values)
        return [[x.real for x in found[k : k + width]] for k in range(0, len(found), width)]

    def floats(self, values: Sequence[float]) -> Floats:
        """The rows at these values, shape (R, N)."""
        found, width = self.recorded.floats(values)
        return found.reshape(-1, width)

    def _build(self, program: Program) -> tuple[list[Number], int]:
        known = Decomposition(program)
        remainders = {formula: known.sum(formula) for formula in dict.fromkeys(row.remainder for row in self.rows)}
        waves = {formula: {term.harmonic: x for term, x in total.items()} for formula, total in remainders.items()}
        highest = max((abs(m) for wave in waves.values() for m in wave), default=0)
        features = {
            formula: in_features(program, wave, highest if self.harmonics is None else self.harmonics)
            for formula, wave in waves.items()
        }
        first, *others = ([*map(program.number, row.coefficients), *features[row.remainder]] for row in self.rows)
        return [*first, *chain(*others)], len(first)


def in_features(program: Program, waves: dict[int, Number], harmonics: int) -> list[Number]:
    """A function of the phase by its coefficients of exp(i m phi): those of 1, and of cosine and sine of each multiple."""
    none = program.number(0)
    row = [waves.get(0, none)]
    for m in range(1, harmonics + 1):
        plus, minus = waves.get(m, none), waves.get(-m, none)
        row += [plus + minus, (minus - plus).imag()]
    return row
