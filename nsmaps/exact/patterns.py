"""Patterns of words, matched by the set of all reachable places, in a time that grows linearly with the word.

Python's regular expressions try one way after another: `(B*)*(B*)*T` has 2^n ways in a word of n letters.
"""

from collections.abc import Callable
from functools import reduce

Reach = Callable[[str, frozenset[int]], frozenset[int]]  #: a word, places where a part may begin -> where it may end


def reach_of(pattern: str) -> Reach:
    """The function from places to reachable places of a pattern of letters, `+`, `*`, `?`, `|` and parentheses.

    The pattern must be one that `re.compile` accepts.

    >>> [word for word in ("BTB", "BBTB", "BBB") if len(word) in reach_of("B+TB")(word, frozenset({0}))]
    ['BTB', 'BBTB']
    """
    reach, at = _alternatives(pattern, 0)
    assert at == len(pattern), "parentheses are closed, as `re.compile` demands"
    return reach


def _alternatives(pattern: str, at: int) -> tuple[Reach, int]:
    """The alternatives from a place on, up to the end or to the closing parenthesis, and the place of that."""
    parts: list[Reach] = []
    alternatives = [parts]
    while at < len(pattern) and pattern[at] != ")":
        if pattern[at] == "|":
            alternatives.append(parts := [])
            at += 1
        else:
            reach, at = _repetition(pattern, at)
            parts.append(reach)
    return lambda word, starts: frozenset().union(*(reduce(lambda at, part: part(word, at), p, starts) for p in alternatives)), at


def _repetition(pattern: str, at: int) -> tuple[Reach, int]:
    """A letter or a group in parentheses, with the sign after it, and where it ends; `+?` and `++` are read as `+`."""
    if pattern[at] == "(":
        one, at = _alternatives(pattern, at + 1)
    else:
        one = _letter(pattern[at])
    sign = pattern[at + 1 : at + 2]
    if sign not in ("+", "*", "?") or not sign:
        return one, at + 1
    at += 3 if pattern[at + 2 : at + 3] in ("?", "+") and pattern[at + 2 : at + 3] else 2
    return (lambda word, starts: starts | one(word, starts)) if sign == "?" else _repeat(one, sign), at


def _letter(letter: str) -> Reach:
    return lambda word, starts: frozenset(k + 1 for k in starts if word.startswith(letter, k))


def _repeat(one: Reach, sign: str) -> Reach:
    """A part any number of times, with `+` at least once."""

    def reach(word: str, starts: frozenset[int]) -> frozenset[int]:
        new = reached = starts if sign == "*" else one(word, starts)
        while new:
            new = one(word, new) - reached
            reached |= new
        return reached

    return reach
