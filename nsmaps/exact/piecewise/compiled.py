"""The compiled form of a map given by formulas, at the values of its parameters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.kernel import Kernel, ReturnRows, in_chunks, return_rows
from nsmaps.exact.piecewise.formulas import Choices, PieceFormulas, formulas_of
from nsmaps.exact.piecewise.program import compiled_program, program
from nsmaps.exact.piecewise.prolonged import Pieces
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import encode


@dataclass(frozen=True, eq=False)
class PieceKernel(Kernel):
    """Formulas with the values of their parameters. No impacts accumulate, and `chatter` has no effect."""

    coordinates: Coordinates
    formulas: PieceFormulas
    values: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "letters", self.formulas.letters)

    @property
    def name(self) -> str:
        """The formulas: equal names mean equal returns."""
        return f"{self.formulas.letters}{self.formulas.conditions}{self.formulas.images}"

    @property
    def pieces(self) -> Pieces:
        """Its pieces at any state."""
        return Pieces(self.coordinates, self.formulas, self.values)

    def compute(self, rows: ReturnRows, chatter: float) -> None:
        """Compute returns from the starts in `rows`, with the derivatives by these if there are rows for them."""
        self._compute(rows, self.formulas.variables if rows.tangents.shape[-1] else ())

    def kicked_orbits(self, start: Floats, kicks: Floats) -> Returns:
        """The first n returns of each of M states, to whose images kicks are added, shape (n, M, dim), on one core."""
        rows = return_rows(start, len(kicks), 0)
        self._compute(rows._replace(tangents=kicks[..., None]), kicked=True)
        return self.returns(rows, False)

    def sensitivities(self, start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of images along a direction of the parameters, shape (N, n)."""
        rows = return_rows(start, 1, len(rates))
        in_chunks(len(start), lambda k: self._compute(rows.part(k), self.formulas.symbols))
        (by_parameters,) = rows.tangents
        return np.asarray(by_parameters @ rates)

    def _compute(self, rows: ReturnRows, by: Sequence[Any] = (), kicked: bool = False) -> None:
        """Write returns, with derivatives by some symbols."""
        _, *fields = rows
        self.loop(by, kicked)(rows.start, rows.images, *fields)

    def loop(self, by: Sequence[Any] = (), kicked: bool = False) -> Callable[..., None]:
        """The compiled loop at the values of the parameters: a function of states and of the memory for the fields of returns."""
        words = np.array([encode(letter, self.letters) for letter in self.letters], np.int64)
        source = _program(self.formulas, tuple(self.coordinates.angles.tolist()), tuple(by), kicked)
        return partial(compiled_program(source), self.values, words)


_program = lru_cache(maxsize=64)(program)


@lru_cache(maxsize=64)
def piece_kernel(choices: Choices, values: tuple[float, ...]) -> PieceKernel:
    """The compiled form of a class of maps at values of its parameters; those that were used last are kept."""
    return PieceKernel(choices.cls.coordinates, formulas_of(choices), np.array(values, float))
