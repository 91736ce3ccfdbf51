"""Images of boxes of states, for each kind of sets: cells of boxes, and the sets of a cell from event to event to the section.

A box is halved into cells where that tightens its images (R. E. Moore, R. B. Kearfott, M. J. Cloud, *Introduction to interval
analysis*, SIAM 2009, on refinement). A kind of sets is given by three functions, for which numba compiles the driver:

- `cell_images(p, k, w)`: of the images of cell k, which are written into the memory of boxes, (their number, whether all are
  bounded, whether some state may have none, whether halves of the cell have tighter ones);
- `first_events(p, part, w)`: the `SetFlight` of a set that waits, whose possible first events are written into the workspace;
- `take_event(p, hit, word, progress, w)`: the `Progress` after one of these events, behind a word, a code and the place value of
  the next letter: images are added, or sets that wait.

Here p is the table of a system, and w the workspace of the kind, with the memory of boxes `w.box`.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.enclosure.arithmetic.balls import TURN, ZERO, badd, bmul, bneg, exact, high, low
from nsmaps.exact.enclosure.images import LOWER, UPPER
from nsmaps.exact.engine.jit import inner

MOST_IMAGES = 16  #: words distinguished in one box
MOST_CELLS = 16  #: cells of a box and their halves, to tighten its images
ALL_CELLS = 32  #: the same, to bound them
MOST_PARTS = 64  #: sets of one cell that wait to be followed
MOST_FLIGHTS = 96  #: flights of the sets of one cell
MOST_HITS = 48  #: events of one flight of a set
SLACK = 1.25  #: width of an image over its linear part, above which cells are halved
SMALL = 1e-9  #: of the size of a coordinate, or of a radian: half sides that are not halved
LANDED, GONE, SPENT = range(3)  #: how the flight of a set ended; except for the first, perhaps for some states only
FIRST = 0  #: place of the box among its cells, of the set of a cell among those that wait
CODE, PLACE_VALUE = range(2)  #: of a word so far


@by_address
class BoxMemory(NamedTuple):
    """Memory for one box at a time in m coordinates."""

    phase: int  #: coordinate that is the phase of the forcing, -1 for none
    cells: Any  #: shape (ALL_CELLS, m, 2)
    spread: Any  #: shape (m,), how much the images of a cell depend on each coordinate
    side: Any  #: shape (m, 2), an image that is to be added
    codes: Any  #: shape (MOST_IMAGES,), words of the images of a cell
    images: Any  #: shape (MOST_IMAGES, m, 2)
    words: Any  #: shape (MOST_PARTS + 1, 2), of each set that waits: code of its word so far, place value of the next letter


class SetFlight(NamedTuple):
    """The flight of a set to all of its possible first events."""

    ended: int  #: LANDED, GONE or SPENT
    events: int  #: their number
    missing: bool  #: whether some state may have no event


class Progress(NamedTuple):
    """How far the sets of a cell have been followed."""

    waiting: int  #: number of sets that wait; negative where there is no room for them
    images: int  #: number of images of the cell
    missing: bool  #: whether some state may have no image
    whole: bool  #: whether all states take one way: no graze cuts the sets


def box_memory(coordinates: int, phase: int) -> BoxMemory:
    """Memory for boxes of so many coordinates."""
    return BoxMemory(
        phase=phase,
        cells=np.zeros((ALL_CELLS, coordinates, 2)),
        spread=np.zeros(coordinates),
        side=np.zeros((coordinates, 2)),
        codes=np.zeros(MOST_IMAGES, np.int64),
        images=np.zeros((MOST_IMAGES, coordinates, 2)),
        words=np.zeros((MOST_PARTS + 1, 2), np.int64),
    )


@inner
def copy_sides(sides, to):
    """Copy a box of shape (m, 2)."""
    for c in range(len(sides)):
        to[c, LOWER], to[c, UPPER] = sides[c, LOWER], sides[c, UPPER]


@inner
def put_word(box, part, code, place_value):
    """Write the word so far of a set that waits."""
    box.words[part, CODE], box.words[part, PLACE_VALUE] = code, place_value


@inner
def unite_image(codes, images, number, code, side):
    """Unite an image with those of its word; returns the number of images afterwards."""
    k = 0
    while k < number and codes[k] != code:
        k += 1
    if k == len(codes):  # too many words: the last image has several
        k -= 1
        codes[k] = 0
    for c in range(len(side)):
        lower, upper = side[c, LOWER], side[c, UPPER]
        if k < number:
            lower, upper = min(images[k, c, LOWER], lower), max(images[k, c, UPPER], upper)
        images[k, c, LOWER], images[k, c, UPPER] = lower, upper
    if k < number:
        return number
    codes[k] = code
    return number + 1


@inner
def all_finite(images, number):
    """True if the first images, so many, are finite boxes."""
    for k in range(number):
        for c in range(images.shape[1]):
            lower, upper = images[k, c, LOWER], images[k, c, UPPER]
            if not (lower <= upper and lower > -math.inf and upper < math.inf):
                return False
    return True


@inner
def follow_sets(p, images, w, first_events, take_event):
    """Follow the set in the first place to the section: (the `Progress` beyond so many images, whether all are bounded)."""
    progress = Progress(1, images, False, True)
    for _ in range(MOST_FLIGHTS):
        if progress.waiting <= 0:
            break
        part = progress.waiting - 1
        word = w.box.words[part, CODE], w.box.words[part, PLACE_VALUE]
        flight = first_events(p, part, w)
        missing = progress.missing or flight.missing or flight.ended != LANDED
        progress = Progress(-1 if flight.ended == SPENT else part, progress.images, missing, progress.whole)
        for hit in range(flight.events):
            if progress.waiting >= 0:
                progress = take_event(p, hit, word, progress, w)
    bounded = progress.waiting == 0
    return Progress(progress.waiting, progress.images, progress.missing or not bounded, progress.whole), bounded


@inner
def halve(box, k, last):
    """Add the halves of cell k after the last cell, across the coordinate on which most depends; False if all sides are small."""
    best, cells = -1, box.cells
    for c in range(cells.shape[1]):
        lower, upper = cells[k, c, LOWER], cells[k, c, UPPER]
        size = 1.0 if c == box.phase else max(abs(lower), abs(upper))
        if upper - lower > 2.0 * SMALL * size and (best < 0 or box.spread[c] > box.spread[best]):
            best = c
    if best < 0:
        return False
    second = last + 1
    for c in range(cells.shape[1]):
        lower, upper = cells[k, c, LOWER], cells[k, c, UPPER]
        middle = 0.5 * (lower + upper)
        cells[last, c, LOWER], cells[last, c, UPPER] = lower, middle if c == best else upper
        cells[second, c, LOWER], cells[second, c, UPPER] = middle if c == best else lower, upper
    return True


@inner
def enclose_box(p, codes, images, w, cell_images):
    """Write the images of the box in the first cell, halved where that helps: (number, all bounded, some may have none)."""
    number, last, missing, k = 0, 1, False, 0
    while k < last:
        found, bounded, without, loose = cell_images(p, k, w)
        limit = MOST_CELLS if bounded and not without else len(w.box.cells)
        if (loose or not bounded) and last + 2 <= limit and halve(w.box, k, last):
            last += 2
        elif not bounded:
            return 0, False, True
        else:
            missing = missing or without
            for i in range(found):
                number = unite_image(codes, images, number, w.box.codes[i], w.box.images[i])
        k += 1
    return number, True, missing


@inner
def first_cell(box, sides):
    """Write the first cell, with the phase in the first turn of its circle; returns the angle of the turns removed, a ball."""
    turns = ZERO
    for c in range(len(sides)):
        lower, upper = sides[c, LOWER], sides[c, UPPER]
        if c == box.phase:
            turns = bmul(exact(np.floor(0.5 * (lower + upper) / TURN.centre)), TURN)
            lower, upper = low(badd(exact(lower), bneg(turns))), high(badd(exact(upper), bneg(turns)))
        box.cells[FIRST, c, LOWER], box.cells[FIRST, c, UPPER] = lower, upper
    return turns


@inner
def enclose_boxes(p, boxes, rows, w, cell_images):
    """Write the images of boxes (N, m, 2), at most `MOST_IMAGES` of each, into rows; returns the number of rows.

    Rows hold codes of words and boxes, in order; of each box are written the number of its images, whether some state may have
    none and whether they contain all.
    """
    all_codes, all_images, numbers, all_empty, all_bounded = rows
    total, room = 0, len(w.box.codes)
    for i in range(len(boxes)):
        turns = first_cell(w.box, boxes[i])
        codes, images = all_codes[total : total + room], all_images[total : total + room]
        number, bounded, empty = enclose_box(p, codes, images, w, cell_images)
        if not bounded:
            number, codes[FIRST] = 1, 0
            images[FIRST, :, LOWER], images[FIRST, :, UPPER] = -math.inf, math.inf
        elif w.box.phase >= 0:
            for k in range(number):
                lower, upper = images[k, w.box.phase, LOWER], images[k, w.box.phase, UPPER]
                images[k, w.box.phase, LOWER] = low(badd(exact(lower), turns))
                images[k, w.box.phase, UPPER] = high(badd(exact(upper), turns))
        numbers[i], all_bounded[i], all_empty[i] = number, bounded, empty
        total += number
    return total
