"""Kinds of motion: the period of an attractor, and its name n:m/pT from the words of its returns."""

from collections.abc import Iterable, Iterator, Sequence
from math import gcd

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates
from nsmaps.exact.words import CHATTER, LONGER, PLAIN, REST, Alphabet

CHAOS, QUASI_PERIODIC, UNRESOLVED = "C", "Q", "unresolved"  #: the kinds of motion without a period, as names of motions have them
ESCAPE = "escapes"  #: the name of an orbit that leaves every bound
MEANING = {  #: what they stand for
    CHAOS: "chaos",
    QUASI_PERIODIC: "quasi-periodic motion",
    UNRESOLVED: "motion of which neither a period nor chaos was shown",
    ESCAPE: "an orbit that leaves every bound",
}

_MARKS = (CHATTER, REST)
_RESTING = (*_MARKS, LONGER)
_SPELLED = 3  #: largest number of words by which a motion is named
_LETTERS = 12  #: largest length of a word by which a motion is named
#: largest relative difference of the times of two periods: in the midst of chatter each is shorter than the last
SAME_TIME = 1e-5


def repetition(states: Floats, codes: Ints, coordinates: Coordinates, tolerance: ArrayLike, time: Floats | None = None) -> int:
    """The least number of returns after which an orbit repeats, at most K/2; 0 where there is none.

    Args:
        states: shape (K, n), successive states.
        codes: shape (K,), of the words of the returns to them, which must repeat too.
        tolerance: of each coordinate, in its units, from its first value on: shape (n,), or one for all.
        time: shape (K,), of these returns; NaN where unknown. Periods must take the same time, relative to itself: the
            states of slow impacts that accumulate agree within any tolerance, but each return is shorter than the last.
    """

    def agree(here: Ints, there: Ints) -> Bools:
        return coordinates.near(states[here], states[there], tolerance) & (codes[here] == codes[there])

    every, lengths = np.arange(len(states)), np.arange(1, len(states) // 2 + 1)
    last = np.full_like(lengths, len(states) - 1)
    maybe = agree(last, last % lengths)  # these two rule out almost every length: linear cost
    maybe[maybe] = agree(lengths[maybe], 0 * lengths[maybe])
    for q in lengths[maybe].tolist():
        if agree(every, every % q).all():  # compared with the first period, not the previous one: slow decay would pass for one
            first, end = (0.0, 0.0) if time is None else (float(time[:q].sum()), float(time[-q:].sum()))
            return 0 if abs(first - end) > SAME_TIME * max(abs(first), abs(end)) else q
    return 0


def joined(words: Sequence[str], alphabet: Alphabet | None = None) -> str:
    """The word of successive returns, with the impact between two of them written once; "" if one is unknown.

    >>> joined(["BB", "BTB"])
    'BBTB'
    """
    if (alphabet is not None and alphabet.section == ("",)) or all(len(word) == 1 for word in words):
        return "".join(words)
    return "" if not all(words) else words[0][:1] + "".join(word[1:] for word in words)


def label(words: Sequence[str], turns: Sequence[int], period: int, alphabet: Alphabet | None = None, kind: str = CHAOS) -> str:
    """The name n:m/pT of a motion: n returns to the section, m events elsewhere, in p periods of the forcing.

    Of an impact system these are the impacts on the base wall and on the other. With modes m counts all events with a letter that
    is not the section's, but those at fixed times, which happen whatever the motion is. They
    are counted for each of as many equal parts as n, m and p have: a doubled 1:1 motion is 1:1/2T, as in the paper. Where whole
    turns are unknown, as for a fitted map, or run back, the name has the period in returns instead: 1:1, period 2.
    Without a period it is 1:m/C if all these returns have the same impacts, otherwise C, since a sample determines no ratio.
    Two kinds of motions are named by their words: those with rest or chatter, of which each complete chatter is one event
    (`condensed`), and those between events of several letters, which n:m does not distinguish.

    Args:
        words, turns: of successive returns, at least one period of them, or of the images of one period, of which some are of
            several returns; turns are whole turns of the phase.
        period: in returns, 0 if there is none.
        alphabet: what the letters stand for; by default words begin and end with one letter of the section.
        kind: of motion without a period, one of `MEANING`.
    """
    there = alphabet or PLAIN
    took = sum(turns[:period]) or period * there.turns
    if any(mark in word for word in words for mark in _RESTING):
        return _spelled(condensed(words[:period]), took) if period else kind
    counts = {word: _counted(word, there) for word in set(words)}
    known = [count for count in counts.values() if count is not None]
    if len(known) < len(counts) or len({tuple(_ends(word, there)) for word in counts}) > 1:
        spelt = period and (all(words) or there.section)
        return (_by_word(words[:period], took, period, there) if spelt else _in_returns("", took, period)) or kind
    if not period:
        return f"1:{known[0][1]}/{kind}" if len(set(known)) == 1 else kind
    pairs = [counts[word] or (0, 0) for word in words[:period]]
    n, m = sum(pair[0] for pair in pairs), sum(pair[1] for pair in pairs)
    parts = gcd(n, m, took) if took > 0 else gcd(n, m)
    return _in_returns(f"{n // parts}:{m // parts}", took, period)


def _in_returns(name: str, turns: int, period: int) -> str:
    """A name with the period in those of the forcing, or in returns where they are not known; "" without a period."""
    if turns > 0 and period:
        return f"{name}/{turns if turns != 1 else ''}T" if name else f"period {period}"
    return f"{name}, period {period}".removeprefix(", ") if period else ""


def _ends(word: str, alphabet: Alphabet) -> set[str]:
    """The section's letters with which a word begins and ends."""
    return set() if alphabet.section == ("",) else {word[:1], word[-1:]}


def _counted(word: str, alphabet: Alphabet) -> tuple[int, int] | None:
    """The returns to the section and the events elsewhere of a word; None where this is not how it is to be read."""
    ends = _ends(word, alphabet)
    several = alphabet.section is not None and len(alphabet.section) > 1
    if len(ends) > 1 or several or alphabet.shared or (ends and len(word) < 2):
        return None
    others = sum(letter not in ends and letter not in alphabet.clocks for letter in word)
    return (sum(letter in ends for letter in word) - 1 if ends else 1), others


def _by_word(words: Sequence[str], turns: int, period: int, alphabet: Alphabet) -> str:
    """The name by the word of one period, the least of its rotations; a long one is left out."""
    word = min((joined(each, alphabet) for each in rotations(words)), default="")
    return _in_returns(word if len(word) <= _LETTERS else "", turns, period)


def rotations(words: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """The words of a period, from each of them on."""
    return ((*words[k:], *words[:k]) for k in range(len(words)))


def has_rest(word: str) -> bool:
    """True for the word of a return in which a body comes to rest."""
    return any(mark in word for mark in _MARKS)


def condensed(words: Sequence[str]) -> list[str]:
    """The words of one period with rest or chatter, in which each complete chatter with the release after it is one event.

    The number of impacts until chatter is complete says how slow they were when they were summed, not what the motion is. A rest
    after a single impact, without restitution, has no such impacts before it.

    >>> condensed(["BB", "B~", "BTB", "BB", "BB"]), condensed(["BB", "B_", "BB"])
    (['B~TB'], ['BB', 'B_B'])
    """
    count = len(words)
    begins = next((k for k in range(count) if words[k - 1][-1:] not in _MARKS), 0)
    events = list[str]()
    for word in (*words[begins:], *words[:begins]):
        if events and events[-1][-1:] in _MARKS:
            events[-1] += word[1:]
        else:
            events.append(word)
    slow = [word == 2 * word[:1] for word in events]
    chatter = [word[1:2] == CHATTER for word in events]
    for k in range(2 * len(events) - 1, -1, -1):  # backwards, once more round: impacts before those that precede chatter
        here, after = k % len(events), (k + 1) % len(events)
        chatter[here] |= slow[here] and chatter[after]
    return [word for word, drop in zip(events, (a and b for a, b in zip(slow, chatter, strict=True)), strict=True) if not drop]


def _spelled(words: Sequence[str], turns: int) -> str:
    """The name of motion with rest or chatter, of the words of one period, wherever in it the orbit begins."""
    if len(words) > _SPELLED:
        name = " ".join(sorted({word for word in words if any(mark in word for mark in _RESTING)}))
    else:
        name = " ".join(min(rotations(words), default=()))
    return _in_returns(name, turns, len(words))


def without_turns(name: str, period: int) -> str:
    """The name of a motion of a period in returns, as if whole turns were unknown, such as 1:1, period 2 for 1:1/2T."""
    counts, slash, whole = name.rpartition("/")
    if not slash or not whole.endswith("T") or not period:
        return name
    n, colon, m = counts.partition(":")
    if not colon:
        return _in_returns(counts, 0, period)
    parts = gcd(int(n), int(m))
    return _in_returns(f"{int(n) // parts}:{int(m) // parts}", 0, period)


def kind_of(name: str) -> str:
    """The kind of the motion of a name without a period, such as C of 1:1/C; "" of one with a period."""
    return next((kind for kind in MEANING if name == kind or name.endswith(f"/{kind}")), "")


def kinds_explained(names: Iterable[str]) -> str:
    """What the letters in some names of motions without a period stand for, such as `C: chaos`; "" without such a name.

    >>> kinds_explained(["1:1/T", "1:1/C", "1:2/unresolved"])
    'C: chaos; unresolved: motion of which neither a period nor chaos was shown'
    """
    there = {kind_of(name) for name in names} - {ESCAPE}
    return "; ".join(f"{kind}: {text}" for kind, text in MEANING.items() if kind in there)
