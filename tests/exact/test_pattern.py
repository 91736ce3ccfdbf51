"""Patterns of words: the same words as Python's regular expressions, without their exponential time."""

import re

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from messages import message

from nsmaps.exact.patterns import reach_of
from nsmaps.exact.surfaces.family import WordFamily

ATOMS = st.sampled_from(["B", "T", "~"])
PATTERNS = st.recursive(
    ATOMS,
    lambda inner: (
        st.lists(inner, min_size=1, max_size=3).map("".join)
        | st.tuples(inner, inner).map("|".join).map("({})".format)
        | st.tuples(inner.map("({})".format) | ATOMS, st.sampled_from(["+", "*", "?", "+?", "*?", "??"])).map("".join)
    ),
    max_leaves=6,
)


def matches(pattern: str, word: str) -> bool:
    return len(word) in reach_of(pattern)(word, frozenset({0}))


@given(PATTERNS, st.text(st.sampled_from("BT~"), max_size=7))
def test_a_pattern_stands_for_the_words_of_the_regular_expression(pattern: str, word: str) -> None:
    try:
        expected = re.fullmatch(pattern, word) is not None
    except re.error:
        assume(False)
    assert matches(pattern, word) == expected


@pytest.mark.parametrize("pattern", ["(B*)*(B*)*(B*)*T", "(B|B|B)*T", "((B+)+)+T", "(B?)" * 100 + "T", "((((B*)*)*)*)*T"])
def test_no_pattern_takes_exponential_time(pattern: str) -> None:
    """2^39 steps would not end."""
    assert not any(matches(pattern, "B" * letters) for letters in range(40))
    assert matches(pattern, "B" * 39 + "T")


def test_a_pattern_that_is_nested_too_deeply_is_refused() -> None:
    WordFamily(name="deep", words=("(" * 50 + "B" + ")" * 50 + "B",))
    with pytest.raises(ValueError, match=message("exact.nested-pattern")):
        WordFamily(name="deep", words=("(" * 51 + "B" + ")" * 51 + "B",))
