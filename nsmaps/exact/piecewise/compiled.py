"""The compiled form of a map given by formulas, at the values of its parameters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.piecewise.formulas import Choices, PieceFormulas, formulas_of
from nsmaps.exact.piecewise.program import compiled_program, program
from nsmaps.exact.piecewise.prolonged import Pieces
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import encode


@dataclass(frozen=True, eq=False)
class CompiledPieces:
    """Formulas with the values of their parameters."""

    coordinates: Coordinates
    formulas: PieceFormulas
    values: Floats

    @property
    def pieces(self) -> Pieces:
        """Its pieces at any state."""
        return Pieces(self.coordinates, self.formulas, self.values)

    def first_returns(self, start: Floats, derivative: bool) -> Returns:
        """The first returns of states (N, n), on all cores."""
        return self._returns(start, self._computed(start, self.formulas.variables if derivative else ()), derivative)

    def orbits(self, start: Floats, n: int, derivative: bool) -> Returns:
        """The first n returns of each of M states, shape (M, dim), on one core."""
        by = self.formulas.variables if derivative else ()
        return self._orbits(start, self._room(n, len(start), by), by)

    def kicked_orbits(self, start: Floats, kicks: Floats) -> Returns:
        """The first n returns of each of M states, to whose images kicks are added, shape (n, M, dim), on one core."""
        return self._orbits(start, [*self._room(len(kicks), len(start), ())[:-1], kicks[..., None]], kicked=True)

    def _orbits(self, start: Floats, room: list[Any], by: Sequence[Any] = (), kicked: bool = False) -> Returns:
        states = np.empty((len(room[0]) + 1, *start.shape))
        states[0], room[0] = start, states[1:]
        self.loop(by, kicked)(start, *room)
        return self._returns(states[:-1].reshape(-1, start.shape[1]), room, bool(by))

    def sensitivities(self, start: Floats, rates: Floats) -> Floats:
        """The derivatives of images along a direction of the parameters, shape (N, n)."""
        return np.asarray(self._computed(start, self.formulas.symbols)[-1][0] @ rates)

    def _computed(self, start: Floats, by: Sequence[Any]) -> list[Any]:
        """The fields of the first returns of states, with derivatives by some symbols."""
        room, loop = self._room(1, len(start), by), self.loop(by)
        in_chunks(len(start), lambda k: loop(start[k], *(each[:, k] for each in room)))
        return room

    def loop(self, by: Sequence[Any] = (), kicked: bool = False) -> Callable[..., None]:
        """The compiled loop at the values of the parameters: a function of states and of the memory for the fields of returns."""
        words = np.array([encode(letter, self.formulas.letters) for letter in self.formulas.letters], np.int64)
        source = _program(self.formulas, tuple(self.coordinates.angles.tolist()), tuple(by), kicked)
        return partial(compiled_program(source), self.values, words)

    def _room(self, n: int, m: int, by: Sequence[Any]) -> list[Any]:
        """Memory for the fields of n returns of each of M states."""
        d = len(self.coordinates)
        kinds = (np.float64, (d,)), (np.int64, ()), (np.int8, ()), (np.float64, ()), (np.float64, (d, len(by)))
        image, *others = [np.empty((n, m, *shape), kind) for kind, shape in kinds]
        return [image, np.zeros((n, m, d), np.int32), *others]

    def _returns(self, start: Floats, room: list[Any], derivative: bool) -> Returns:
        image, turns, codes, outcome, time, slopes = (each.reshape(len(start), *each.shape[2:]) for each in room)
        of_slopes = slopes if derivative else None
        return Returns(self.coordinates, self.formulas.letters, start, image, turns, codes, outcome, time, of_slopes)


_program = lru_cache(maxsize=64)(program)


@lru_cache(maxsize=64)
def compiled(choices: Choices, values: tuple[float, ...]) -> CompiledPieces:
    """The compiled form of a class of maps at values of its parameters; those that were used last are kept."""
    return CompiledPieces(choices.cls.coordinates, formulas_of(choices), np.array(values, float))
