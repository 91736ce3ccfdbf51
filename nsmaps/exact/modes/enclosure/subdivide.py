"""Images of boxes of states, which are subdivided into cells where that tightens them."""

import math

from nsmaps.exact.enclosure.arithmetic.balls import badd, high, low, reduced
from nsmaps.exact.engine.jit import inner, long_entry
from nsmaps.exact.modes.enclosure.events import GONE, LANDED, copied, first_events
from nsmaps.exact.modes.enclosure.forms import apply_row, greatest, largest, least, radius
from nsmaps.exact.modes.enclosure.landing import FALLING, STARTED
from nsmaps.exact.modes.enclosure.passage import SMALL, after_reset, begun, happened, may_repel, valid
from nsmaps.exact.modes.march.returns import lengthened
from nsmaps.exact.modes.march.section import AS_NEAR

MOST_CELLS = 16  # cells of a box and their halves, to tighten its images
STEP = 4.0  # a longest step is at least a cell, and shorter than so many
MOST_BELOW = 1_000_000  # functions below zero at a start
MOST_FLIGHTS = 96  # flights of the sets of one cell
SLACK = 1.25  # width of an image over its linear part, above which cells are cut


@inner
def distance(p, b, w):
    """Bounds on how far the states of a set are from a start, as `away` of `march/section.py`; its features are `w.z`."""
    nearest, farthest, k = 0.0, 0.0, p.starts[b]
    mode = p.mode[k]
    for f in range(p.watched[mode], p.watched[mode + 1]):
        row = p.functions[f, 0]
        apply_row(row, w.z, w.late)
        large, small = 0.0, 0.0
        for j in range(len(row)):
            large += abs(row[j]) * largest(w.z[j])
            small += abs(row[j]) * max(abs(w.z[j, 0]) - radius(w.z[j]), 0.0)
        own = f == p.function[k]
        apply_row(p.functions[f, 1], w.z, w.rows[0])
        large += STEP * largest(w.rows[0])
        small += max(abs(w.rows[0, 0]) - radius(w.rows[0]), 0.0)
        low_wrong = max(least(w.late), -greatest(w.late)) if own else -greatest(w.late)
        high_wrong = largest(w.late) if own else -least(w.late)
        if low_wrong > 0.0:
            nearest = max(nearest, low_wrong / large * (1.0 - 1e-14))
        if high_wrong > 0.0:
            farthest = max(farthest, high_wrong / small * (1.0 + 1e-14))
    return nearest, farthest


@inner
def nearest_start(p, cell, w):
    """The least of the distances within which some start of all states of a cell certainly is."""
    bound = math.inf
    for b in range(len(p.starts)):
        _, sure = begun(p, b, cell, w)
        far = distance(p, b, w)[1]
        if sure and far < bound:
            bound = far
    return bound + AS_NEAR


@inner
def most_below(p, b, w):
    """A bound on how many functions are below zero at a start, as `below_after` of `march/section.py`; its features are `w.z`."""
    mode = p.mode[p.starts[b]]
    count = p.below[mode]
    for f in range(p.watched[mode], p.watched[mode + 1]):
        apply_row(p.functions[f, 0], w.z, w.late)
        if f != p.function[p.starts[b]] and least(w.late) <= AS_NEAR * largest(w.late):
            count += 1
    return count


@inner
def fewest_below(p, cell, w):
    """The least of these bounds at starts where all states of a cell certainly are, and fall."""
    fewest = MOST_BELOW
    for b in range(len(p.starts)):
        _, sure = begun(p, b, cell, w)
        if sure and distance(p, b, w)[1] <= AS_NEAR:
            count = most_below(p, b, w)
            if valid(p, b, w)[1]:
                fewest = min(fewest, count)
    return fewest


@inner
def followed(p, b, m, w):
    """The images of the set of a start in the first place: (images with those before, whether all are bounded, whether some state
    may have none, whether no graze cuts it).
    """
    waiting, empty, smooth, here, k = 1, False, True, len(w.parts) - 1, p.starts[b]
    if not p.after:
        after_reset(p, k, w.parts[0], w)
    w.kind[0, 0], w.kind[0, 1], w.kind[0, 2] = p.target[k], b, STARTED | (0 if p.after else FALLING)
    w.names[0, 0], w.names[0, 1] = lengthened(p.base, p.digit[k], 0, 1)
    for _ in range(MOST_FLIGHTS):
        if waiting == 0:
            return m, True, empty, smooth
        waiting -= 1
        copied(w.parts[waiting], w.parts[here])
        for c in range(3):
            w.kind[here, c] = w.kind[waiting, c]
        empty = empty or may_repel(p, w.kind[here, 0], w.parts[here], w)
        code, power = w.names[waiting, 0], w.names[waiting, 1]
        ended, number = first_events(p, w.kind[here, 0], here, w)
        lost = ended == LANDED and number == 0 and w.kind[here, 2] & STARTED != 0
        if ended != LANDED or lost:
            empty = True
            if ended != GONE:
                return m, False, True, False
        for hit in range(number):
            waiting, m, without, as_one = happened(p, hit, waiting, code, power, m, w)
            empty, smooth = empty or without, smooth and as_one
            if waiting < 0:
                return m, False, True, False
    return m, waiting == 0, empty, smooth


@inner
def cell_images(p, cell, w):
    """The images of one cell: (number, whether all are bounded, whether some state may have none, whether no graze cuts it)."""
    m, bounded, empty, smooth, used, sure_start = 0, True, False, True, 0, False
    w.excess[0] = 0.0
    for c in range(len(w.by)):
        w.by[c] = 0.0
    several = len(p.starts) > 1
    reach, fewest = (nearest_start(p, cell, w), fewest_below(p, cell, w)) if several else (math.inf, MOST_BELOW)
    for b in range(len(p.starts)):
        may, surely = begun(p, b, cell, w)
        if not may or (several and (distance(p, b, w)[0] > reach or p.below[p.mode[p.starts[b]]] > fewest)):
            continue
        may, falls = valid(p, b, w)
        sure_start = sure_start or (surely and falls)
        if may:
            used += 1
            m, each, without, as_one = followed(p, b, m, w)
            bounded, empty, smooth = bounded and each, empty or without, smooth and as_one
    for k in range(m):
        for c in range(len(p.places)):
            bounded = bounded and w.images[k, c, 0] > -math.inf and w.images[k, c, 1] < math.inf
    return m, bounded, empty or m == 0 or not sure_start, smooth and used <= 1


@inner
def cut(cells, k, last, by):
    """Add the halves of cell k after the last cell, cut across the coordinate of which most depends; whether it may be cut."""
    best, greatest_share = -1, -1.0
    for c in range(cells.shape[1]):
        width, place = cells[k, c, 1] - cells[k, c, 0], max(abs(cells[k, c, 0]), abs(cells[k, c, 1]))
        if width > 2.0 * SMALL * place and by[c] > greatest_share:
            best, greatest_share = c, by[c]
    if best < 0:
        return False
    middle = 0.5 * (cells[k, best, 0] + cells[k, best, 1])
    for c in range(cells.shape[1]):
        for end in range(2):
            cells[last, c, end] = cells[last + 1, c, end] = cells[k, c, end]
    cells[last, best, 1], cells[last + 1, best, 0] = middle, middle
    return True


@inner
def unite(w, n, codes, images, m):
    """Unite the images of a cell with those of its box; returns their number."""
    for i in range(n):
        k = 0
        while k < m and codes[k] != w.codes[i]:
            k += 1
        if k == len(codes):
            k -= 1
            codes[k] = 0
        for c in range(images.shape[1]):
            if k == m:
                images[k, c, 0], images[k, c, 1] = w.images[i, c, 0], w.images[i, c, 1]
            else:
                images[k, c, 0] = min(images[k, c, 0], w.images[i, c, 0])
                images[k, c, 1] = max(images[k, c, 1], w.images[i, c, 1])
        if k == m:
            codes[k] = w.codes[i]
            m += 1
    return m


@inner
def box_images(p, w, codes, images):
    """The images of the box in the first cell, subdivided where that helps: (number, whether all are bounded, whether some state
    may have none).
    """
    m, last, empty, k = 0, 1, False, 0
    while k < last:
        n, bounded, without, smooth = cell_images(p, w.cells[k], w)
        loose = without or not smooth or n != 1 or w.excess[0] > SLACK
        limit = MOST_CELLS if bounded and not without else len(w.cells)
        if (loose or not bounded) and last + 2 <= limit and cut(w.cells, k, last, w.by):
            last += 2
        elif not bounded:
            return 0, False, True
        else:
            empty = empty or without
            m = unite(w, n, codes, images, m)
        k += 1
    return m, True, empty


@long_entry
def all_box_images(p, w, boxes, codes, images, numbers, empty, bounded):
    """The images of boxes of shape (N, m, 2), written in order into `codes` and `images`; returns their number."""
    total, room = 0, len(w.codes)
    for i in range(len(boxes)):
        turns = (0.0, 0.0)
        for c in range(len(p.places)):
            w.cells[0, c, 0], w.cells[0, c, 1] = boxes[i, c, 0], boxes[i, c, 1]
            if p.places[c] < 0:
                _, turns = reduced((0.5 * (boxes[i, c, 0] + boxes[i, c, 1]), 0.0))
                w.cells[0, c, 0] = low(badd((boxes[i, c, 0], 0.0), (-turns[0], turns[1])))
                w.cells[0, c, 1] = high(badd((boxes[i, c, 1], 0.0), (-turns[0], turns[1])))
        numbers[i], bounded[i], empty[i] = box_images(p, w, codes[total : total + room], images[total : total + room])
        if not bounded[i]:
            numbers[i], codes[total] = 1, 0
        for k in range(total, total + numbers[i]):
            for c in range(len(p.places)):
                if not bounded[i]:
                    images[k, c, 0], images[k, c, 1] = -math.inf, math.inf
                elif p.places[c] < 0:
                    images[k, c, 0] = low(badd((images[k, c, 0], 0.0), turns))
                    images[k, c, 1] = high(badd((images[k, c, 1], 0.0), turns))
        total += numbers[i]
    return total
