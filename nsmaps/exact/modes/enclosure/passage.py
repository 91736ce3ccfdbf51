"""Sets of states at starts and at events: conditions, resets, images."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import GROW
from nsmaps.exact.enclosure.images import LOWER, UPPER
from nsmaps.exact.enclosure.subdivide import SMALL, Progress, add_image, put_word
from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.modes.enclosure.events import copied
from nsmaps.exact.modes.enclosure.forms import (
    apply_row,
    features,
    finite,
    greatest,
    largest,
    least,
    linear,
    plain,
    radius,
    same,
    shave,
)
from nsmaps.exact.modes.enclosure.landing import FALLING, LOOSE
from nsmaps.exact.modes.march.returns import lengthened
from nsmaps.exact.modes.march.section import seen_before


@inlined
def image_of(p, a_set, code, n, w):
    """Unite the image that is a set at the section with those of its word; returns the number of images afterwards."""
    for c in range(len(p.places)):
        form = a_set[p.places[c]] if p.places[c] >= 0 else a_set[len(a_set) - 1]
        known = finite(form)
        w.box.side[c, LOWER], w.box.side[c, UPPER] = (least(form), greatest(form)) if known else (-math.inf, math.inf)
        straight = linear(form) + SMALL * SMALL * largest(form)
        w.excess[c] = max(w.excess[c], radius(form) / straight) if known else math.inf
    return add_image(w.box, n, code)


@inner
def conditioned(p, k, a_set, z, w):
    """Narrow a set with features z to where the conditions of a transition may hold: (whether they may, whether they do)."""
    surely = True
    for c in range(p.conditions[k], p.conditions[k + 1]):
        apply_row(p.where[c], z, w.late)
        if least(w.late) < 0.0:
            surely = False
            for i in range(len(w.box.spread)):
                w.box.spread[i] = abs(w.late[1 + i])
            if not shave(a_set, w.late, 0.0):
                return False, False
    return True, surely


@inlined
def exclude(p, a, b, z, form):
    """Whether two rows, one of which is negative and the other not positive, cannot be so together: a multiple of b cancels an
    entry of a, and their sum is nowhere negative.
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
    for k in range(q):
        form[k] = 0.0
    for j in range(len(a)):
        h = a[j] + share * b[j]
        for k in range(q - 1):
            form[k] += h * z[j, k]
            form[q - 1] += 1e-14 * (abs(a[j]) + abs(share * b[j])) * abs(z[j, k])
        form[q - 1] += abs(h) * z[j, q - 1]
    return least(form) > 0.0


@inner
def exhaustive(p, f, known, z, w):
    """Whether one of the two transitions of a function surely takes place."""
    if p.choices[f + 1] - p.choices[f] != 2:
        return False
    one, two, rate = p.chosen[p.choices[f]], p.chosen[p.choices[f] + 1], p.functions[f, 1]
    falls = known & FALLING != 0
    for i in range(p.conditions[one], p.conditions[one + 1]):
        apply_row(p.where[i], z, w.late)
        first = least(w.late) >= 0.0 or (falls and exclude(p, p.where[i], rate, z, w.late))
        for j in range(p.conditions[two], p.conditions[two + 1]):
            apply_row(p.where[j], z, w.late)
            second = least(w.late) >= 0.0 or (falls and exclude(p, p.where[j], rate, z, w.late))
            if not (first or second or exclude(p, p.where[i], p.where[j], z, w.late)):
                return False
    return True


@inner
def after_reset(p, k, a_set, w):
    """Take a set through the reset of a transition."""
    n = p.resets.shape[1]
    features(a_set, w.z, n)
    for i in range(n):
        apply_row(p.resets[k, i], w.z, a_set[i])


@inner
def may_repel(p, mode, a_set, w):
    """Whether some state of a set in a mode may lie on a surface from which both fields lead away: it has no image."""
    features(a_set, w.z, p.resets.shape[1])
    for s in range(len(p.surfaces)):
        apply_row(p.surfaces[s, 0], w.z, w.late)
        may = p.beside[s, mode] and least(w.late) <= 0.0 and greatest(w.late) >= 0.0
        for side in range(1, 3):
            apply_row(p.surfaces[s, side], w.z, w.late)
            may = may and greatest(w.late) > 0.0
        if may:
            return True
    return False


@inner
def take_event(p, hit, word, progress, w):
    """Follow an event through the transitions that may take place."""
    f, known, n = w.met[hit, 0], w.met[hit, 1], p.resets.shape[1]
    waiting, m, missing, smooth, settled, last = (
        progress.waiting,
        progress.images,
        False,
        known & LOOSE == 0,
        False,
        len(w.hits) - 1,
    )
    for place in range(p.choices[f], p.choices[f + 1]):
        k = p.chosen[place]
        if settled:
            break
        copied(w.hits[hit], w.hits[last])
        features(w.hits[hit], w.z, n)
        may, settled = conditioned(p, k, w.hits[last], w.z, w)
        if not may:
            continue
        smooth = smooth and settled
        code, place_value = lengthened(p.base, p.digit[k], word.code, word.place_value)
        if p.target[k] < 0:
            missing = True
            continue
        if p.after or not p.is_section[k]:
            after_reset(p, k, w.hits[last], w)
        if p.is_section[k]:
            m = image_of(p, w.hits[last], code, m, w)
            continue
        if waiting + 2 > len(w.parts):
            return Progress(-1, m, True, False)
        copied(w.hits[last], w.parts[waiting])
        w.kind[waiting, 0], w.kind[waiting, 1] = p.target[k], k
        w.kind[waiting, 2] = (known & FALLING) | (0 if smooth else LOOSE)
        put_word(w.box, waiting, code, place_value)
        waiting += 1
    if not settled:
        features(w.hits[hit], w.z, n)
        missing = missing or not exhaustive(p, f, known, w.z, w)
    return Progress(waiting, m, progress.missing or missing, progress.whole and smooth and settled)


@inner
def begun(p, b, cell, w):
    """Write the set of a cell at a start in the first place: (whether conditions of the start may hold, whether they do)."""
    n, a_set, state = p.resets.shape[1], w.parts[0], w.hits[0]
    for i in range(n + 1):
        plain(a_set[i], 0.0, 0.0)
    for c in range(len(p.places)):
        form, lower, upper = a_set[p.places[c] if p.places[c] >= 0 else n], cell[c, 0], cell[c, 1]
        form[0] = 0.5 * (lower + upper)
        form[1 + c] = max(form[0] - lower, upper - form[0]) * GROW
    features(a_set, w.z, n)
    for i in range(n):
        apply_row(p.states[b, i], w.z, state[i])
    same(a_set[n], state[n])
    copied(state, a_set)
    features(a_set, w.z, n)
    if not seen_before(p, p.starts[b]):
        return True, True
    return conditioned(p, p.starts[b], a_set, w.z, w)


@inner
def valid(p, b, w):
    """Narrow the set of a start, whose features are `w.z`, to where its function may fall: (whether it may, whether it does)."""
    if not seen_before(p, p.starts[b]):
        return True, True
    apply_row(p.functions[p.function[p.starts[b]], 1], w.z, w.late)
    if greatest(w.late) <= 0.0:
        return True, True
    for k in range(len(w.late) - 1):
        w.late[k] = -w.late[k]
    return shave(w.parts[0], w.late, 0.0), False
