"""Contact that lasts: whether it begins after an impact, and how words show it."""

import math

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.returns import TWO_PI, spell
from nsmaps.exact.modes.march.flight import dot, velocity
from nsmaps.exact.modes.march.section import allowed, enter
from nsmaps.exact.modes.tables.taylor import ROUNDING

SUMMED = 1e-8  # of a radian of the forcing: impacts that accumulate within it change a state by less than rounding
BASE_SUMMED = 1e-12  # of the speed gained in it: impacts at the section, of which each is a return, as those of impact systems
STEADY = 1e-5  # relative change of the pressure within impacts that accumulate
INSTANT = 1e-13  # of a turn of the forcing: a shorter contact is a release
CHATTER, REST = 1, 2


@inner
def contact_after(p, impact, mode, w):
    """The transition by which contact may begin after an impact, -1 for none."""
    for j in range(len(p.contacts)):
        if p.contacts[j] >= 0 and p.contacts[j] == p.impacts[impact] and p.mode[j] == mode and allowed(p, j, w.z)[0]:
            return j
    return -1


@inner
def approach(p, k, w):
    """The speed towards the surface of an impact, before its reset; infinite for other events."""
    for j in range(len(p.contacts)):
        if p.contacts[j] >= 0 and p.contacts[j] == p.impacts[k]:
            return -dot(p.begins[j, 0], w.z)[0]
    return math.inf


@inner
def mark_of(p, k, j, mode, before, w):
    """The mark of the contact that begins at a state just after an impact: 0 for none, `CHATTER` or `REST`.

    The impacts accumulate after x = 2 u/(a (1 - r)), with their last speed u and the pressure a. Contact from the impact on, with
    all speed towards the surface lost, has the same impulse by then; states differ by u x, which `SUMMED` keeps below rounding.
    """
    after, size = dot(p.begins[j, 0], w.z)
    press, sizes = dot(p.begins[j, 1], w.z)
    if after <= ROUNDING * size:
        return REST if press > -4.0 * ROUNDING * sizes else 0  # just released: contact that ends at once
    if not (press > 0.0 and after < before):
        return 0
    unit = 1.0 / p.rate if p.rate > 0.0 else p.steps[mode]
    x = 2.0 * after / (press * (1.0 - after / before))
    velocity(p, mode, w.z, w.field)
    steady = x * abs(dot(p.begins[j, 1], w.field)[0]) <= STEADY * press * p.steps[mode]
    slow = before <= BASE_SUMMED * press * unit if p.is_section[k] and not p.after else x <= SUMMED * unit
    return CHATTER if steady and slow else 0


@inner
def entered(p, k, with_reset, phi, w):
    """As `enter`, into lasting contact where it begins."""
    before = approach(p, k, w) if with_reset else 0.0
    mode = enter(p, k, with_reset, phi, w)
    j = contact_after(p, k, mode, w) if p.impacts[k] >= 0 else -1
    mark = mark_of(p, k, j, mode, before, w) if j >= 0 else 0
    if mark > 0:
        w.held[0], w.held[1] = 0.0, mark
        return enter(p, j, True, phi, w)
    return mode


@inner
def marked(p, code, power, w):
    """The word with the mark of a contact that ends, the row of impacts before it as one; whether the contact had a duration."""
    unit = TWO_PI / p.rate if p.rate > 0.0 else p.steps[0]
    if w.held[1] == 0.0 or w.held[0] <= INSTANT * unit:
        w.held[1] = 0.0
        return code, power, False
    margins, mark = not math.isnan(w.near[0]), p.base - 3 + int(w.held[1])
    if w.held[1] == CHATTER and not margins and w.row[0] > 0:
        code, power = w.row[1], w.row[2]
    w.held[1], w.row[0] = 0.0, 0
    code, power = spell(code, power, p.base + 2 if margins else p.base, mark, 1)
    return code, power, True


@inner
def in_a_row(digit, code, power, w):
    """Take note of a letter that was written."""
    if digit > 0 and digit != w.row[0]:
        w.row[0], w.row[1], w.row[2] = digit, code, power
