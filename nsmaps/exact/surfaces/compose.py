"""Several consecutive returns read as one: BB and then BTB is BBTB."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Ints
from nsmaps.exact.returns import Margin, Returns
from nsmaps.exact.words import CHATTER, LONGER, REST, base_of_words, decode, encode

if TYPE_CHECKING:
    from nsmaps.exact.returnmap import ReturnMap

LARGEST_CODE = 2**63 - 1  #: of a word, an int64


def compose_returns(first: Returns, second: Returns) -> Returns:
    """Two consecutive returns of each state as one: the second starts from the image of the first.

    The base wall between them is one letter of the joint word: BB, BTB give BBTB, and B~, BTB give B~TB. Where either has no
    image there is no word, and the outcome is that of the one which ended.
    """
    pairs, inverse = np.unique(np.column_stack([first.codes, second.codes]), axis=0, return_inverse=True)
    codes = np.array([_joint_code(int(a), int(b), first.walls) for a, b in pairs], np.int64)[inverse.reshape(-1)]
    derivative = margin = None
    if first.derivative is not None and second.derivative is not None:
        derivative = second.derivative @ first.derivative
    if first.margin is not None and second.margin is not None:
        one, two = first.margin, second.margin
        margin = Margin(np.minimum(one.clearance, two.clearance), np.minimum(one.slowest, two.slowest))
    return replace(
        second,
        start=first.start,
        turns=first.turns + second.turns,
        codes=np.where(second.valid, codes, 0),
        outcome=np.where(first.valid, second.outcome, first.outcome),
        time=first.time + second.time,
        derivative=derivative,
        margin=margin,
        fitted=first.fitted or second.fitted,
        integrated=first.integrated or second.integrated,
        number=first.numbers + second.numbers,
    )


def iterate_returns(return_map: "ReturnMap", returns: Returns, times: Ints) -> Returns:
    """Returns of a map, each joined with those that follow it, as many in all as `times` has, shape (N,), from one on."""
    rows, row, derivative = np.arange(len(returns)), replace(returns, number=returns.numbers), returns.derivative is not None
    numbers, parts = [rows[times <= 1]], [row.select(times <= 1)]
    for k in range(2, int(times.max(initial=1)) + 1):
        on = times[rows] >= k
        rows, row = rows[on], row.select(on)
        row = compose_returns(row, return_map.first_return(row.image, derivative))
        done = times[rows] == k
        numbers.append(rows[done])
        parts.append(row.select(done))
    return Returns.concatenate(parts).select(np.argsort(np.concatenate(numbers), kind="stable"))


def _joint_code(first: int, second: int, walls: tuple[str, ...]) -> int:
    """The code of two words read as one; negative, as in the kernel, where it holds only the beginning."""
    one, two = decode(first, walls), decode(second, walls)
    if LONGER in one or not two:
        return first if LONGER in one else 0
    word = one + two.removesuffix(LONGER)[1:]
    letters = int(math.log(LARGEST_CODE, base_of_words(walls))) - 1  # as many as the kernel's
    return -encode(word[:letters], walls) if len(word) > letters or LONGER in two else encode(word, walls)


def returns_in_word(word: str) -> int:
    """The number of returns of a word without repetitions: its base letters but the last, and releases on the base wall.

    >>> [returns_in_word(word) for word in ("BB", "BTTB", "BBTB", "B~", "B~TB")]
    [1, 1, 2, 1, 2]
    """
    base = word[:1]
    return max(word.count(base) - 1 + word.count(base + CHATTER) + word.count(base + REST), 1)
