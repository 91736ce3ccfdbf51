"""The compiled form of a composite map."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike
from nsmaps.exact.impacts import LONGER, Floats, Returns, angle_mask, as_states, encode
from nsmaps.exact.kernel import in_chunks
from nsmaps.reduced.compositekernel import BLOCK, Ints, Tables, Work, images, pieces_of
from nsmaps.reduced.compositeorbits import orbits
from nsmaps.reduced.conditioncode import Code, code_of, depth_of

if TYPE_CHECKING:
    from nsmaps.reduced.composite import CompositeMap
    from nsmaps.reduced.polymap import PolyMap


@dataclass(frozen=True, slots=True, eq=False)
class CompiledComposite:
    """A composite map as arrays, with the loops that run it; a `CompiledOrbit`, whose numbers do not depend on the batch."""

    coordinates: tuple[str, ...]
    walls: tuple[str, ...]
    tables: Tables
    asked: bool  #: whether the regions are asked in Python, for one is of a class of one's own

    @classmethod
    def of(cls, map: "CompositeMap") -> Self:
        """The compiled form of a map."""
        codes = [code_of(piece.region) for piece in map.pieces]
        written = [code for code in codes if code is not None]
        asked = len(written) < len(codes)
        return cls(map.coordinates, map.walls, _tables(map, [[] for _ in codes] if asked else written), asked)

    def pieces_of(self, states: Floats) -> Ints:
        """The number of the first piece that holds each state (N, n), shape (N,): -1 for none, -2 of what is no state."""
        piece = np.empty(len(states), np.int64)
        in_chunks(len(states), lambda k: pieces_of(self.tables, self._work(), states[k], piece[k]))
        return piece

    def first_returns(self, start: Floats, piece: Ints) -> Returns:
        """The first returns of states (N, n) whose pieces are known."""
        n, dim = start.shape
        image, turns, time = np.empty((n, dim)), np.empty((n, dim), np.int32), np.full(n, np.nan)
        codes, outcome = np.empty(n, np.int64), np.empty(n, np.int8)

        def run(k: slice) -> None:
            images(self.tables, self._work(), start[k], piece[k], image[k], turns[k], codes[k], outcome[k])

        in_chunks(n, run)
        return Returns(self.coordinates, self.walls, start, image, turns, codes, outcome, time, fitted=True)

    def orbits(self, states: ArrayLike, n: int) -> Returns:
        """The first n returns of each of M states, shape (M, dim): n M rows, the first return of every state first."""
        start = as_states(states, self.coordinates)
        m, dim = start.shape
        made, turns = np.empty((n + 1, m, dim)), np.empty((n, m, dim), np.int32)
        codes, outcome = np.empty((n, m), np.int64), np.empty((n, m), np.int8)
        made[0] = start
        orbits(self.tables, self._work(), made, turns, codes, outcome)
        rows, none = made.reshape(-1, dim), np.full(n * m, np.nan)
        each = rows[m:], turns.reshape(-1, dim), codes.ravel(), outcome.ravel(), none
        return Returns(self.coordinates, self.walls, rows[:-m], *each, fitted=True)

    def _work(self) -> Work:
        """Room for a block of states."""
        n, degrees = len(self.coordinates), int(self.tables.degree.max(initial=1)) + 1
        stack, basis = np.empty((self.tables.depth, BLOCK)), np.empty((n, degrees, BLOCK))
        x, left, inner, total = np.empty((n, BLOCK)), np.empty(BLOCK, np.int64), np.empty(BLOCK), np.empty((n, BLOCK))
        return Work(x, stack, left, basis, inner, total)


@lru_cache(maxsize=16)
def compiled(map: "CompositeMap") -> CompiledComposite:
    """The compiled form of a map, kept for the maps that were asked last."""
    return CompiledComposite.of(map)


def _tables(map: "CompositeMap", codes: list[Code]) -> Tables:
    maps, names = [piece.map for piece in map.pieces], map.coordinates
    n, angles = len(names), angle_mask(names)
    operations = np.array([each for code in codes for each in code], float).reshape(-1, 2)
    terms = np.array([[len(each) for each in polymap.exponents] for polymap in maps], np.int64).reshape(-1, n)
    ends = terms.cumsum().reshape(terms.shape)
    outputs = [_in_order(*pair) for polymap in maps for pair in zip(polymap.exponents, polymap.coefficients, strict=True)]
    degrees = [np.max([each.max(axis=0) for each in polymap.exponents], axis=0) for polymap in maps]
    begins = (ends - terms).ravel().tolist()
    runs = [first + end for (exponents, _), first in zip(outputs, begins, strict=True) for end in _runs(exponents)]
    words = [_code(piece.word, map.walls) for piece in map.pieces]
    return Tables(
        angle=angles,
        operation=operations[:, 0].astype(np.int64),
        number=np.ascontiguousarray(operations[:, 1]),
        first_operation=np.cumsum([0, *(len(code) for code in codes)]),
        depth=max((depth_of(code) for code in codes), default=0),
        middle=np.array([_middle(polymap, angles) for polymap in maps]).reshape(-1, n),
        centre=np.array([polymap.centre for polymap in maps], float).reshape(-1, n),
        scale=np.array([polymap.scale for polymap in maps], float).reshape(-1, n),
        absolute=np.array([[name in polymap.absolute for name in names] for polymap in maps], bool).reshape(-1, n),
        degree=np.array(degrees, np.int64).reshape(-1, n),
        first_term=np.column_stack([ends - terms, ends[:, -1:]]),
        exponent=np.array([each for exponents, _ in outputs for each in exponents], np.int64).reshape(-1, n),
        coefficient=np.array([each for _, coefficients in outputs for each in coefficients], float),
        until=np.array(runs, np.int64),
        word=np.array(words, np.int64),
    )


def _code(word: str, walls: tuple[str, ...]) -> int:
    """The code of a word, 0 of one that is longer than a code holds."""
    code = 0 if LONGER in word else encode(word, walls)
    return code if code < 2**63 else 0


def _in_order(exponents: Ints, coefficients: Floats) -> tuple[Ints, Floats]:
    """Terms in the order of the first coordinate, then of the next."""
    order = np.lexsort(exponents.T[::-1])
    return exponents[order], coefficients[order]


def _runs(exponents: Ints) -> Ints:
    """Of each term in order, the number of the first that differs from it in more than the last coordinate."""
    changes = np.flatnonzero((np.diff(exponents[:, :-1], axis=0) != 0).any(axis=1)) + 1
    return np.append(changes, len(exponents))[np.searchsorted(changes, np.arange(len(exponents)), side="right")]


def _middle(polymap: "PolyMap", angles: NDArray[np.bool_]) -> Floats:
    """Where the map was fitted, of angles; NaN of other coordinates, and where it was not."""
    return np.where(angles & np.isfinite(polymap.domain).all(axis=1), polymap.centre, np.nan)
