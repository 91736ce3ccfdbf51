"""What the compiled functions work in: the state and its derivatives on their way, and how the table moves with parameters."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.compiling.addresses import by_address
from nsmaps.exact.engine.law import LANES
from nsmaps.exact.kernel import return_rows
from nsmaps.exact.modes.tables.taylor import DEGREE, ORDER, TERMS

FIRST = 0  #: the first place of an array, as that of the starts in `Record.states`
ONLY = 0  #: place in an array of one number
NO_FUNCTION = -1
END = 1  #: behind a place in an array of first places: where its range ends
CLEARANCE, SLOWEST, MINIMA = range(3)  #: places in `Memory.margins`: least value at a minimum, least rate at an event, minima
AWAY, PRESSURE = range(2)  #: rows of `Tables.begins`, speed away from a surface of contact and pressure towards it
SURFACE, RATE_ABOVE, RATE_BELOW = range(3)  #: rows of `Tables.surfaces`, the rate below with the other sign
ALONG = 0  #: the one direction of derivatives by parameters
BEFORE, AFTER = range(2)  #: rows of `Memory.start_rates`, just before and after the event at the start
INTERVALS = 8  #: of a step of a Taylor flight, between the instants at which its series is compared with the rates


# Places in `Memory.reals`
FLIGHT_TIME = 0  #: length of the last flight
ACCUMULATION_TIME = 1  #: time until impacts that were summed accumulate
SPEED_RATIO = 2  #: share of the speed that each of them leaves
DOUBT_TIME = 3  #: time of the return until its first doubtful event
CONTACT_TIME = 4  #: time since contact began
REALS = 5
# Places in `Memory.integers`
ACCUMULATING = 0  #: whether impacts that follow accumulate below rounding
START_FUNCTION = 1  #: of the event at the start, NO_FUNCTION where it may follow itself
IDLE_EVENTS = 2  #: events in a row that take no time
LAST_FUNCTION = 3  #: of the last event
FUNCTION_BEFORE = 4  #: of the last event with another function
TIMED_EVENTS = 5  #: number, among events in a row that take no time but for rounding, of the last that took any
DOUBTED_FUNCTION = 6  #: of the first doubtful event, NO_FUNCTION without one
DOUBT_REASON = 7  #: why a flight is in doubt: see `nsmaps.exact.modes.march.flight`
PIECES = 8  #: of flights so far
CONTACT_MARK = 9  #: of the contact under way in words: 1 after chatter, 2 from rest, 0 without contact
ROW_LETTER = 10  #: of the last events in a row
ROW_CODE = 11  #: of the word with the first of them
ROW_POWER = 12  #: place value of the next letter behind it
FIRST_AT_ONCE, SECOND_AT_ONCE = 13, 14  #: functions that are zero at once, NO_FUNCTION for none
INTEGERS = 15


@by_address
class Moved(NamedTuple):
    """Derivatives of a table along a direction of the parameters; `here` is false where there is no such direction."""

    here: bool
    rate: float
    phase: float  #: of the section, where no coordinate is one
    parameters: Any  #: shape (P,), the direction
    flows: Any  #: shape (M, n, N, TERMS), of exp(Y step tau), the rows of states
    functions: Any  #: shape (S, N)
    resets: Any  #: shape (T, n, N)
    states: Any  #: shape (number of starts, n, N)


@by_address
class Piece(NamedTuple):
    """A piece of a Taylor flight: one step of heyoka, of degree DEGREE, n states of which the first are own; all rows in time.

    V is the number of rows of the variational program: own states, then of each its derivatives by own states, phase, parameters.
    """

    phase: Any  #: shape (1,), of the state in memory
    length: Any  #: shape (1,), of the last step that was chosen
    time: Any  #: shape (1,), zero: heyoka's time at the start of a step
    halt: Any  #: shape (1,), zero: how far heyoka moves the state
    state: Any  #: shape (n,), at the start
    varied: Any  #: shape (V,), own states there and the unit matrix
    settings: Any  #: shape (2 P + 2,), phase, parameters, their rates along a direction, zero
    series: Any  #: shape (n, DEGREE + 1), without derived states the first rows of `variations`, if there are any
    variations: Any  #: shape (V, DEGREE + 1)
    local: Any  #: shape (N, TERMS), of the features, in units of the step
    spans: Any  #: shape (N,), sums of the sizes of these terms
    tails: Any  #: shape (N,), of the last two of them
    flow: Any  #: shape (own, own to own + 2), how states change with the start, the phase and along the direction, if any
    rates: Any  #: shape (L,), what the law of the rates writes: see `nsmaps.exact.modes.flights.states`
    inside: Any  #: shape (INTERVALS + 1, L), the same at instants of the step
    states: Any  #: shape (INTERVALS + 1, n), at these instants, of derived ones at both ends and in the middle alone
    speeds: Any  #: the same, their rates by the series, in units of the step
    misfits: Any  #: shape (INTERVALS + 1, own), how far the rates there are from those of the series
    derived: Any  #: shape (n - own, own + P + 3), what the law of the derived states writes
    growth: Any  #: shape (5, own, own or more, a multiple of 4), how errors grow: see `nsmaps.exact.modes.flights.rounding`
    extent: Any  #: shape (own,), how large the states have been in the flight
    weights: Any  #: shape (own,), one by the squares of these, zero of a state that is zero


@by_address
class Memory(NamedTuple):
    """Memory that a return works in; D directions of derivatives."""

    z: Any  #: shape (N,), features of the state
    dz: Any  #: shape (N, D)
    dphi: Any  #: shape (D,)
    d: Any  #: shape (ORDER + 2, N), Taylor series of the state
    e: Any  #: the same, of a derivative
    a: Any  #: shape (TERMS,), of a function
    b: Any  #: the same, of its derivative, or in the basis of Bernstein
    c: Any  #: the same, of its second derivative
    powers: Any  #: shape (TERMS,), of a time
    flow: Any  #: shape (n N,), how the states change within a time
    field: Any  #: shape (N,)
    on: Any  #: shape (S,), how many of the first terms of each function are zero at the start of the flight
    other: Any  #: shape (N,)
    one: Any  #: the same, after two events in one order
    two: Any  #: and in the other
    reals: Any  #: shape (REALS,), at the places above
    integers: Any  #: shape (INTEGERS,), at the places above
    start_rates: Any  #: shape (2, N), rates of change of the features before and after the event at the start
    scales: Any  #: shape (n,), the largest sizes of the states at events of the return so far
    new: Any  #: shape (n,)
    slopes: Any  #: shape (n, D)
    curved: Any  #: shape (n, 1 + own + 1 + P), of resets that are not affine: see `nsmaps.exact.modes.tables.rows.law_address`
    moved: Moved
    margins: Any  #: shape (3,), at the places above; the first is NaN if they are not asked for
    units: Any  #: shape (S,), of values and rates of each function there
    image: Any  #: shape (m,), coordinates of the section at the end of the return, NaN without
    tangent: Any  #: shape (m, D), their derivatives
    minima: Any  #: shape (S,), of the flight under way
    chatter: float  #: see `nsmaps.exact.chatter`
    piece: Piece


@by_address
class Record(NamedTuple):
    """The first n returns of M states with m coordinates and D directions of derivatives."""

    states: Any  #: shape (n + 1, M, m), the starts first
    turns: Any  #: shape (n, M, m)
    codes: Any  #: shape (n, M)
    outcome: Any  #: shape (n, M)
    time: Any  #: shape (n, M)
    tangents: Any  #: shape (n, M, m, D)
    margins: Any  #: shape (n, M, 3), as of `Memory`


def record(start: Any, n: int, directions: int) -> Record:
    """Room for the first n returns of states (M, m)."""
    return Record(*return_rows(start, n, directions), np.zeros((n, len(start), 3)))


def still(p: Any) -> Moved:
    """No direction of the parameters."""
    shapes = p.flows, p.functions, p.resets, p.states
    return Moved(False, 0.0, 0.0, p.parameters, *(np.zeros((0, *shape.shape[1:])) for shape in shapes))


DIMENSIONS = (1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 1, 1, 2, 1, 2, 2, 2, 2, 2, 3, 1, 1)  #: of the fields of a `Piece`
NO_PIECE = Piece(*(np.zeros((0,) * dimensions) for dimensions in DIMENSIONS))  #: of systems whose modes are affine


def piece(p: Any, directions: int, moved: Moved) -> Piece:
    """Memory for Taylor flights."""
    if not p.nonlinear:
        return NO_PIECE
    n, own, width, count = p.first.shape[1] - 1, p.own, p.resets.shape[2], len(p.parameters)
    columns = own + int(p.rate > 0) + int(moved.here)
    rows = own * (1 + columns) if directions else 0
    law = own * (own + 3) + p.kinds.shape[1] * (own + 2)
    varied = np.zeros(rows)
    varied[own:].reshape(-1, columns)[: own if rows else 0, :own] = np.eye(own)[: own if rows else 0]
    variations = np.zeros((rows, DEGREE + 1))
    return Piece(
        phase=np.zeros(1),
        length=np.zeros(1),
        time=np.zeros(1),
        halt=np.zeros(1),
        state=np.zeros(n),
        varied=varied,
        settings=np.concatenate([np.zeros(1), p.parameters, moved.parameters if moved.here else np.zeros(count), np.zeros(1)]),
        series=variations[:own] if rows and n == own else np.zeros((n, DEGREE + 1)),
        variations=variations,
        local=np.zeros((width, TERMS)),
        spans=np.zeros(width),
        tails=np.zeros(width),
        flow=np.zeros((own, columns)),
        rates=np.zeros(law),
        inside=np.zeros((INTERVALS + 1, law)),
        states=np.zeros((INTERVALS + 1, n)),
        speeds=np.zeros((INTERVALS + 1, n)),
        misfits=np.zeros((INTERVALS + 1, own)),
        derived=np.zeros((n - own, own + count + 3)),
        growth=np.zeros((5, own, -(-own // LANES) * LANES)),
        extent=np.zeros(own),
        weights=np.zeros(own),
    )


def memory(p: Any, directions: int, moved: Moved | None = None, units: Any = None, chatter: float = SUMMED_SPEED) -> Memory:
    """Memory for the returns of one thread, with margins if their units are given, one for each function, shape (S,)."""
    n, width, functions, moved = p.first.shape[1] - 1, p.resets.shape[2], len(p.functions), moved or still(p)
    return Memory(
        z=np.zeros(width),
        dz=np.zeros((width, directions)),
        dphi=np.zeros(directions),
        d=np.zeros((ORDER + 2, width)),
        e=np.zeros((ORDER + 2, width)),
        a=np.zeros(TERMS),
        b=np.zeros(TERMS),
        c=np.zeros(TERMS),
        powers=np.zeros(TERMS),
        flow=np.zeros(n * width),
        field=np.zeros(width),
        on=np.zeros(functions, np.int64),
        other=np.zeros(width),
        one=np.zeros(width),
        two=np.zeros(width),
        reals=np.zeros(REALS),
        integers=np.zeros(INTEGERS, np.int64),
        start_rates=np.zeros((2, width)),
        scales=np.zeros(n),
        new=np.zeros(n),
        slopes=np.zeros((n, directions)),
        curved=np.zeros((n, 2 + p.own + len(p.parameters))),
        moved=moved,
        margins=np.array([np.nan if units is None else np.inf, np.inf, 0.0]),
        units=np.ones(functions) if units is None else units,
        image=np.zeros(len(p.places)),
        tangent=np.zeros((len(p.places), directions)),
        minima=np.zeros(functions, np.int64),
        chatter=float(chatter),
        piece=piece(p, directions, moved),
    )
