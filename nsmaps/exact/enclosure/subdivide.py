"""Images of boxes of states, which are subdivided into cells where that tightens them."""

import math

import numpy as np

from nsmaps.exact.enclosure.arithmetic.balls import badd, between, high, low, reduced, size
from nsmaps.exact.enclosure.encounters import GONE, LANDED, first_impacts
from nsmaps.exact.enclosure.taylor_set import ROW, SMOOTH, UPPER, box_of, box_set, get_set, put_set
from nsmaps.exact.engine.flight.flow import walls_of
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.returns import spell

MOST_IMAGES = 16  #: words distinguished in one box
MOST_CELLS = 16  #: cells of a box and their halves, to tighten its images
ALL_CELLS = 32  #: the same, to bound them
MOST_PARTS = 64  #: Taylor sets of one cell in flight at a time
MOST_FLIGHTS = 64  #: impacts of the sets of one cell
MOST_HITS = 48  #: impacts of one flight of a set
LOOSE, SLACK = 1.1, 1.25  #: width of an image over its linear part, above which corners are used, cells cut
SMALL = 1e-9  #: half sides that are not subdivided, of a speed (relative) and in radians


@inner
def add_image(codes, images, n, code, v_low, v_high, phi_low, phi_high):
    """Unite an image with those of its word; returns the number of images afterwards."""
    k = 0
    while k < n and codes[k] != code:
        k += 1
    if k == len(codes):  # too many words: the last image has several
        k -= 1
        codes[k] = 0
    if k == n:
        codes[k] = code
        images[k, 0], images[k, 1], images[k, 2], images[k, 3] = v_low, v_high, phi_low, phi_high
        return n + 1
    images[k, 0], images[k, 1] = min(images[k, 0], v_low), max(images[k, 1], v_high)
    images[k, 2], images[k, 3] = min(images[k, 2], phi_low), max(images[k, 3], phi_high)
    return n


@inner
def cell_images(p, v, phi, tables):
    """The images of one cell, in the tables: (number, True if all are bounded, True if some state may have none, True if all are
    smooth, spread).

    The map is smooth where no grazing curve crosses the cell. A cell with one smooth image has it in the first row of `hits`.
    """
    parts, names, hits, codes, images, _ = tables
    has_up, has_down, base_up = walls_of(p)
    base = 5 if has_up and has_down else 4  # number of codes, as in `first_return`
    put_set(parts[0], base_up, box_set(v, phi), True)
    names[0, 0], names[0, 1] = spell(0, 1, base, 1, 1)
    waiting, m = 1, 0
    empty, bounded, smooth, by = False, True, True, (v[1], phi[1])
    for flights in range(MOST_FLIGHTS):
        if waiting == 0:
            break
        waiting -= 1
        code, power = names[waiting, 0], names[waiting, 1]
        ended, n, spread_by = first_impacts(p, parts[waiting, UPPER] > 0.0, parts[waiting], hits)
        if ended != LANDED:
            empty, bounded = True, bounded and ended == GONE
        if flights == 0:
            by = spread_by
        if waiting + n > len(parts) or power == 0:
            return m, False, True, False, by
        for k in range(n):
            upper = hits[k, UPPER] > 0.0
            on_base = upper == base_up
            more, next_power = spell(code, power, base, 1 if on_base else 2, 1)
            smooth = smooth and hits[k, SMOOTH] > 0.0
            if on_base:
                v, phi = box_of(hits[k])
                m = add_image(codes, images, m, more, max(low(v), 0.0), high(v), low(phi), high(phi))
            else:
                names[waiting, 0], names[waiting, 1] = more, next_power
                for c in range(ROW):
                    parts[waiting, c] = hits[k, c]
                waiting += 1
    return m, bounded and waiting == 0 and all_finite(images, m), empty or waiting > 0, smooth, by


@inner
def sharpened(p, cell, tables, widest):
    """Tighten the one image of a cell where the map is monotone: (True if it is still loose, its spread by each coordinate).

    A component whose derivatives have no zero in the cell takes its extrema at corners.
    """
    _, _, hits, codes, images, _ = tables
    _, _, one, d, _, r, v, phi = get_set(hits[0])
    code, ends, loose = codes[0], tables[5], False
    for k in range(4):
        ends[k] = images[0, k]
    for row in range(2):
        a, b = d[2 * row], d[2 * row + 1]
        linear = abs(one[2 * row][0]) * r[0] + abs(one[2 * row + 1][0]) * r[1] + SMALL * SMALL * (1.0 if row else size(v))
        wide = (phi[1] if row else v[1]) / linear
        if not wide > widest:
            continue
        if not (abs(a[0]) > a[1] and abs(b[0]) > b[1]):
            loose = loose or wide > SLACK
            continue
        for end in range(2):
            corner = (cell[end if a[0] > 0.0 else 1 - end], 0.0), (cell[2 + (end if b[0] > 0.0 else 1 - end)], 0.0)
            n, bounded, _, smooth, _ = cell_images(p, corner[0], corner[1], tables)
            if n == 1 and bounded and smooth:
                k = 2 * row + end
                ends[k] = max(ends[k], images[0, k]) if end == 0 else min(ends[k], images[0, k])
            else:
                loose = True
    codes[0] = code
    for k in range(4):
        images[0, k] = ends[k]
    return loose, ((size(d[0]) + size(d[2])) * r[0], (size(d[1]) + size(d[3])) * r[1])


@inner
def all_finite(images, n):
    """True if the first n images are finite boxes."""
    for k in range(n):
        for c in range(0, 4, 2):
            if not (images[k, c] <= images[k, c + 1] and images[k, c] > -math.inf and images[k, c + 1] < math.inf):
                return False
    return True


@inner
def cut(cells, k, last, first):
    """Add the halves of cell k after the last cell."""
    c = 0 if first else 2
    middle = 0.5 * (cells[k, c] + cells[k, c + 1])
    for i in range(4):
        cells[last, i] = cells[last + 1, i] = cells[k, i]
    cells[last, c + 1], cells[last + 1, c] = middle, middle


@inner
def box_images(p, cells, tables, codes, images):
    """The images of the box in the first cell, subdivided where that helps: (number, True if all are bounded, True if some state
    may have none).
    """
    m, last, empty, k = 0, 1, False, 0
    while k < last:
        v, phi = between(cells[k, 0], cells[k, 1]), between(cells[k, 2], cells[k, 3])
        n, bounded, without, smooth, by = cell_images(p, v, phi, tables)
        loose = without or not smooth
        if n == 1 and bounded and not loose:
            loose, by = sharpened(p, cells[k], tables, SLACK if k > 0 else LOOSE)
        max_cells = MOST_CELLS if bounded and not without else len(cells)
        if loose and last + 2 <= max_cells and (v[1] > SMALL * v[0] or phi[1] > SMALL):
            cut(cells, k, last, (by[0] >= by[1] and v[1] > 0.0) or phi[1] == 0.0)
            last += 2
        elif not bounded:
            return 0, False, True
        else:
            empty = empty or without
            for i in range(n):
                image = tables[4][i]
                m = add_image(codes, images, m, tables[3][i], image[0], image[1], image[2], image[3])
        k += 1
    return m, True, empty


@entry
def all_box_images(p, boxes, codes, images, numbers, empty, bounded):
    """The images of boxes of shape (N, 2, 2), written in order into `codes` and `images`; returns their number."""
    cells, found = np.empty((ALL_CELLS, 4)), np.empty((MOST_IMAGES, 4))
    tables = (
        np.empty((MOST_PARTS, ROW)),
        np.empty((MOST_PARTS, 2), np.int64),
        np.empty((MOST_HITS, ROW)),
        np.empty(MOST_IMAGES, np.int64),
        np.empty((MOST_IMAGES, 4)),
        np.empty(4),
    )
    m = 0
    for i in range(len(boxes)):
        _, turns = reduced((0.5 * (boxes[i, 1, 0] + boxes[i, 1, 1]), 0.0))
        cells[0, 0], cells[0, 1] = boxes[i, 0, 0], boxes[i, 0, 1]
        cells[0, 2] = low(badd((boxes[i, 1, 0], 0.0), (-turns[0], turns[1])))
        cells[0, 3] = high(badd((boxes[i, 1, 1], 0.0), (-turns[0], turns[1])))
        numbers[i], bounded[i], empty[i] = box_images(p, cells, tables, codes[m : m + MOST_IMAGES], found)
        if not bounded[i]:
            numbers[i], codes[m] = 1, 0
            found[0, 0] = found[0, 2] = -math.inf
            found[0, 1] = found[0, 3] = math.inf
        for k in range(numbers[i]):
            images[m, 0, 0], images[m, 0, 1] = found[k, 0], found[k, 1]
            images[m, 1, 0] = low(badd((found[k, 2], 0.0), turns)) if bounded[i] else found[k, 2]
            images[m, 1, 1] = high(badd((found[k, 3], 0.0), turns)) if bounded[i] else found[k, 3]
            m += 1
    return m
