"""A map given by formulas as the search for horseshoes sees it."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.proof.chaos.sets import View
from nsmaps.verify.maps.formula import map_of
from nsmaps.verify.maps.horseshoe import Block, covers, meeting

if TYPE_CHECKING:
    from nsmaps.dynamics.periodic import PeriodicOrbit


class MapView(View):
    """A map by its formulas; a word has one letter a return, that of the piece."""

    def __init__(self, return_map: PiecewiseMap, formulas: Mapping[str, Any]) -> None:
        self.map, self.formulas = return_map, map_of(formulas)
        self.angles = np.asarray(return_map.coordinates.angles)

    def states(self, orbit: "PeriodicOrbit") -> Floats:
        return orbit.states

    def derivatives(self, orbit: "PeriodicOrbit") -> Floats:
        return np.asarray(orbit.returns.derivative)

    def words(self, orbit: "PeriodicOrbit", returns: int) -> list[str]:
        size = len(orbit.words)
        return ["".join(orbit.words[(k + i) % size] for i in range(returns)) for k in range(size)]

    def iterated(self, states: Floats, returns: int) -> tuple[Floats, Any]:
        count = len(states)
        orbits = self.map.orbits(states, returns)
        words = orbits.words.reshape(returns, count).astype(object)
        return orbits.image.reshape(returns, count, -1)[-1], words.sum(axis=0)

    def stated(self, centres: Floats, matrices: Floats, words: Any) -> list[Any]:
        letters = self.formulas.letters
        return [
            Block(tuple(c), tuple(map(tuple, m)), tuple(letters.index(letter) for letter in word))
            for c, m, word in zip(centres.tolist(), matrices.tolist(), words, strict=True)
        ]

    def meeting(self, stated: Sequence[Any]) -> Sequence[tuple[int, int]]:
        return list(meeting(self.formulas, stated))

    def covers(self, source: Any, targets: Sequence[Any]) -> None:
        for target in targets:
            covers(self.formulas, source, target)

    def written(self, kept: Sequence[Any], relations: list[list[int]], returns: int) -> dict[str, Any]:
        sets = [{"centre": [*each.centre], "matrix": [[*row] for row in each.matrix], "pieces": [*each.pieces]} for each in kept]
        return {"returns": returns, "sets": sets, "relations": relations}
