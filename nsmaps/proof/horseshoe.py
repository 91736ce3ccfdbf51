"""The search for a horseshoe: sets of states around the saddles of cycles, large enough to cover each other, in floats."""

from collections.abc import Sequence
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.cells.periodic_points import find_cycles
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.progress import Progress, shows
from nsmaps.proof.chaos.enlarged import found_horseshoe
from nsmaps.proof.chaos.sets import View
from nsmaps.proof.formula import balls_of, equation_of, provable
from nsmaps.proof.maps.formula import stated_map
from nsmaps.proof.maps.horseshoe import MapView
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.horseshoe import Parallelogram, covers, meeting

if TYPE_CHECKING:
    from nsmaps.coordinates import BoxLike
    from nsmaps.dynamics.periodic import PeriodicOrbit
    from nsmaps.exact.systems.system import ImpactSystem
    from nsmaps.verify.formula import System


@shows
def prove_horseshoe(
    system: "ImpactSystem | PiecewiseMap",
    box: "BoxLike",
    max_period: int = 5,
    *,
    n_returns: int = 1,
    depth: int = 3,
    n_cells: int = 16,
    progress: Progress | None = None,
) -> Certificate:
    """A certificate of a horseshoe around the saddles that `find_cycles` finds; see `found_horseshoe`.

    Args:
        system: with flights of a linear equation under a harmonic force, and a constant restitution; or a map by formulas.
        box, max_period, depth, n_cells: of the search for cycles.
        n_returns: after which a set is to cover others; more than one where one stretches by less than about three.
        progress: called now and then with the fraction that is done.

    Raises:
        ProofError: the system is of another kind, or the covering relations that were found do not show chaos.
    """
    provable(system)
    cycles = find_cycles(system, box, max_period=max_period, depth=depth, n_cells=n_cells).cycles
    return certificate_of(system, cycles, n_returns)


def certificate_of(system: "ImpactSystem | PiecewiseMap", orbits: Sequence["PeriodicOrbit"], returns: int = 1) -> Certificate:
    """A certificate of a horseshoe alone; see `found_horseshoe`."""
    about = {"system": repr(system), "program": f"nsmaps {version('nsmaps')}"}
    if isinstance(system, PiecewiseMap):
        formulas = stated_map(system)
        return Certificate(about, formulas, horseshoe=found_horseshoe(MapView(system, formulas), orbits, returns))
    equation = equation_of(system)
    return Certificate(about, equation, horseshoe=found_horseshoe(ImpactView(system, balls_of(equation)), orbits, returns))


class ImpactView(View):
    """An impact system, in phase and speed."""

    angles = np.array([True, False])

    def __init__(self, system: "ImpactSystem", equation: "System") -> None:
        self.system, self.equation = system, equation

    def states(self, orbit: "PeriodicOrbit") -> Floats:
        return orbit.states[:, ::-1]

    def derivatives(self, orbit: "PeriodicOrbit") -> Floats:
        return np.asarray(orbit.returns.derivative)[:, ::-1, ::-1]

    def words(self, orbit: "PeriodicOrbit", returns: int) -> list[str]:
        size, words = len(orbit.words), orbit.words
        return [words[k] + "".join(words[(k + i) % size][1:] for i in range(1, returns)) for k in range(size)]

    def iterated(self, states: Floats, returns: int) -> tuple[Floats, Any]:
        words, lost = np.zeros(len(states), object), np.zeros(len(states), bool)
        for k in range(returns):
            found = self.system.first_return(states[:, ::-1])
            lost |= ~np.isfinite(found.image).all(axis=1)
            words = words + [word[1:] for word in found.words] if k else found.words.astype(object)
            states = np.where(lost[:, None], states, found.image[:, ::-1])
        return np.where(lost[:, None], np.nan, states), words

    def stated(self, centres: Floats, matrices: Floats, words: Any) -> list[Any]:
        letters = list(self.system.walls())
        walls = [tuple(letters.index(letter) for letter in word[1:]) for word in words]
        return [
            Parallelogram(tuple(c), (tuple(m[0]), tuple(m[1])), w)
            for c, m, w in zip(centres.tolist(), matrices.tolist(), walls, strict=True)
        ]

    def meeting(self, stated: Sequence[Any]) -> Sequence[tuple[int, int]]:
        return meeting(stated)

    def covers(self, source: Any, targets: Sequence[Any]) -> None:
        covers(self.equation, source.walls[-1], source, targets)

    def written(self, kept: Sequence[Any], relations: list[list[int]], returns: int) -> dict[str, Any]:
        sets = [{"centre": [*each.centre], "matrix": [[*row] for row in each.matrix], "walls": [*each.walls]} for each in kept]
        return {"wall": kept[0].walls[-1], "returns": returns, "sets": sets, "relations": relations}
