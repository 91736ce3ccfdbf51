"""The task of every solver: first returns of the vibro-impact pair from a grid of starts, and from 60 hard ones.

The answers are known: `references.npz` holds them as solved in 50-digit arithmetic and rounded to double.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import pi, sin
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats

SIDE = 100  #: starts along each axis of the grid
SPEEDS = (0.01, 1.2)  #: impact speeds of the grid, both included
REFERENCES = Path(__file__).with_name("references.npz")


@dataclass(frozen=True, slots=True)
class Pair:
    """The parameters of a vibro-impact pair: length, restitution and gravity along the capsule, dimensionless."""

    d: float
    r: float
    g_bar: float


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """First returns to B of N states; NaN and -1 where the solver found none."""

    image: Floats  #: shape (N, 2), impact speed and phase (radians, any turn)
    tops: NDArray[np.int8]  #: shape (N,), impacts on T on the way, which spell the word: B, as many T, B

    @classmethod
    def none(cls, n: int) -> "Answer":
        """N returns that are yet to be found."""
        return cls(np.full((n, 2), np.nan), np.full(n, -1, np.int8))


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Starts and what they lead to, of one pair."""

    pair: Pair
    starts: Floats  #: shape (N, 2), impact speed and phase (radians)
    truth: Answer

    def first(self, n: int) -> "Task":
        """The first n of the starts, or as many as there are."""
        return Task(self.pair, self.starts[:n], Answer(self.truth.image[:n], self.truth.tops[:n]))


def physical(d: float, r: float = 0.5, beta: float = pi / 3) -> Pair:
    """The pair of a capsule of 0.1245 kg under 5 N that is tilted by beta, as the paper has it."""
    return Pair(d, r, 0.1245 * 9.8 * sin(beta) / 5)


GRID = physical(0.30)
"""The pair of the 10,000 starts: the paper's case PD."""


def grid() -> Floats:
    """The 10,000 starts, shape (10000, 2): speeds in [0.01, 1.2] by phases in [0, 2 pi), a row of speeds a phase."""
    phases = np.arange(SIDE) * (2 * pi / SIDE)
    v, phi = np.meshgrid(np.linspace(*SPEEDS, SIDE), phases)
    return np.column_stack([v.ravel(), phi.ravel()])


@lru_cache(maxsize=1)
def grid_task() -> Task:
    """The 10,000 starts with their references, in an order that mixes them, so that the first n are a fair sample."""
    order = np.random.default_rng(2025).permutation(SIDE * SIDE)
    with np.load(REFERENCES) as kept:
        return Task(GRID, grid()[order], Answer(kept["image"][order], kept["tops"][order]))


@lru_cache(maxsize=1)
def hard_tasks() -> tuple[Task, ...]:
    """The hard cases, one task a pair: starts close to a graze, and impact speeds from 1e-2 down to 1e-10."""
    with np.load(REFERENCES) as kept:
        rows = kept["hard"]
    pairs, which = np.unique(rows[:, :3], axis=0, return_inverse=True)
    groups = [rows[which.ravel() == k] for k in range(len(pairs))]
    return tuple(
        Task(Pair(*map(float, pair)), np.ascontiguousarray(q[:, 3:5]), Answer(q[:, 5:7], q[:, 7].astype(np.int8)))
        for pair, q in zip(pairs, groups, strict=True)
    )
