"""Sets of states at starts and at events: conditions, resets, images."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import GROW, ZERO
from nsmaps.exact.enclosure.images import LOWER, UPPER
from nsmaps.exact.enclosure.subdivide import FIRST, SMALL, Progress, put_word, unite_image
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.modes.enclosure.events import FALLING, LOOSE, put_spread
from nsmaps.exact.modes.enclosure.flow import span
from nsmaps.exact.modes.enclosure.forms import (
    CENTRE,
    PHASE,
    REMAINDER,
    ROUNDED,
    SYMBOLS,
    apply_row,
    copy_form,
    copy_set,
    lower_bound,
    magnitude,
    put_features,
    put_plain,
    radius,
    shave,
    upper_bound,
)
from nsmaps.exact.modes.enclosure.memory import BEHIND, EVENT_FUNCTION, EVENT_KNOWN, KNOWN, MODE
from nsmaps.exact.modes.enclosure.tables import RATE
from nsmaps.exact.modes.march.section import seen_before
from nsmaps.exact.modes.march.words import append_letter

FUNCTION, ABOVE, BELOW = range(3)  #: rows of a surface of sliding: its function, and the rates of that on either side


@inlined
def image_of(p, a_set, code, n, w):
    """Unite the image that is a set at the section with those of its word; returns the number of images afterwards."""
    for c in range(len(p.table.places)):
        form = a_set[p.table.places[c]] if p.table.places[c] >= 0 else a_set[PHASE]
        known = math.isfinite(form[CENTRE]) and math.isfinite(radius(form))
        w.box.side[c, LOWER], w.box.side[c, UPPER] = (lower_bound(form), upper_bound(form)) if known else (-math.inf, math.inf)
        straight = radius(form) - form[REMAINDER] + SMALL * SMALL * magnitude(form)
        w.excess[c] = max(w.excess[c], radius(form) / straight) if known else math.inf
    return unite_image(w.box.codes, w.box.images, n, code, w.box.side)


@inner
def meet_conditions(p, k, a_set, z, w):
    """Narrow a set with features z to where the conditions of a transition may hold: (whether they may, whether they do)."""
    surely = True
    for c in span(p.table.conditions, k):
        apply_row(p.table.where[c], z, w.delay)
        if lower_bound(w.delay) < 0.0:
            surely = False
            put_spread(w.delay, w)
            if not shave(a_set, w.delay, 0.0):
                return False, False
    return True, surely


@inlined
def exclude(a, b, z, form):
    """Whether two rows, one of them negative and the other not positive, exclude each other.

    They do where a multiple of b cancels an entry of a and their sum is nowhere negative.
    """
    lead = 0
    for j in range(len(b)):
        if abs(b[j]) > abs(b[lead]):
            lead = j
    share = -a[lead] / b[lead] if b[lead] != 0.0 else 0.0
    if not share > 0.0:
        return False
    gone, q = True, len(form)
    for j in range(len(a)):
        gone = gone and a[j] + share * b[j] == 0.0
    if gone:
        return True
    put_plain(form, ZERO)
    for j in range(len(a)):
        h = a[j] + share * b[j]
        for k in range(q - 1):
            form[k] += h * z[j, k]
            form[REMAINDER] += ROUNDED * (abs(a[j]) + abs(share * b[j])) * abs(z[j, k])
        form[REMAINDER] += abs(h) * z[j, REMAINDER]
    return lower_bound(form) > 0.0


@inner
def is_exhaustive(p, f, known, z, w):
    """Whether one of the two transitions of a function surely takes place."""
    if len(span(p.table.choices, f)) != 2:
        return False
    first_place, rate = p.table.choices[f], p.functions[f, RATE]
    second_place = first_place + 1
    one, two = p.table.chosen[first_place], p.table.chosen[second_place]
    falls = known & FALLING != 0
    for i in span(p.table.conditions, one):
        apply_row(p.table.where[i], z, w.delay)
        first = lower_bound(w.delay) >= 0.0 or (falls and exclude(p.table.where[i], rate, z, w.delay))
        for j in span(p.table.conditions, two):
            apply_row(p.table.where[j], z, w.delay)
            second = lower_bound(w.delay) >= 0.0 or (falls and exclude(p.table.where[j], rate, z, w.delay))
            if not (first or second or exclude(p.table.where[i], p.table.where[j], z, w.delay)):
                return False
    return True


@inner
def apply_reset(p, k, a_set, w):
    """Take a set through the reset of a transition."""
    n = p.table.resets.shape[1]
    put_features(a_set, w.z, n)
    for i in range(n):
        apply_row(p.table.resets[k, i], w.z, a_set[i])


@inner
def may_repel(p, mode, a_set, w):
    """Whether some state of a set in a mode may lie on a surface from which both fields lead away: it has no image."""
    put_features(a_set, w.z, p.table.resets.shape[1])
    for s in range(len(p.table.surfaces)):
        apply_row(p.table.surfaces[s, FUNCTION], w.z, w.delay)
        may = p.table.beside[s, mode] and lower_bound(w.delay) <= 0.0 and upper_bound(w.delay) >= 0.0
        for side in (ABOVE, BELOW):
            apply_row(p.table.surfaces[s, side], w.z, w.delay)
            may = may and upper_bound(w.delay) > 0.0
        if may:
            return True
    return False


@inner
def take_event(p, hit, word, progress, w):
    """Follow an event through the transitions that may take place."""
    f, known, n = w.events[hit, EVENT_FUNCTION], w.events[hit, EVENT_KNOWN], p.table.resets.shape[1]
    waiting, m, missing, smooth, settled, last = (
        progress.waiting,
        progress.images,
        False,
        known & LOOSE == 0,
        False,
        len(w.hits) - 1,
    )
    for place in span(p.table.choices, f):
        k = p.table.chosen[place]
        if settled:
            break
        copy_set(w.hits[hit], w.hits[last])
        put_features(w.hits[hit], w.z, n)
        may, settled = meet_conditions(p, k, w.hits[last], w.z, w)
        if not may:
            continue
        smooth = smooth and settled
        code, place_value = append_letter(p.table.base, p.table.digit[k], *word)
        if p.table.target[k] < 0:
            missing = True
            continue
        if p.table.after or not p.table.is_section[k]:
            apply_reset(p, k, w.hits[last], w)
        if p.table.is_section[k]:
            m = image_of(p, w.hits[last], code, m, w)
            continue
        if waiting + 2 > len(w.parts):
            return Progress(-1, m, True, False)
        copy_set(w.hits[last], w.parts[waiting])
        w.kind[waiting, MODE], w.kind[waiting, BEHIND] = p.table.target[k], k
        w.kind[waiting, KNOWN] = (known & FALLING) | (0 if smooth else LOOSE)
        put_word(w.box, waiting, code, place_value)
        waiting += 1
    if not settled:
        put_features(w.hits[hit], w.z, n)
        missing = missing or not is_exhaustive(p, f, known, w.z, w)
    return Progress(waiting, m, progress.missing or missing, progress.whole and smooth and settled)


@inner
def put_start(p, b, cell, w):
    """Write the set of a cell at a start in the first place: (whether conditions of the start may hold, whether they do)."""
    n, a_set, state = p.table.resets.shape[1], w.parts[FIRST], w.hits[FIRST]
    for i in range(n + 1):
        put_plain(a_set[i], ZERO)
    for c in range(len(p.table.places)):
        form, lower, upper = a_set[p.table.places[c] if p.table.places[c] >= 0 else n], cell[c, LOWER], cell[c, UPPER]
        form[CENTRE] = 0.5 * (lower + upper)
        form[SYMBOLS + c] = max(form[CENTRE] - lower, upper - form[CENTRE]) * GROW
    put_features(a_set, w.z, n)
    for i in range(n):
        apply_row(p.table.states[b, i], w.z, state[i])
    copy_form(a_set[n], state[n])
    copy_set(state, a_set)
    put_features(a_set, w.z, n)
    if not seen_before(p.table, p.table.starts[b]):
        return True, True
    return meet_conditions(p, p.table.starts[b], a_set, w.z, w)


@inner
def fall_at_start(p, b, w):
    """Narrow the set of a start, whose features are `w.z`, to where its function may fall: (whether it may, whether it does)."""
    if not seen_before(p.table, p.table.starts[b]):
        return True, True
    rate = w.delay
    apply_row(p.functions[p.table.function[p.table.starts[b]], RATE], w.z, rate)
    if upper_bound(rate) <= 0.0:
        return True, True
    for k in range(len(rate) - 1):
        rate[k] = -rate[k]
    return shave(w.parts[FIRST], rate, 0.0), False
