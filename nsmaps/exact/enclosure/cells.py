"""Images of cells of states of an impact system, as Taylor sets."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.enclosure.arithmetic.balls import between, exact, high, low, size
from nsmaps.exact.enclosure.encounters import first_impacts
from nsmaps.exact.enclosure.images import LOWER, UPPER
from nsmaps.exact.enclosure.subdivide import (
    FIRST,
    MOST_HITS,
    MOST_PARTS,
    SLACK,
    SMALL,
    BoxMemory,
    Progress,
    all_finite,
    box_memory,
    copy_sides,
    enclose_boxes,
    follow_sets,
    put_word,
    unite_image,
)
from nsmaps.exact.enclosure.taylor_set import ON_TOP, ROW, SMOOTH, box_of, box_set, get_set, put_set
from nsmaps.exact.engine.flight.flow import on_top
from nsmaps.exact.engine.jit import allocating, inlined, inner, long_entry
from nsmaps.exact.engine.observers import BASE, OTHER, base_of
from nsmaps.exact.engine.returns import PHASE, SPEED, append_symbol

LOOSE = 1.1  #: width of the image of a whole box over its linear part, above which corners are used


class SetMemory(NamedTuple):
    """Workspace for the Taylor sets of one thread."""

    box: BoxMemory
    parts: Any  #: shape (MOST_PARTS, ROW), sets that wait
    hits: Any  #: shape (MOST_HITS, ROW), sets at impacts
    ends: Any  #: shape (2, 2), a tightened image


@inner
def take_impact(p, hit, word, progress, w):
    """Add an impact on the base wall to the images, and one on the other wall to the sets that wait."""
    impact, on_base = w.hits[hit], (w.hits[hit, ON_TOP] > 0.0) == on_top(p)
    waiting, images, whole = progress.waiting, progress.images, progress.whole and impact[SMOOTH] > 0.0
    (code, place_value), base = word, base_of(p)
    if place_value == 0 or not (on_base or waiting < len(w.parts)):
        return Progress(-1, images, True, False)
    code, place_value = append_symbol(code, place_value, base, BASE if on_base else OTHER, 1)
    if not on_base:
        put_word(w.box, waiting, code, place_value)
        for c in range(ROW):
            w.parts[waiting, c] = impact[c]
        return Progress(waiting + 1, images, progress.missing, whole)
    v, phi = box_of(impact)
    w.box.side[SPEED, LOWER], w.box.side[SPEED, UPPER] = max(low(v), 0.0), high(v)
    w.box.side[PHASE, LOWER], w.box.side[PHASE, UPPER] = low(phi), high(phi)
    return Progress(waiting, unite_image(w.box.codes, w.box.images, images, code, w.box.side), progress.missing, whole)


@inner
def set_images(p, v, phi, w):
    """The images of the set that fills a box: (number, all bounded, some state may have none, no graze cuts it).

    A box with one smooth image has it in the first row of `hits`.
    """
    put_set(w.parts[FIRST], on_top(p), box_set(v, phi), True)
    code, place_value = append_symbol(0, 1, base_of(p), BASE, 1)
    put_word(w.box, FIRST, code, place_value)
    found, bounded = follow_sets(p, 0, w, first_impacts, take_impact)
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
    return number, bounded, missing, loose


@inner
def sharpen(p, cell, w, widest):
    """Tighten the one image of a cell where the map is monotone, and write its spread by each coordinate: True if it is loose."""
    image, code, floor = get_set(w.hits[FIRST]), w.box.codes[FIRST], SMALL * SMALL
    one, d, (r_1, r_2) = image.d, image.all_d, image.r
    copy_sides(w.box.images[FIRST], w.ends)
    linear_v = abs(one.v_1.centre) * r_1 + abs(one.v_2.centre) * r_2 + floor * size(image.box_v)
    linear_phi = abs(one.phi_1.centre) * r_1 + abs(one.phi_2.centre) * r_2 + floor
    loose_v = sharpen_side(p, cell, w, SPEED, (d.v_1, d.v_2), image.box_v.radius / linear_v, widest)
    loose_phi = sharpen_side(p, cell, w, PHASE, (d.phi_1, d.phi_2), image.box_phi.radius / linear_phi, widest)
    w.box.codes[FIRST] = code
    copy_sides(w.ends, w.box.images[FIRST])
    by_v, by_phi = size(d.v_1) + size(d.phi_1), size(d.v_2) + size(d.phi_2)
    w.box.spread[SPEED], w.box.spread[PHASE] = by_v * r_1, by_phi * r_2
    return loose_v or loose_phi


@inner
def sharpen_side(p, cell, w, side, slopes, wide, widest):
    """Tighten one side of the image of a cell, so many times as wide as its linear part: True if it is loose.

    A component whose derivatives have no zero in the cell takes its extrema at corners.
    """
    by_v, by_phi = slopes
    if not wide > widest:
        return False
    if not (abs(by_v.centre) > by_v.radius and abs(by_phi.centre) > by_phi.radius):
        return wide > SLACK
    loose = False
    for end in range(2):
        number, bounded, _, whole = set_images(p, corner(cell, SPEED, by_v, end), corner(cell, PHASE, by_phi, end), w)
        if number == 1 and bounded and whole:
            there = w.box.images[FIRST, side, end]
            w.ends[side, end] = max(w.ends[side, end], there) if end == LOWER else min(w.ends[side, end], there)
        else:
            loose = True
    return loose


@inlined
def corner(cell, c, slope, end):
    """Where in a cell a component with this derivative by coordinate c is least, or greatest."""
    return exact(cell[c, end if slope.centre > 0.0 else UPPER - end])


compiled_box_memory = allocating(box_memory)


@allocating
def set_memory():
    """A workspace."""
    parts, hits = np.empty((MOST_PARTS, ROW)), np.empty((MOST_HITS, ROW))
    return SetMemory(compiled_box_memory(2, PHASE), parts, hits, np.empty((2, 2)))


@long_entry
def all_box_images(p, boxes, rows):
    """Write the images of boxes of shape (N, 2, 2): see `enclose_boxes`."""
    return enclose_boxes(p, boxes, rows, set_memory(), cell_images)
