"""What the compiled functions work in: the state and its derivatives on their way, and how the table moves with parameters."""

from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.modes.tables.taylor import ORDER, TERMS


class Moved(NamedTuple):
    """Derivatives of a table along a direction of the parameters; `here` is false where there is no such direction."""

    here: bool
    rate: float
    phase: float  #: of the section, where no coordinate is one
    parameters: Any  #: shape (P,), the direction
    rates: Any  #: shape (M, n, N), times the mode's longest step
    functions: Any  #: shape (S, N)
    resets: Any  #: shape (T, n, N)
    states: Any  #: shape (number of starts, n, N)


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
    both: Any  #: shape (2,), functions that are zero at once, -1 for none
    lapse: Any  #: shape (5,): length of the last flight, whether impacts that follow accumulate below rounding, first function,
    #: time until impacts that were summed accumulate, share of the speed that each of them leaves
    start: Any  #: shape (2, N), rates of change of the features before and after the event at the start
    idle: Any  #: shape (4,), events in a row that take no time, functions of the last two that differ, the last that took time
    doubt: Any  #: shape (2,), function of the first event that is doubtful, -1 without one, and the time until then
    scales: Any  #: shape (n,), the largest sizes of the states at events of the return so far
    spent: Any  #: shape (1,), pieces of flights so far
    new: Any  #: shape (n,)
    slopes: Any  #: shape (n, D)
    curved: Any  #: shape (n, 1 + n + 1 + P), of resets that are not affine: see `nsmaps.exact.modes.definitions.resets`
    moved: Moved
    near: Any  #: shape (3,), least value at a minimum (NaN if not asked for), least rate at an event, number of minima
    units: Any  #: shape (S,), of values and rates of each function there
    held: Any  #: shape (2,), time since contact began, and its mark in words (1 after chatter, 2 from rest, 0 without contact)
    row: Any  #: shape (3,), letter of the last events in a row, word and place of the next letter behind the first of them
    minima: Any  #: shape (S,), of the flight under way
    chatter: float  #: see `nsmaps.exact.chatter`


class Record(NamedTuple):
    """The first n returns of M states with m coordinates and D directions of derivatives."""

    states: Any  #: shape (n + 1, M, m), the starts first
    turns: Any  #: shape (n, M, m)
    codes: Any  #: shape (n, M)
    outcome: Any  #: shape (n, M)
    time: Any  #: shape (n, M)
    tangents: Any  #: shape (n, M, m, D)
    near: Any  #: shape (n, M, 3), as of `Memory`


def record(start: Any, n: int, directions: int) -> Record:
    """Room for the first n returns of states (M, m)."""
    count, m = start.shape
    states = np.empty((n + 1, count, m))
    states[0] = start
    codes, outcome, time = np.zeros((n, count), np.int64), np.zeros((n, count), np.int8), np.zeros((n, count))
    tangents, near = np.empty((n, count, m, directions)), np.zeros((n, count, 3))
    return Record(states, np.zeros((n, count, m), np.int32), codes, outcome, time, tangents, near)


def still(p: Any) -> Moved:
    """No direction of the parameters."""
    shapes = p.growth, p.functions, p.resets, p.states
    return Moved(False, 0.0, 0.0, p.parameters, *(np.zeros((0, *shape.shape[1:])) for shape in shapes))


def memory(p: Any, directions: int, moved: Moved | None = None, units: Any = None, chatter: float = SUMMED_SPEED) -> Memory:
    """Memory for the returns of one thread, with margins if their units are given, one for each function, shape (S,)."""
    n, width, functions = p.first.shape[1] - 1, p.resets.shape[2], len(p.functions)
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
        both=np.full(2, -1),
        lapse=np.zeros(5),
        start=np.zeros((2, width)),
        idle=np.zeros(4, np.int64),
        doubt=np.array([-1.0, 0.0]),
        scales=np.zeros(n),
        spent=np.zeros(1, np.int64),
        new=np.zeros(n),
        slopes=np.zeros((n, directions)),
        curved=np.zeros((n, 2 + n + len(p.parameters))),
        moved=moved or still(p),
        near=np.array([np.nan if units is None else np.inf, np.inf, 0.0]),
        units=np.ones(functions) if units is None else units,
        held=np.zeros(2),
        row=np.zeros(3, np.int64),
        minima=np.zeros(functions, np.int64),
        chatter=float(chatter),
    )
