"""Composite maps under noise: their images are kicked as the noise kicks the exact images of each piece."""

import re
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Random, entropy_of
from nsmaps.coordinates import StateLike, as_starts
from nsmaps.dynamics.iterated import IteratedMap
from nsmaps.dynamics.motion import joined
from nsmaps.dynamics.noise.law import Noise
from nsmaps.dynamics.noise.orbits import noisy_orbits
from nsmaps.errors import NsmapsError
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.words import CHATTER, REST
from nsmaps.reduced.composite.composite import CompositeMap

SAMPLE = 400  #: states of a piece from which the noise of its images is estimated
WIDE, TRIMS = 3.0, 6  #: standard deviations beyond which a deviation is left out, and how often
MARKS = re.escape(CHATTER + REST)


@dataclass(frozen=True, slots=True, eq=False)
class KickedMap:
    """A composite map of P pieces in n coordinates whose images are moved by normal deviates, of one law for each piece."""

    map: CompositeMap
    roots: Floats  #: shape (P, n, n), a square root of the covariance of the deviations of each piece's images

    @classmethod
    def of(cls, return_map: CompositeMap, system: System, states: Floats, noise: Noise, rng: Random = 0) -> Self:
        """The map under a noise, by short exact orbits with and without it from at most 400 of some states (N, n) in each piece.

        Deviations count whose orbit has the same word with and without noise. Those beyond three standard deviations are left
        out, repeatedly: beside a graze images depend on the noise as a root, and have no standard deviation of their own.
        """
        piece, there = return_map.piece_of(states), IteratedMap(system, return_map.returns_of)
        seed, roots = np.atleast_1d(entropy_of(rng)).tolist(), np.zeros((len(return_map.pieces), *2 * states.shape[1:]))
        for k, own in enumerate(return_map.pieces):
            rows = np.flatnonzero(piece == k)
            rows = rows[:: -(-len(rows) // SAMPLE) or 1]
            if own.word and len(rows):
                noisy = noisy_orbits(system, states[rows], noise, n_returns=own.returns, n_realisations=len(rows), rng=[*seed, k])
                exact = there.first_return(states[rows])
                words = [joined(each) for each in noisy.words.T.tolist()]
                off = return_map.coordinates.difference(noisy.states[-1], exact.image)
                roots[k] = _root(off[(exact.words == words) & np.isfinite(off).all(axis=1)])
        return cls(return_map, roots)

    def words(self, start: StateLike, n_returns: int, n_realisations: int, rng: Random = 0) -> NDArray[np.str_]:
        """The words of n successive returns of R realisations from one state, shape (n, R); "" after an orbit's end.

        The image of a piece of several returns has the word of each of them, so that these are counted as the exact map's. A
        coordinate of which the piece takes the absolute value is reflected at zero.
        """
        start, n = as_starts(start, self.map.coordinates), n_returns
        if n < 1 or n_realisations < 1 or start.ndim != 1:
            raise NsmapsError(
                f"{n} returns of {n_realisations} realisations from {start.shape}; expected: one or more, of one state"
            )
        generator, states = np.random.default_rng(rng), np.tile(start, (n_realisations, 1))
        speeds = np.array([[name in each.map.absolute for name in self.map.coordinates] for each in self.map.pieces])
        found: list[list[str]] = [[] for _ in range(n_realisations)]
        while min(map(len, found)) < n:
            piece, returns = self.map.piece_of(states), self.map.first_return(states)
            for words, word, number in zip(found, returns.words.tolist(), returns.numbers.tolist(), strict=True):
                each = list(word) if len(word) == number else single_words(word)  # without walls a letter is a return
                words += (each + [""] * number)[:number]
            kicked = returns.image + np.einsum("kij,kj->ki", self.roots[piece], generator.normal(size=states.shape))
            states = np.where(speeds[piece], np.abs(kicked), kicked)
            states[piece < 0] = np.nan
        return np.array([words[:n] for words in found], str).T


def single_words(word: str) -> list[str]:
    """The words of the returns that are joined in one, which begins on the base wall; none for "".

    >>> single_words("BBTB"), single_words("BTB"), single_words("B~TB")
    (['BB', 'BTB'], ['BTB'], ['B~', 'BTB'])
    """
    base = re.escape(word[:1])
    return [word[0] + each for each in re.findall(f"(?:[^{base}{MARKS}]+[{MARKS}]?)*{base}|[{MARKS}]", word[1:])] if word else []


def _root(deviations: Floats) -> Floats:
    """A square root of the covariance of deviations (N, n) from zero, without those far out; zero from too few."""
    n = deviations.shape[1]
    for _ in range(TRIMS):
        if len(deviations) <= 2 * n:
            return np.zeros((n, n))
        values, axes = np.linalg.eigh(deviations.T @ deviations / len(deviations))
        root = axes * np.sqrt(np.maximum(values, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.where(values > 0, (deviations @ axes) ** 2 / values, 0.0).sum(axis=1)
        deviations = deviations[far <= WIDE**2]
    return np.asarray(root)
