"""Errors of a map of strips against the exact map, at held-out states."""

from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats, Random
from nsmaps.reduced.adaptive.slabs import Slab
from nsmaps.reduced.adaptive.surrogate import StripMap
from nsmaps.results import Result

BESIDE = (1e-11, 1e-2)  #: distances from an edge, in radians, between which states are drawn, log-uniformly


@dataclass(frozen=True, slots=True, repr=False)
class HeldOut(Result):
    """Errors of speed and of phase (radians), the larger of the two, over states that a leaf answers."""

    points: int
    largest: float
    high: float  #: quantile of 99 %
    over: int  #: number beyond the tolerance
    wrong_words: int
    by_exact_map: int  #: further states, in no leaf

    def summary(self) -> str:
        """The numbers that matter."""
        errors = f"largest error {self.largest:.2g}, 99 % below {self.high:.2g}, {self.over} beyond the tolerance"
        return f"{self.points} states: {errors}, {self.wrong_words} wrong words"


def held_out(return_map: StripMap, points: int = 100_000, rng: Random = 0) -> tuple[HeldOut, HeldOut]:
    """The errors at states drawn uniformly over the box, and at states drawn increasingly close to the edges."""
    rng = np.random.default_rng(rng)
    low, high = return_map.strips.bounds.T
    uniform = low + (high - low) * rng.random((points, 2))
    edges = [(slab, k) for slab in return_map.strips.slabs for k in range(1, len(slab.curves) - 1)]
    return _errors(return_map, uniform), _errors(return_map, _beside(edges, points, rng))


def _beside(edges: list[tuple[Slab, int]], points: int, rng: np.random.Generator) -> Floats:
    if not edges:
        return np.empty((0, 2))
    each = -(-points // len(edges))
    states = []
    for slab, k in edges:
        s = rng.uniform(-1, 1, each)
        away = np.exp(rng.uniform(np.log(BESIDE[0]), np.log(BESIDE[1]), each)) * rng.choice([-1, 1], each)
        states.append(np.column_stack([slab.speeds(s), slab.phases(s)[k] + away]))
    return np.concatenate(states)


def _errors(return_map: StripMap, states: Floats) -> HeldOut:
    mine = states[return_map.leaf_of(states) >= 0]
    ours, exact = return_map.first_return(mine), return_map.system.first_return(mine)
    error = np.abs(ours.lifted - exact.lifted).max(axis=1) if len(mine) else np.zeros(1)
    return HeldOut(
        points=len(states),
        largest=float(error.max()),
        high=float(np.quantile(error, 0.99)),
        over=int(np.sum(~(error <= return_map.strips.report.tolerance))),
        wrong_words=int(np.sum(ours.codes != exact.codes)),
        by_exact_map=len(states) - len(mine),
    )
