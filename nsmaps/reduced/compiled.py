"""A composite map whose returns run in compiled loops."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nsmaps.exact.impacts import LONGER, Returns, angle_mask, as_states, encode
from nsmaps.reduced.compositekernel import Floats, Tables, Work, orbits
from nsmaps.reduced.conditioncode import code_of

if TYPE_CHECKING:
    from nsmaps.reduced.composite import CompositeMap
    from nsmaps.reduced.polymap import PolyMap


@dataclass(frozen=True, slots=True, eq=False)
class CompiledComposite:
    """A composite map for many returns of few states: a `CompiledOrbit`.

    Its returns are those of `CompositeMap.first_return` but for rounding, which sums terms in another order.
    """

    coordinates: tuple[str, ...]
    walls: tuple[str, ...]
    tables: Tables

    @classmethod
    def of(cls, map: "CompositeMap") -> Self | None:
        """The compiled form of a map; None without pieces, or where only Python can ask a region: one of a class of one's own."""
        codes = [code_of(piece.region) for piece in map.pieces]
        written = [code for code in codes if code is not None]
        if not written or len(written) < len(codes):
            return None
        maps = [piece.map for piece in map.pieces]
        operations = np.array([operation for code in written for operation in code]).reshape(-1, 2)
        exponents = [each for polymap in maps for each in polymap.exponents]
        names, angles = map.coordinates, angle_mask(map.coordinates)
        terms = np.array([len(each) for each in exponents]).reshape(len(maps), len(names))
        ends = terms.cumsum().reshape(terms.shape)
        tables = Tables(
            angle=angles,
            operation=operations[:, 0].astype(np.int64),
            number=np.ascontiguousarray(operations[:, 1]),
            first_operation=np.cumsum([0, *(len(code) for code in written)]),
            middle=np.array([_middle(polymap, angles) for polymap in maps]),
            centre=np.array([polymap.centre for polymap in maps], float),
            scale=np.array([polymap.scale for polymap in maps], float),
            absolute=np.array([[name in polymap.absolute for name in names] for polymap in maps], bool),
            degree=np.array([np.max([each.max(axis=0) for each in polymap.exponents], axis=0) for polymap in maps]),
            first_term=np.column_stack([ends - terms, ends[:, -1:]]),
            exponent=np.concatenate(exponents).astype(np.int64),
            coefficient=np.concatenate([each for polymap in maps for each in polymap.coefficients]),
            word=np.array([0 if LONGER in piece.word else encode(piece.word, map.walls) for piece in map.pieces], np.int64),
        )
        return cls(map.coordinates, map.walls, tables)

    def orbits(self, states: ArrayLike, n: int) -> Returns:
        """The first n returns of each of M states, shape (M, dim): n M rows, the first return of every state first."""
        start = as_states(states, self.coordinates)
        m, dim = start.shape
        made, turns = np.empty((n + 1, m, dim)), np.zeros((n, m, dim), np.int32)
        codes, outcome = np.empty((n, m), np.int64), np.empty((n, m), np.int8)
        made[0] = start
        orbits(self.tables, self._work(), made, turns, codes, outcome)
        rows, none = made.reshape(-1, dim), np.full(n * m, np.nan)
        each = rows[m:], turns.reshape(-1, dim), codes.ravel(), outcome.ravel(), none
        return Returns(self.coordinates, self.walls, rows[:-m], *each, fitted=True)

    def _work(self) -> Work:
        n, degree = self.tables.centre.shape[1], int(self.tables.degree.max())
        return Work(np.empty(len(self.tables.operation) + 1), np.empty(n), np.empty(n), np.empty((n, max(degree, 1) + 1)))


def _middle(polymap: "PolyMap", angles: NDArray[np.bool_]) -> Floats:
    """Where the map was fitted, of angles; NaN of other coordinates, and where it was not."""
    return np.where(angles & np.isfinite(polymap.domain).all(axis=1), polymap.centre, np.nan)
