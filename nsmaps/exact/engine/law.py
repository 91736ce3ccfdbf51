"""What compiled code does by addresses: calls of laws and resets that are compiled separately, products of small matrices."""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

LANES = 4  #: columns of a matrix that are computed at once
DOUBLE = 8  #: bytes
KINDS = {types.void: ir.VoidType(), types.float64: ir.DoubleType(), types.int64: ir.IntType(64)}


def _call(result, *given):
    """What `intrinsic` takes of a call of the function at an address, which is the first argument: its signature and its code."""

    def codegen(context, builder, signature, arguments):
        at, *others = arguments
        kind = ir.FunctionType(KINDS[result], [KINDS[each] for each in given])
        value = builder.call(builder.inttoptr(at, kind.as_pointer()), others)
        return context.get_dummy_value() if result == types.void else value

    return result(types.int64, *given), codegen


@intrinsic
def multiply_lanes(typingctx, row, columns, count, width, out):
    """Write a row of numbers, times `LANES` columns of a matrix, to `out`.

    All but the count, and the width of the rows of the matrix, are addresses of doubles.
    """

    def codegen(context, builder, signature, arguments):
        lanes, whole = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(64)
        row, columns, count, width, out = arguments
        total = cgutils.alloca_once_value(builder, ir.Constant(lanes, [0.0] * LANES))
        row = builder.inttoptr(row, ir.DoubleType().as_pointer())
        step = builder.mul(width, ir.Constant(whole, DOUBLE))
        with cgutils.for_range(builder, count) as loop:
            place = builder.inttoptr(builder.add(columns, builder.mul(loop.index, step)), lanes.as_pointer())
            number = builder.load(builder.gep(row, [loop.index]))
            factor = builder.insert_element(ir.Constant(lanes, ir.Undefined), number, whole(0))
            factor = builder.shuffle_vector(factor, factor, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES))
            product = builder.fmul(factor, builder.load(place, align=DOUBLE), flags=("contract",))
            builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
        builder.store(builder.load(total), builder.inttoptr(out, lanes.as_pointer()), align=DOUBLE)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 5), codegen


@intrinsic
def call_law(typingctx, address, v, values):
    """The value of the law at an address, at the impact speed v and the parameters, which begin at the address `values`."""
    return _call(types.float64, types.float64, types.int64)


@intrinsic
def write_law_ball(typingctx, address, centre, radius, values, out):
    """Let the law at an address write the ball of speeds after impacts and of its two derivatives, six numbers, to `out`."""
    return _call(types.void, types.float64, types.float64, types.int64, types.int64)


@intrinsic
def call_reset(typingctx, address, phase, states, parameters, out):
    """Let the reset at an address write the states after an event, and their derivatives, to `out`."""
    return _call(types.void, types.float64, types.int64, types.int64, types.int64)


@intrinsic
def call_step(typingctx, address, state, settings, time, length, series):
    """Let heyoka's step at an address expand the flight from a state, at most of a length, and write its Taylor series.

    All but the address of the step are addresses of doubles: states, which are moved by the length; parameters; the time; the
    length, at which the length taken is written; coefficients row by row.
    """
    return _call(types.void, *[types.int64] * 5)
