"""The rows of a block of flights, which has a column for each."""

from typing import NamedTuple

BLOCK = 512  # returns in parallel: few enough to stay in the processor's cache
PITCH = BLOCK + 8  # from row to row: not a power of two, which would map all rows to one part of the cache


class Row(NamedTuple):
    """The places of rows in the array of a block; they are constants, so that a compiler sees that rows do not overlap."""

    motion: int  #: displacement, and its derivatives by the time
    motion_1: int
    motion_2: int
    motion_3: int
    motion_4: int
    motion_5: int
    by_phase: int  #: derivatives of displacement and velocity by phase and velocity at the start
    by_speed: int
    by_phase_1: int
    by_speed_1: int
    spare: int
    spare_1: int
    d_vv: int  #: derivative of a return, of (speed, phase) by the start
    d_vp: int
    d_pv: int
    d_pp: int
    less: int  #: cosine of the phase minus one
    sine: int
    orbit: int  #: number of the orbit
    time: int  #: of the return so far
    turns: int
    speed: int  #: of the last impact
    phase: int
    needs_scalar: int  #: 1: the return is left to `first_return`
    open: int  #: 1: the column continues
    velocity: int  #: after the last impact
    to_up: int  #: 1: the wall ahead is the upper one
    now: int  #: time since the last impact
    ahead: int  #: the next step
    gap: int  #: to the wall ahead, and its derivatives by the time
    gap_1: int
    gap_2: int
    gap_3: int
    gap_4: int
    gap_5: int
    steady: int  #: the constant part of the acceleration
    jerk: int  #: bounds, as in `Bounds`
    snap: int
    pop: int
    acceleration: int
    drift: int
    least: int  #: least gap ahead
    behind: int  #: least gap behind
    step: int  #: to the root of the gap's Taylor polynomial
    low: int  #: bracket of the root
    high: int
    rate: int  #: of the gap at the root


AT = Row(*range(0, len(Row._fields) * PITCH, PITCH))
TERMS = len(AT) * PITCH  #: from here on two rows for each rate, its coefficients, then waves of multiples of the phase
# The first rows of what is valid as long as a return, a flight, a march to a wall, and a search for its time
RETURN, FLIGHT, MARCH, SEARCH = AT.orbit, AT.velocity, AT.least, AT.step
