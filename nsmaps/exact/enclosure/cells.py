"""Images of cells of states of an impact system, as Taylor sets."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.enclosure.arithmetic.balls import between, high, low, size
from nsmaps.exact.enclosure.encounters import first_impacts
from nsmaps.exact.enclosure.subdivide import (
    FIRST,
    LOWER,
    MOST_HITS,
    MOST_PARTS,
    SLACK,
    SMALL,
    UPPER,
    BoxMemory,
    CellImages,
    Progress,
    add_image,
    all_finite,
    box_memory,
    enclose_boxes,
    follow_sets,
    put_word,
)
from nsmaps.exact.enclosure.taylor_set import ON_TOP, ROW, SMOOTH, box_of, box_set, get_set, put_set
from nsmaps.exact.engine.flight.flow import on_top, walls_of
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.returns import PHASE, SPEED, append_symbol

LOOSE = 1.1  #: width of the image of a whole box over its linear part, above which corners are used
BASE_LETTER, OTHER_LETTER = 1, 2  #: digits of the walls in words


@by_address
class SetMemory(NamedTuple):
    """Workspace for the Taylor sets of one thread."""

    box: BoxMemory
    parts: Any  #: shape (MOST_PARTS, ROW), sets that wait
    hits: Any  #: shape (MOST_HITS, ROW), sets at impacts
    ends: Any  #: shape (2, 2), a tightened image


def set_memory() -> SetMemory:
    """A workspace."""
    return SetMemory(box_memory(2, PHASE), np.empty((MOST_PARTS, ROW)), np.empty((MOST_HITS, ROW)), np.empty((2, 2)))


@inner
def word_base(p):
    """The base of codes of words, as in `first_return`."""
    has_up, has_down, _ = walls_of(p)
    return 5 if has_up and has_down else 4


@inner
def take_impact(p, hit, word, progress, w):
    """Add an impact on the base wall to the images, and one on the other wall to the sets that wait."""
    impact, on_base = w.hits[hit], (w.hits[hit, ON_TOP] > 0.0) == on_top(p)
    waiting, images, whole = progress.waiting, progress.images, progress.whole and impact[SMOOTH] > 0.0
    if word.place_value == 0 or not (on_base or waiting < len(w.parts)):
        return Progress(-1, images, True, False)
    code, place_value = append_symbol(word.code, word.place_value, word_base(p), BASE_LETTER if on_base else OTHER_LETTER, 1)
    if not on_base:
        put_word(w.box, waiting, code, place_value)
        for c in range(ROW):
            w.parts[waiting, c] = impact[c]
        return Progress(waiting + 1, images, progress.missing, whole)
    v, phi = box_of(impact)
    w.box.side[SPEED, LOWER], w.box.side[SPEED, UPPER] = max(low(v), 0.0), high(v)
    w.box.side[PHASE, LOWER], w.box.side[PHASE, UPPER] = low(phi), high(phi)
    return Progress(waiting, add_image(w.box, images, code), progress.missing, whole)


@inner
def first_impacts_of(p, part, w):
    """All possible first impacts of a set that waits; of the first flight of a cell the spread by each coordinate is kept."""
    flight, by = first_impacts(p, w.parts[part, ON_TOP] > 0.0, w.parts[part], w.hits)
    if not max(w.box.spread[SPEED], w.box.spread[PHASE]) > 0.0:
        w.box.spread[SPEED], w.box.spread[PHASE] = by
    return flight


@inner
def set_images(p, v, phi, w):
    """The images of the set that fills a box: (their number, whether all are bounded, whether some state may have none, whether
    no graze cuts it). A box with one smooth image has it in the first row of `hits`.
    """
    base_up = on_top(p)
    put_set(w.parts[FIRST], base_up, box_set(v, phi), True)
    code, place_value = append_symbol(0, 1, word_base(p), BASE_LETTER, 1)
    put_word(w.box, FIRST, code, place_value)
    w.box.spread[SPEED], w.box.spread[PHASE] = 0.0, 0.0
    found, bounded = follow_sets(p, 0, w, first_impacts_of, take_impact)
    return found.images, bounded and all_finite(w.box.images, found.images), found.missing, found.whole


@inner
def cell_images(p, k, w):
    """The images of a cell."""
    cell = w.box.cells[k]
    v, phi = between(cell[SPEED, LOWER], cell[SPEED, UPPER]), between(cell[PHASE, LOWER], cell[PHASE, UPPER])
    number, bounded, missing, whole = set_images(p, v, phi, w)
    loose = missing or not whole or number != 1
    if bounded and not loose:
        loose = sharpen(p, cell, w, SLACK if k > 0 else LOOSE)
    return CellImages(number, bounded, missing, loose)


@inner
def sharpen(p, cell, w, widest):
    """Tighten the one image of a cell where the map is monotone, and write its spread by each coordinate: True if it is loose.

    A component whose derivatives have no zero in the cell takes its extrema at corners.
    """
    _, _, one, d, _, r, v, phi = get_set(w.hits[FIRST])
    code, loose = w.box.codes[FIRST], False
    for row in range(2):
        for end in range(2):
            w.ends[row, end] = w.box.images[FIRST, row, end]
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
            corner = (cell[0, end if a[0] > 0.0 else 1 - end], 0.0), (cell[1, end if b[0] > 0.0 else 1 - end], 0.0)
            n, bounded, _, smooth = set_images(p, corner[0], corner[1], w)
            if n == 1 and bounded and smooth:
                there = w.box.images[FIRST, row, end]
                w.ends[row, end] = max(w.ends[row, end], there) if end == LOWER else min(w.ends[row, end], there)
            else:
                loose = True
    w.box.codes[FIRST] = code
    for row in range(2):
        for end in range(2):
            w.box.images[FIRST, row, end] = w.ends[row, end]
    w.box.spread[SPEED], w.box.spread[PHASE] = (size(d[0]) + size(d[2])) * r[0], (size(d[1]) + size(d[3])) * r[1]
    return loose


@entry
def all_box_images(p, w, boxes, rows):
    """Write the images of boxes of shape (N, 2, 2) into `ImageRows`; returns their number."""
    return enclose_boxes(p, boxes, rows, w, cell_images)
