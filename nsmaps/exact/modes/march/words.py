"""Words of returns, letter by letter, as codes: see `nsmaps.exact.words`."""

import math

from nsmaps.exact.engine.constants import TWO_PI
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.returns import append_symbol
from nsmaps.exact.modes.tables.memory import (
    ACCUMULATING,
    ACCUMULATION_TIME,
    CLEARANCE,
    CONTACT_MARK,
    CONTACT_TIME,
    DOUBT_REASON,
    DOUBTED_FUNCTION,
    FIRST_AT_ONCE,
    FUNCTION_BEFORE,
    IDLE_EVENTS,
    LAST_FUNCTION,
    MINIMA,
    NO_FUNCTION,
    ONLY,
    ROW_CODE,
    ROW_LETTER,
    ROW_POWER,
    SLOWEST,
    START_FUNCTION,
    TIMED_EVENTS,
)

INSTANT = 1e-13  # of a turn of the forcing: a shorter contact is a release
CHATTER, REST = 1, 2  # marks of lasting contact
MARKS = 2  # their number: their letters are the last ones below the base
OF_MARGINS = 2  # how much larger the base is with margins, where minima have a letter too


@inlined
def with_margins(w):
    """Whether margins, and the minima of functions in words, are asked for."""
    return not math.isnan(w.margins[CLEARANCE])


@inlined
def base_of(p, w):
    """The base of the codes of words."""
    return p.base + OF_MARGINS if with_margins(w) else p.base


@inner
def unit_of(p, mode, w):
    """A unit of time: a radian of the forcing, without one the longest step of a mode, of a Taylor flight the last one."""
    if p.rate > 0.0:
        return 1.0 / p.rate
    return p.steps[mode] if len(p.nonlinear) == 0 else w.piece.length[ONLY]


@inner
def reset_image(w):
    """Let the return in memory have no image."""
    for c in range(len(w.image)):
        w.image[c] = math.nan
        for j in range(w.tangent.shape[1]):
            w.tangent[c, j] = math.nan


@inner
def append_letter(base, digit, code, power):
    """A word with the letter of an event behind it, if it has one, and the place of the next letter."""
    return append_symbol(code, power, base, digit, 1 if digit else 0)


@inner
def note_letter(digit, code, power, w):
    """Take note of a letter that was written, if it begins a row of equal ones."""
    if digit > 0 and digit != w.integers[ROW_LETTER]:
        w.integers[ROW_LETTER], w.integers[ROW_CODE], w.integers[ROW_POWER] = digit, code, power


@inner
def append_contact(p, code, power, w):
    """The word with the mark of a contact that ends; whether the contact had a duration."""
    unit, mark = TWO_PI / p.rate if p.rate > 0.0 else unit_of(p, 0, w), w.integers[CONTACT_MARK]
    w.integers[CONTACT_MARK] = 0
    if mark == 0 or w.reals[CONTACT_TIME] <= INSTANT * unit:
        return code, power, False
    w.integers[ROW_LETTER] = 0
    code, power = append_symbol(code, power, base_of(p, w), p.base - MARKS - 1 + mark, 1)
    return code, power, True


@inner
def word_before_contact(code, power, w):
    """The word with the row of impacts before a contact that has just begun as one."""
    chatters = w.integers[CONTACT_MARK] == CHATTER and w.reals[CONTACT_TIME] == 0.0
    if chatters and w.integers[ROW_LETTER] > 0 and not with_margins(w):
        return w.integers[ROW_CODE], w.integers[ROW_POWER]
    return code, power


@inner
def reset_return(w):
    """Let memory hold nothing of a return."""
    reset_image(w)
    w.integers[CONTACT_MARK], w.integers[ROW_LETTER] = 0, 0
    w.integers[ACCUMULATING], w.integers[START_FUNCTION], w.integers[FIRST_AT_ONCE] = 0, NO_FUNCTION, NO_FUNCTION
    w.reals[ACCUMULATION_TIME] = 0.0
    w.integers[DOUBTED_FUNCTION], w.integers[DOUBT_REASON] = NO_FUNCTION, 0
    w.scales[:] = 0.0
    w.integers[IDLE_EVENTS], w.integers[TIMED_EVENTS] = 0, 0
    w.integers[LAST_FUNCTION], w.integers[FUNCTION_BEFORE] = NO_FUNCTION, NO_FUNCTION
    if with_margins(w):
        w.margins[CLEARANCE], w.margins[SLOWEST], w.margins[MINIMA] = math.inf, math.inf, 0.0
        w.minima[:] = 0


@inner
def first_letter(p, k, w):
    """The word of the letter of a transition with which a return begins: (code, place of the next letter)."""
    code, power = append_letter(base_of(p, w), p.digit[k], 0, 1)
    note_letter(p.digit[k], code, power, w)
    return code, power


@inner
def first_event_of_word(p, k):
    """The transition with whose letter the word of a return begins after one: the impact, where that is a release."""
    for j in range(len(p.contacts)):
        if p.releases[k] and p.contacts[j] >= 0 and p.target[j] == p.mode[k]:
            for i in range(len(p.impacts)):
                if p.impacts[i] == p.contacts[j]:
                    return i
    return k
