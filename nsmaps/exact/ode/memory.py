"""What the compiled functions of integrated flights work in."""

from typing import Any, NamedTuple

import numpy as np
from numba import carray, types
from numba.extending import intrinsic

from nsmaps.arrays import Ints
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.engine.jit import allocating
from nsmaps.exact.ode.layout import WAYS


class Memory(NamedTuple):
    """The lanes with the returns under way, and the arrays of all returns, into which they write."""

    p: Flow  #: the table: walls, forcing and impact laws
    moved: Flow  #: its derivatives along a direction of the parameters
    tc: Any  #: shape (states, order + 1, lanes), Taylor coefficients at the beginning of the step
    state: Any  #: shape (states, lanes), of the integrator
    pars: Any  #: shape (parameters, lanes), of the integrator
    lanes: Any  #: shape (lanes, FLOATS), see `layout`
    counts: Any  #: shape (lanes, INTEGERS)
    pressing: tuple[Any, Any]  #: shapes (K, 2): phases between which the lower wall and the upper press on a ball at rest
    series: Any  #: shape (3, ORDER + 1), of a gap or a velocity, with room to shift it
    ends: Any  #: shape (states,), of the step
    chatter: float  #: as in `first_return`
    turning: bool  #: whether turning points are letters of the words
    next: Any  #: shape (1,), the next state to start from
    start: Any  #: shape (M, 2)
    states: Any  #: shape (n, M, 2), and so on as `put` of the engine writes them
    turns: Any
    codes: Any
    outcome: Any
    time: Any
    tangents: Any  #: shape (n, M, 2, 3)
    margins: Any  #: shape (M, 3), clearance, slowest, turning points; or no rows
    hits: Any  #: shape (H, 5), impacts: on the base wall, time, phase, speed, mark; or no rows
    doubts: Any  #: shape (n, M), why returns are undecided, see `layout`
    inside: Any  #: shape (instants, columns), of a step, see `resolution`
    kinds: Any  #: shape (functions,), of the equation of motion
    piece: Any  #: shape (3, order + 1), the step of an impact's flight: (1, number of the impact, begin, length), place, velocity
    equation: int  #: address of the compiled equation of motion


def room(n: int, m: int, slopes: bool) -> dict[str, Any]:
    """The arrays for n returns of M states, with their derivatives or without."""
    return {
        "states": np.empty((n, m, 2)),
        "turns": np.empty((n, m, 2), np.int32),
        "codes": np.empty((n, m), np.int64),
        "outcome": np.empty((n, m), np.int8),
        "time": np.empty((n, m)),
        "tangents": np.empty((n if slopes else 0, m, 2, WAYS)),
        "doubts": np.zeros((n, m), np.int8),
    }


@intrinsic
def _pointer(typingctx, address):
    """A number as a pointer."""

    def codegen(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(types.voidptr))

    return types.voidptr(types.int64), codegen


def addresses(w: Memory) -> Ints:
    """Where the arrays of a memory are and their shapes, shape (27, 5), for `at_addresses`.

    A call with this one array is taken much faster than one with all of them.
    """
    arrays = [*w.p, *w.moved, w.tc, w.state, w.pars, w.lanes, w.counts, *w.pressing, w.series, w.ends, w.next, w.start]
    arrays += [w.states, w.turns, w.codes, w.outcome, w.time, w.tangents, w.margins, w.hits, w.doubts, w.inside, w.kinds, w.piece]
    assert all(array.flags.c_contiguous for array in arrays)
    return np.array([[array.ctypes.data, *array.shape, *[0] * (4 - array.ndim)] for array in arrays], np.int64)


@allocating
def _of_one(h, j):
    """Array j, a vector of floats."""
    return carray(_pointer(h[j, 0]), (h[j, 1],), np.float64)


@allocating
def _of_two(h, j):
    """Array j, a matrix of floats."""
    return carray(_pointer(h[j, 0]), (h[j, 1], h[j, 2]), np.float64)


@allocating
def _of_three(h, j):
    """Array j, a tensor of three axes of floats."""
    return carray(_pointer(h[j, 0]), (h[j, 1], h[j, 2], h[j, 3]), np.float64)


@allocating
def at_addresses(h, chatter, turning, equation):
    """The memory with these `addresses`."""
    return Memory(
        Flow(_of_one(h, 0), _of_one(h, 1)),
        Flow(_of_one(h, 2), _of_one(h, 3)),
        _of_three(h, 4),
        _of_two(h, 5),
        _of_two(h, 6),
        _of_two(h, 7),
        carray(_pointer(h[8, 0]), (h[8, 1], h[8, 2]), np.int64),
        (_of_two(h, 9), _of_two(h, 10)),
        _of_two(h, 11),
        _of_one(h, 12),
        chatter,
        turning,
        carray(_pointer(h[13, 0]), (h[13, 1],), np.int64),
        _of_two(h, 14),
        _of_three(h, 15),
        carray(_pointer(h[16, 0]), (h[16, 1], h[16, 2], h[16, 3]), np.int32),
        carray(_pointer(h[17, 0]), (h[17, 1], h[17, 2]), np.int64),
        carray(_pointer(h[18, 0]), (h[18, 1], h[18, 2]), np.int8),
        _of_two(h, 19),
        carray(_pointer(h[20, 0]), (h[20, 1], h[20, 2], h[20, 3], h[20, 4]), np.float64),
        _of_two(h, 21),
        _of_two(h, 22),
        carray(_pointer(h[23, 0]), (h[23, 1], h[23, 2]), np.int8),
        _of_two(h, 24),
        carray(_pointer(h[25, 0]), (h[25, 1],), np.int64),
        _of_two(h, 26),
        equation,
    )
