"""Places of numbers in what the compiled laws of a nonlinear system write: see `nsmaps.exact.taylor.laws`.

The law of a mode's rates writes for each own state `own` + 3 numbers in a row, all rows in one array: its rate, the sum of the
sizes of the terms of it, its derivatives by the own states and by the phase. Behind these are `own` + 2 for each function with
flat parts: its argument, the derivatives of the rates by its value, and those of watched functions as shares of their terms.
The law of the derived states writes an array, shape (R, own + P + 3), with a row for each: its value, its derivatives by the own
states, by the phase and by the P parameters, and the sum of the sizes of its terms.
"""

from nsmaps.exact.engine.jit import inner

VALUE = 0  #: column of a derived state
ARGUMENT, WEIGHTS = 0, 1  #: places behind the first number of a function with flat parts


@inner
def rate_place(p, i):
    """The place of the rate of an own state."""
    return i * (p.own + 3)


@inner
def size_place(p, i):
    """The place of the size of the terms of that rate."""
    return i * (p.own + 3) + 1


@inner
def slope_place(p, i, j):
    """The place of the derivative of the rate of an own state i by an own state j, or for j = own by the phase."""
    return i * (p.own + 3) + 2 + j


@inner
def part_place(p, k):
    """The first place of a function with flat parts."""
    return p.own * (p.own + 3) + k * (p.own + 2)


@inner
def slope_column(j):
    """The column of the derivative of a derived state by an own state j, or for j = own by the phase."""
    return 1 + j


@inner
def parameter_column(p, k):
    """The column of the derivative of a derived state by a parameter."""
    return p.own + 2 + k


@inner
def size_column(p):
    """The column of the sizes of the terms of derived states."""
    return p.own + 2 + len(p.parameters)
