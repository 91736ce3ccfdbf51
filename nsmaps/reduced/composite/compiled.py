"""The compiled form of a composite map."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats, Ints
from nsmaps.coordinates import Coordinates, WithCoordinates, as_states
from nsmaps.exact.kernel import in_chunks
from nsmaps.exact.returns import Returns
from nsmaps.exact.words import LONGER, encode
from nsmaps.reduced.composite.kernel import BLOCK, COSINE, ITSELF, SINE, CompositeTables, Work, orbits, pieces_of
from nsmaps.reduced.conditions.bytecode import Code, code_of, code_of_term, depth_of

if TYPE_CHECKING:
    from nsmaps.reduced.composite.piece import Pieces
    from nsmaps.reduced.fit.polymap import PolyMap


@dataclass(frozen=True, slots=True, eq=False)
class CompiledComposite(WithCoordinates):
    """A composite map as arrays, with the loops that evaluate it; its numbers do not depend on the batch."""

    coordinates: Coordinates
    walls: tuple[str, ...]
    tables: CompositeTables
    several: NDArray[np.int32] | None  #: shape (pieces + 1,), the number of returns of each, 1 in none; None: one each

    @classmethod
    def of(cls, return_map: "Pieces") -> Self:
        """The compiled form of a map."""
        several = np.array([*(piece.returns for piece in return_map.pieces), 1, 1], np.int32) if return_map.several else None
        return cls(return_map.coordinates, return_map.walls, _tables(return_map), several)

    def pieces_of(self, states: Floats) -> Ints:
        """The number of the first piece that contains each state (N, n), shape (N,): -1 for none, -2 if it is NaN or infinite."""
        piece = np.empty(len(states), np.int64)
        in_chunks(len(states), lambda k: pieces_of(self.tables, self._work(), states[k], piece[k]))
        return piece

    def first_returns(self, start: Floats, piece: Ints) -> Returns:
        """The first returns of states (N, n); the numbers of their pieces are written to `piece`, shape (N,)."""
        room = self._room(1, start)

        def run(k: slice) -> None:
            orbits(self.tables, self._work(), start[k], piece[None, k], *(each[:, k] for each in room))

        in_chunks(len(start), run)
        return self._returns(start, piece, *room)

    def orbits(self, states: ArrayLike, n: int) -> Returns:
        """The first n returns of each of M states, shape (M, dim): n M rows, the first return of every state first."""
        start = as_states(states, self.coordinates)
        room, piece = self._room(n, start), np.empty((n, len(start)), np.int64)
        orbits(self.tables, self._work(), start, piece, *room)
        return self._returns(np.concatenate([start[None], room[0]])[:-1].reshape(-1, start.shape[1]), piece, *room)

    def _room(self, n: int, start: Floats) -> tuple[Floats, NDArray[np.int32], NDArray[np.int64], NDArray[np.int8]]:
        """Memory for the images, turns, codes and outcomes of n returns of M states."""
        m, dim = start.shape
        return np.empty((n, m, dim)), np.empty((n, m, dim), np.int32), np.empty((n, m), np.int64), np.empty((n, m), np.int8)

    def _returns(
        self, start: Floats, piece: Ints, image: Floats, turns: NDArray[np.int32], codes: Ints, outcome: NDArray[np.int8]
    ) -> Returns:
        """Returns of arrays of shape (n, M, ...)."""
        dim = len(self.coordinates)
        each = image.reshape(-1, dim), turns.reshape(-1, dim), codes.ravel(), outcome.ravel(), np.full(len(start), np.nan)
        number = None if self.several is None else self.several[piece.ravel()]
        return Returns(self.coordinates, self.walls, start, *each, fitted=True, number=number)

    def _work(self) -> Work:
        """Memory for a block of states."""
        n, tables = len(self.coordinates), self.tables
        basis = np.empty((tables.degree.shape[1], int(tables.degree.max(initial=1)) + 1, BLOCK))
        return Work(
            x=np.empty((n, BLOCK)),
            left=np.empty(BLOCK, np.int64),
            stack=np.empty((tables.depth, BLOCK)),
            held=np.empty(BLOCK, np.int64),
            near=np.empty((n, BLOCK)),
            turn=np.empty((n, BLOCK)),
            basis=basis,
            group=np.empty(BLOCK),
            total=np.empty((n, BLOCK)),
        )


@lru_cache(maxsize=16)
def compiled(return_map: "Pieces") -> CompiledComposite:
    """The compiled form of a map, cached for the maps that were used last."""
    return CompiledComposite.of(return_map)


def _tables(return_map: "Pieces") -> CompositeTables:
    tests = [code_of(piece.region) for piece in return_map.pieces]
    maps, names = [piece.map for piece in return_map.pieces], return_map.coordinates
    columns, kinds, formulas = _variables(maps, names)
    codes = [*tests, *(code for of in formulas for code in of)]
    first = np.cumsum([0, *(len(code) for code in codes)])
    operations = np.array([each for code in codes for each in code], float).reshape(-1, 2)
    n, width = len(names), columns.shape[1]
    terms = np.array([[len(each) for each in polymap.exponents] for polymap in maps], np.int64).reshape(-1, n)
    ends = terms.cumsum().reshape(terms.shape)
    outputs = [_in_order(*pair) for polymap in maps for pair in zip(polymap.exponents, polymap.coefficients, strict=True)]
    degrees = [np.max([each.max(axis=0) for each in polymap.exponents], axis=0) for polymap in maps]
    begins = (ends - terms).ravel().tolist()
    runs = [begin + end for (exponents, _), begin in zip(outputs, begins, strict=True) for end in _runs(exponents)]
    words = [_code(piece.word, return_map.walls) for piece in return_map.pieces]
    return CompositeTables(
        angle=names.angles,
        operation=operations[:, 0].astype(np.int64),
        number=np.ascontiguousarray(operations[:, 1]),
        first_operation=first[: len(maps) + 1],
        depth=max((depth_of(code) for code in codes), default=0),
        middle=np.array([polymap.middle for polymap in maps]).reshape(-1, n),
        variables=np.array([len(polymap.centre) for polymap in maps], np.int64),
        column=columns,
        kind=kinds,
        first_formula=first[len(maps) :][np.arange(width + 1) + width * np.arange(len(maps))[:, None]],
        centre=_padded([polymap.centre for polymap in maps], width, float),
        scale=_padded([polymap.scale for polymap in maps], width, float),
        absolute=np.array([[name in polymap.absolute for name in names] for polymap in maps], bool).reshape(-1, n),
        degree=_padded(degrees, width, np.int64),
        first_term=np.column_stack([ends - terms, ends[:, -1:]]),
        exponent=_padded([each for exponents, _ in outputs for each in exponents], width, np.int64),
        coefficient=np.array([each for _, coefficients in outputs for each in coefficients], float),
        until=np.array(runs, np.int64),
        word=np.array(words, np.int64),
    )


def _variables(maps: Sequence["PolyMap"], names: Coordinates) -> tuple[Ints, Ints, list[list[Code]]]:
    """The coordinate of each variable of each map and its kind, (P, K) each; the code of those that are formulas."""
    width = max((len(polymap.centre) for polymap in maps), default=len(names))
    columns, kinds = np.full((len(maps), width), -1), np.zeros((len(maps), width), np.int64)
    codes: list[list[Code]] = []
    for k, polymap in enumerate(maps):
        known = {str(name): (i, ITSELF) for i, name in enumerate(names)}
        for i in np.flatnonzero(np.isfinite(polymap.middle)).tolist():
            known |= {f"sin({names[i]})": (i, SINE), f"cos({names[i]})": (i, COSINE)}
        texts = polymap.variables or names.names
        for j, text in enumerate(texts):
            columns[k, j], kinds[k, j] = known.get(text, (-1, ITSELF))
        codes.append([code_of_term(text, names) if text not in known else [] for text in texts] + [[]] * (width - len(texts)))
    return columns, kinds, codes


def _padded(rows: Sequence[Sequence[float] | Floats | Ints], length: int, kind: type) -> NDArray[Any]:
    """Rows with ones behind them up to a length, shape (rows, length)."""
    table: NDArray[Any] = np.ones((len(rows), length), kind)
    for row, values in zip(table, rows, strict=True):
        row[: len(values)] = values
    return table


def _code(word: str, walls: tuple[str, ...]) -> int:
    """The code of a word, 0 if it is longer than a code holds."""
    code = 0 if LONGER in word else encode(word, walls)
    return code if code < 2**63 else 0


def _in_order(exponents: Ints, coefficients: Floats) -> tuple[Ints, Floats]:
    """Terms in the order of the first coordinate, then of the next."""
    order = np.lexsort(exponents.T[::-1])
    return exponents[order], coefficients[order]


def _runs(exponents: Ints) -> Ints:
    """For each term in order, the number of the first that differs from it in more than the last coordinate."""
    changes = np.flatnonzero((np.diff(exponents[:, :-1], axis=0) != 0).any(axis=1)) + 1
    return np.append(changes, len(exponents))[np.searchsorted(changes, np.arange(len(exponents)), side="right")]
