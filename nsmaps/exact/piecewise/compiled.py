"""The compiled form of a map given by formulas, at the values of its parameters."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.flows.laws import rows_address
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.piecewise.formulas import PieceFormulas, formulas_of
from nsmaps.exact.piecewise.kernel import orbits, rows_of
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import encode

if TYPE_CHECKING:
    from nsmaps.exact.systems.piecewise import PiecewiseMap


@dataclass(frozen=True, eq=False)
class CompiledPieces:
    """Formulas with the values of their parameters, and the functions that evaluate them, compiled when they are needed."""

    coordinates: Coordinates
    formulas: PieceFormulas
    values: Floats

    @cached_property
    def images(self) -> int:
        """The address of the function of the images."""
        return rows_address(self.formulas.source())

    @cached_property
    def slopes(self) -> int:
        """The address of that with derivatives by the states."""
        return rows_address(self.formulas.source(self.formulas.variables))

    @cached_property
    def rates(self) -> int:
        """The address of that with derivatives by the parameters."""
        return rows_address(self.formulas.source(self.formulas.symbols))

    @cached_property
    def words(self) -> Any:
        """The code of each piece's letter."""
        return np.array([encode(letter, self.formulas.letters) for letter in self.formulas.letters], np.int64)

    def first_returns(self, start: Floats, derivative: bool) -> Returns:
        """The first returns of states (N, n), on all cores."""
        room = self._room(1, len(start), derivative)
        in_chunks(len(start), lambda k: self._run(start[k], [each[:, k] for each in room], derivative))
        return self._returns(start, room, derivative)

    def orbits(self, start: Floats, n: int, derivative: bool) -> Returns:
        """The first n returns of each of M states, shape (M, dim)."""
        room = self._room(n, len(start), derivative)
        self._run(start, room, derivative)
        return self._returns(np.concatenate([start[None], room[0]])[:-1].reshape(-1, start.shape[1]), room, derivative)

    def sensitivities(self, start: Floats, rates: Floats) -> Floats:
        """The derivatives of images along a direction of the parameters, shape (N, n)."""
        n, rows = start.shape[1], np.empty((len(start), 1 + start.shape[1] * (1 + len(rates))))
        rows_of(self.rates, self.values, self.coordinates.angles, self._memory(len(rates)), start, rows)
        return np.asarray(rows[:, 1 + n :].reshape(len(start), n, len(rates)) @ rates)

    def _run(self, start: Floats, room: list[Any], derivative: bool) -> None:
        address, memory = self.slopes if derivative else self.images, self._memory(start.shape[1])
        orbits(address, self.values, self.coordinates.angles, self.words, memory, start, *room)

    def _memory(self, by: int) -> tuple[Floats, Floats, Floats]:
        n = len(self.coordinates)
        return np.empty(n), np.empty(n), np.empty(1 + n * (1 + by))

    def _room(self, n: int, m: int, derivative: bool) -> list[Any]:
        """Memory for the fields of n returns of each of M states."""
        d = len(self.coordinates)
        kinds = (np.float64, (d,)), (np.int32, (d,)), (np.int64, ()), (np.int8, ()), (np.float64, ())
        slopes = np.empty((n if derivative else 0, m, d, d))
        return [*(np.empty((n, m, *shape), kind) for kind, shape in kinds), slopes]

    def _returns(self, start: Floats, room: list[Any], derivative: bool) -> Returns:
        image, turns, codes, outcome, time, slopes = (each.reshape(-1, *each.shape[2:]) for each in room)
        of_slopes = slopes if derivative else None
        return Returns(self.coordinates, self.formulas.letters, start, image, turns, codes, outcome, time, of_slopes)


@lru_cache(maxsize=64)
def _of(cls: Any, values: tuple[float, ...], others: tuple[tuple[str, Any], ...]) -> CompiledPieces:
    return CompiledPieces(cls.coordinates, formulas_of(cls, others), np.array(values, float))


def compiled(map: "PiecewiseMap") -> CompiledPieces:
    """The compiled form of a map; those that were used last are kept."""
    cls = type(map)
    others = tuple((name, getattr(map, name)) for name in cls.model_fields if name not in cls.parameter_names())
    return _of(cls, tuple(map.parameters.values()), others)
