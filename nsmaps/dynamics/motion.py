"""Kinds of motion: the period of an attractor, and its name n:m/pT from the words of its returns."""

from collections.abc import Sequence
from math import gcd

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import Coordinates
from nsmaps.exact.words import CHATTER, LONGER, REST

_RESTING = (CHATTER, REST, LONGER)
_SPELLED = 3  #: longest period, in returns, of a motion with rest or chatter that is named by all of its words


def periods(states: Floats, codes: NDArray[np.int64], coordinates: Coordinates, tolerance: ArrayLike) -> NDArray[np.int64]:
    """The least number of returns after which orbits repeat, at most K/2; 0 where there is none.

    Args:
        states: shape (..., K, n), successive states.
        codes: shape (..., K), of the words of the returns to them, which must repeat too.
        tolerance: of each coordinate, in its units, from its first value on: shape (n,), one for all, or (..., n), of each orbit.
    """
    count, dim = states.shape[-2:]
    flat, words = states.reshape(-1, count, dim), codes.reshape(-1, count)
    near = np.broadcast_to(np.asarray(tolerance, float), (*codes.shape[:-1], dim)).reshape(-1, 1, dim)
    lengths = np.arange(1, count // 2 + 1)
    maybe = np.ones((len(flat), len(lengths)), bool)
    for here in (lengths, np.full_like(lengths, count - 1)):  # they rule out almost every length: linear cost
        maybe &= _repeat(flat, words, here, here % lengths, coordinates, near)
    period = np.zeros(len(flat), np.int64)
    every = np.arange(count)
    for q in lengths[maybe.any(axis=0)].tolist():
        left = np.flatnonzero(maybe[:, q - 1] & (period == 0))
        if len(left):  # compared with the first period, not the previous one: slow decay would pass for a period
            period[left[_repeat(flat[left], words[left], every, every % q, coordinates, near[left]).all(axis=1)]] = q
    return period.reshape(codes.shape[:-1])


def _repeat(
    states: Floats,
    codes: NDArray[np.int64],
    here: NDArray[np.int64],
    there: NDArray[np.int64],
    coordinates: Coordinates,
    tolerance: Floats,
) -> NDArray[np.bool_]:
    """A mask: states (N, K, n) and words (N, K) at some places agree with others within (N, 1, n), shape (N, places)."""
    return coordinates.near(states[:, here], states[:, there], tolerance) & (codes[:, here] == codes[:, there])


def joined(words: Sequence[str]) -> str:
    """The word of successive returns, with the impact between two of them written once; "" if one is unknown.

    >>> joined(["BB", "BTB"])
    'BBTB'
    """
    return "" if not all(words) else words[0][:1] + "".join(word[1:] for word in words)


def label(words: Sequence[str], turns: Sequence[int], period: int, walls: Sequence[str]) -> str:
    """The name n:m/pT of a motion: impacts n on the base wall, m on the other, in p periods of the forcing.

    Impacts are counted for each of as many equal parts as n, m and p have: a doubled 1:1 motion is 1:1/2T, as in the paper. A
    fitted map whose phases do not determine whole turns, or run back, has the period in returns instead: 1:1, period 2.
    Without a
    period it is 1:m/C if all these returns have the same impacts, otherwise C, since a sample determines no ratio. Motion with
    rest or
    chatter is named by its words, of more than three returns by those of rest and chatter and the period in returns, as B~,
    period 53; a
    motion with unknown words has no name.

    Args:
        words, turns: of successive returns, at least one period of them; turns are whole turns of the phase.
        period: in returns, 0 if there is none.
    """
    if not all(words):
        return ""
    others = {word: sum(word.count(wall) for wall in walls[1:]) for word in set(words)}
    if any(mark in word for word in others for mark in _RESTING):
        return _resting(words[:period]) or "C"
    if period:
        n, m, p = period, sum(others[word] for word in words[:period]), sum(turns[:period])
        parts = gcd(n, m, p)
        return (
            f"{n // parts}:{m // parts}/{p if p != 1 else ''}T"
            if p > 0
            else f"{n // gcd(n, m)}:{m // gcd(n, m)}, period {period}"
        )
    return f"1:{others[words[0]]}/C" if len(set(others.values())) == 1 else "C"


def _resting(words: Sequence[str]) -> str:
    """The name of motion with rest or chatter, of the words of one period, wherever in it the orbit begins."""
    if len(words) > _SPELLED:
        rests = sorted({word for word in words if any(mark in word for mark in _RESTING)})
        return f"{' '.join(rests)}, period {len(words)}"
    return " ".join(min(([*words[k:], *words[:k]] for k in range(len(words))), default=[]))
