"""Kinds of motion: the period of an attractor, and its name n:m/pT from the words of its returns."""

from collections.abc import Sequence
from math import gcd

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import angle_mask, nearest_turn
from nsmaps.exact.words import CHATTER, LONGER, REST

_RESTING = (CHATTER, REST, LONGER)
_SPELLED = 3  #: returns of a motion that rests or chatters, up to which it is named by all of its words


def differences(a: Floats, b: Floats, coordinates: Sequence[str]) -> Floats:
    """a - b of states, shape (..., n), angles on the nearest turn."""
    apart = a - b
    return np.where(angle_mask(coordinates), nearest_turn(apart, 0.0), apart)


def magnitudes(coordinates: Sequence[str], *states: Floats) -> Floats:
    """What tolerances of n coordinates are shares of, shape (n,): the largest magnitude of each among states (..., n).

    One radian of an angle. What is not finite does not count; one where there is nothing but zeros.
    """
    sizes = [np.abs(some).reshape(-1, len(coordinates)) for some in states]
    largest = np.concatenate(sizes).max(axis=0, initial=0.0, where=np.isfinite(np.concatenate(sizes)))
    return np.where(angle_mask(coordinates) | (largest == 0), 1.0, largest)


def periods(states: Floats, codes: NDArray[np.int64], coordinates: Sequence[str], tolerance: ArrayLike) -> NDArray[np.int64]:
    """The least number of returns after which orbits repeat, at most K/2; 0 where there is none.

    Args:
        states: shape (..., K, n), states one after the other.
        codes: shape (..., K), of the words of the returns to them, which must repeat too.
        tolerance: of each coordinate, shape (n,) or one for all, in its units, from its first value on.
    """
    count, dim = states.shape[-2:]
    flat, words = states.reshape(-1, count, dim), codes.reshape(-1, count)
    most = np.arange(1, count // 2 + 1)
    maybe = np.ones((len(flat), len(most)), bool)
    for here in (most, np.full_like(most, count - 1)):  # where almost every number that is no period shows: this makes it linear
        maybe &= _repeat(flat, words, here, here % most, coordinates, tolerance)
    period = np.zeros(len(flat), np.int64)
    every = np.arange(count)
    for q in most[maybe.any(axis=0)].tolist():
        left = np.flatnonzero(maybe[:, q - 1] & (period == 0))
        if len(left):  # compared with the first period, not the one before: slow decay would pass for a period
            period[left[_repeat(flat[left], words[left], every, every % q, coordinates, tolerance).all(axis=1)]] = q
    return period.reshape(codes.shape[:-1])


def _repeat(
    states: Floats,
    codes: NDArray[np.int64],
    here: NDArray[np.int64],
    there: NDArray[np.int64],
    coordinates: Sequence[str],
    tolerance: ArrayLike,
) -> NDArray[np.bool_]:
    """Whether states (N, K, n) and words (N, K) at some places are those at others, shape (N, places)."""
    apart = differences(states[:, here], states[:, there], coordinates)
    return (np.abs(apart) <= np.asarray(tolerance)).all(axis=-1) & (codes[:, here] == codes[:, there])


def joined(words: Sequence[str]) -> str:
    """The word of successive returns, the impact between two of them written once; "" if one is unknown.

    >>> joined(["BB", "BTB"])
    'BBTB'
    """
    return "" if not all(words) else words[0][:1] + "".join(word[1:] for word in words)


def label(words: Sequence[str], turns: Sequence[int], period: int, walls: Sequence[str]) -> str:
    """The motion n:m/pT: impacts n on the base wall, m on the other, in p periods of the forcing.

    Impacts are counted for each of as many equal parts as n, m and p have: a doubled 1:1 motion is 1:1/2T, as in the paper. A
    fitted map whose phases do not tell whole turns, or run back, has the period in returns instead: 1:1, period 2. Without a
    period it is 1:m/C if all these returns have the same impacts, else C, of which a sample has no ratio. Motion that rests or
    chatters on its way is named
    by its words, of more than three returns by those of rest and chatter and the period in returns, as B~, period 53; that of
    unknown words by nothing.

    Args:
        words, turns: of successive returns, at least one period of them; turns are whole turns of the phase.
        period: in returns, 0 if there is none.
    """
    if not all(words):
        return ""
    if any(mark in word for word in words for mark in _RESTING):
        return _resting(words[:period]) or "C"
    others = [sum(word.count(wall) for wall in walls[1:]) for word in words]
    if period:
        n, m, p = period, sum(others[:period]), sum(turns[:period])
        parts = gcd(n, m, p)
        return (
            f"{n // parts}:{m // parts}/{p if p != 1 else ''}T"
            if p > 0
            else f"{n // gcd(n, m)}:{m // gcd(n, m)}, period {period}"
        )
    return f"1:{others[0]}/C" if len(set(others)) == 1 else "C"


def _resting(words: Sequence[str]) -> str:
    """The name of motion that rests or chatters, of the words of one period, wherever in it the orbit was met."""
    if len(words) > _SPELLED:
        rests = sorted({word for word in words if any(mark in word for mark in _RESTING)})
        return f"{' '.join(rests)}, period {len(words)}"
    return " ".join(min(([*words[k:], *words[:k]] for k in range(len(words))), default=[]))
