"""Impact words and itineraries, and the numbers by which compiled code represents them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Ints, Storable
from nsmaps.errors import StateError

CHATTER, REST, LONGER = "~", "_", "..."
HIGHEST, LOWEST = "^", "v"  # turning points in itineraries: the displacement has a maximum, a minimum


@dataclass(frozen=True, slots=True)
class Alphabet(Storable):
    """What letters stand for in the names of motions, which say how often they occur."""

    #: letters of the section's events, "" for one without a letter; None: the first and last of each word
    section: tuple[str, ...] | None = None
    clocks: tuple[str, ...] = ()  #: letters of events at fixed times alone, which do not count
    turns: int = 0  #: of the phase on every return, where the section is a clock and the phase therefore no coordinate
    shared: bool = False  #: whether other events than the section's have its letters, so that words do not count returns


PLAIN = Alphabet()  #: of words that begin and end with one letter of the section


def _letters(walls: Sequence[str], turns: bool) -> tuple[str, ...]:
    return (*walls, CHATTER, REST, *((HIGHEST, LOWEST) if turns else ()))


def base_of_words(walls: Sequence[str], turns: bool = False) -> int:
    """The base of the codes of words over these letters, in which the symbol zero ends a word.

    >>> base_of_words(("B", "T")), base_of_words(("B", "T"), turns=True)
    (5, 7)
    """
    return len(_letters(walls, turns)) + 1


def decode(code: int, walls: Sequence[str], turns: bool = False) -> str:
    """The word of a code: a letter for each impact in order.

    `~` stands after a wall on which chatter accumulated, `_` after one on which the ball rested, `...` where the word is longer
    than the code holds. With `turns` the code is that of an itinerary, in which `^` and `v` are turning points: maxima and minima
    of the displacement.

    >>> decode(1 + 4 * 5 + 3 * 25, ("B", "T")), decode(1 + 2 * 5 + 1 * 25, ("B", "T"))
    ('B_~', 'BTB')
    """
    letters, base = ("", *_letters(walls, turns)), base_of_words(walls, turns)
    word, remaining = "", abs(int(code))
    while remaining:
        remaining, symbol = divmod(remaining, base)
        word += letters[symbol]
    return word + LONGER if code < 0 else word


def encode(word: str, walls: Sequence[str]) -> int:
    """The code of a word, the inverse of `decode` for words that it holds completely.

    >>> decode(encode("BTTB", ("B", "T")), ("B", "T"))
    'BTTB'
    """
    symbols = {letter: symbol for symbol, letter in enumerate(_letters(walls, turns=False), 1)}
    code, place_value, remaining = 0, 1, word
    while remaining:
        letter = next((letter for letter in symbols if remaining.startswith(letter)), None)
        if letter is None:
            raise StateError(
                f"the word {word!r} has no letter at {remaining!r}; expected: the walls {', '.join(walls)}, "
                f"{CHATTER!r} (chatter) and {REST!r} (rest)"
            )
        code += symbols[letter] * place_value
        place_value *= base_of_words(walls)
        remaining = remaining.removeprefix(letter)
    return code


def longer_than(letters: int, codes: Ints, walls: Sequence[str], turns: bool = False) -> Bools:
    """A mask of the codes whose words (with `turns`: itineraries) have more letters, shape as the codes.

    >>> longer_than(2, np.array([encode("BB", ("B", "T")), encode("BTB", ("B", "T"))]), ("B", "T"))
    array([False,  True])
    """
    return (codes < 0) | (codes >= base_of_words(walls, turns) ** letters)


def words_of(codes: Ints, walls: Sequence[str], turns: bool = False) -> NDArray[np.str_]:
    """The words of codes, in their shape; see `decode`."""
    values, inverse = np.unique(codes, return_inverse=True)
    return np.array([decode(value, walls, turns) for value in values] or [""], dtype=str)[inverse.reshape(codes.shape)]
