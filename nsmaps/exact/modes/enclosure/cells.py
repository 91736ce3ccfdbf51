"""Images of cells of states of a system with modes, as affine forms."""

import math

from nsmaps.exact.enclosure.subdivide import FIRST, MOST_PARTS, SLACK, SetFlight, all_finite, enclose_boxes, follow_sets, put_word
from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.modes.enclosure.events import FALLING, STARTED, first_events
from nsmaps.exact.modes.enclosure.flow import span
from nsmaps.exact.modes.enclosure.forms import (
    BEYOND,
    CENTRE,
    WITHIN,
    apply_row,
    copy_set,
    lower_bound,
    magnitude,
    radius,
    upper_bound,
)
from nsmaps.exact.modes.enclosure.memory import BEHIND, KNOWN, MODE
from nsmaps.exact.modes.enclosure.passage import apply_reset, fall_at_start, may_repel, put_start, take_event
from nsmaps.exact.modes.enclosure.tables import RATE, VALUE
from nsmaps.exact.modes.march.words import append_letter
from nsmaps.exact.modes.tables.taylor import AT_ONCE

STEP = 4.0  # a longest step is at least a cell, and shorter than so many
IN_FLIGHT = MOST_PARTS  # place of the set in flight, behind those that wait
MOST_BELOW = 1_000_000  # functions below zero at a start


@inner
def distance(p, b, w):
    """Bounds on how far the states of a set are from a start, as `away` of `march/section.py`; its features are `w.z`."""
    nearest, farthest, k = 0.0, 0.0, p.table.starts[b]
    mode = p.table.mode[k]
    for f in span(p.table.watched, mode):
        row, rate = p.functions[f, VALUE], w.rows[RATE]
        apply_row(row, w.z, w.delay)
        large, small = 0.0, 0.0
        for j in range(len(row)):
            large += abs(row[j]) * magnitude(w.z[j])
            small += abs(row[j]) * max(abs(w.z[j, CENTRE]) - radius(w.z[j]), 0.0)
        own = f == p.table.function[k]
        apply_row(p.functions[f, RATE], w.z, rate)
        large += STEP * magnitude(rate)
        small += max(abs(rate[CENTRE]) - radius(rate), 0.0)
        low_wrong = max(lower_bound(w.delay), -upper_bound(w.delay)) if own else -upper_bound(w.delay)
        high_wrong = magnitude(w.delay) if own else -lower_bound(w.delay)
        if low_wrong > 0.0:
            nearest = max(nearest, low_wrong / large * WITHIN)
        if high_wrong > 0.0:
            farthest = max(farthest, high_wrong / small * BEYOND)
    return nearest, farthest


@inner
def survey_starts(p, cell, w):
    """The least of the distances within which some start of all states of a cell certainly is, and of the bounds of `most_below`.

    These are of the starts where all states certainly are, and fall.
    """
    bound, fewest = math.inf, MOST_BELOW
    for b in range(len(p.table.starts)):
        _, sure = put_start(p, b, cell, w)
        _, far = distance(p, b, w)
        bound = far if sure and far < bound else bound
        if sure and far <= AT_ONCE:
            count = most_below(p, b, w)
            _, falls = fall_at_start(p, b, w)
            fewest = min(fewest, count) if falls else fewest
    return bound + AT_ONCE, fewest


@inner
def most_below(p, b, w):
    """A bound on how many functions are below zero at a start, as `below_after` of `march/section.py`; its features are `w.z`."""
    mode = p.table.mode[p.table.starts[b]]
    count = p.table.below[mode]
    for f in span(p.table.watched, mode):
        apply_row(p.functions[f, VALUE], w.z, w.delay)
        if f != p.table.function[p.table.starts[b]] and lower_bound(w.delay) <= AT_ONCE * magnitude(w.delay):
            count += 1
    return count


@inner
def first_events_of(p, part, w):
    """All possible first events of a set that waits, which is copied: sets that wait later take its place."""
    copy_set(w.parts[part], w.parts[IN_FLIGHT])
    for c in range(w.kind.shape[1]):
        w.kind[IN_FLIGHT, c] = w.kind[part, c]
    repelled = may_repel(p, w.kind[IN_FLIGHT, MODE], w.parts[IN_FLIGHT], w)
    flight = first_events(p, IN_FLIGHT, w)
    return SetFlight(flight.ended, flight.events, repelled or flight.missing)


@inner
def start_images(p, b, number, w):
    """The images of the set of a start in the first place, beyond so many: see `follow_sets`."""
    k = p.table.starts[b]
    if not p.table.after:
        apply_reset(p, k, w.parts[FIRST], w)
    w.kind[FIRST, MODE], w.kind[FIRST, BEHIND] = p.table.target[k], b
    w.kind[FIRST, KNOWN] = STARTED | (0 if p.table.after else FALLING)
    code, place_value = append_letter(p.table.base, p.table.digit[k], 0, 1)
    put_word(w.box, FIRST, code, place_value)
    return follow_sets(p, number, w, first_events_of, take_event)


@inner
def cell_images(p, k, w):
    """The images of a cell."""
    cell, number, bounded, missing, whole, used, sure_start = w.box.cells[k], 0, True, False, True, 0, False
    w.excess[:] = 0.0
    w.box.spread[:] = 0.0
    several = len(p.table.starts) > 1
    reach, fewest = survey_starts(p, cell, w) if several else (math.inf, MOST_BELOW)
    for b in range(len(p.table.starts)):
        may, surely = put_start(p, b, cell, w)
        near, _ = distance(p, b, w) if several else (0.0, 0.0)
        if not may or (several and (near > reach or p.table.below[p.table.mode[p.table.starts[b]]] > fewest)):
            continue
        may, falls = fall_at_start(p, b, w)
        sure_start = sure_start or (surely and falls)
        if may:
            used += 1
            found, each = start_images(p, b, number, w)
            number, bounded = found.images, bounded and each
            missing, whole = missing or found.missing, whole and found.whole
    missing = missing or number == 0 or not sure_start
    loose = missing or not whole or used > 1 or number != 1
    for c in range(len(w.excess)):
        loose = loose or w.excess[c] > SLACK
    return number, bounded and all_finite(w.box.images, number), missing, loose


@long_entry
def all_box_images(p, w, boxes, rows):
    """Write the images of boxes of shape (N, m, 2): see `enclose_boxes`."""
    return enclose_boxes(p, boxes, rows, w, cell_images)
