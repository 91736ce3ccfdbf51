"""How returns stretch a frame of tangent vectors, in one compiled loop."""

import math

from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.returns import INVALID, first_return


@inner
def unit(x, y, other_x, other_y):
    """A vector's length and direction; where it has none, the direction given instead."""
    size = math.hypot(x, y)
    return (size, x / size, y / size) if size > 0.0 else (size, other_x, other_y)


@inner
def stretched(d, frame):
    """The lengths of a frame's vectors after a derivative and modified Gram-Schmidt, which makes it orthonormal again."""
    first = d[0] * frame[0, 0] + d[1] * frame[1, 0], d[2] * frame[0, 0] + d[3] * frame[1, 0]
    second = d[0] * frame[0, 1] + d[1] * frame[1, 1], d[2] * frame[0, 1] + d[3] * frame[1, 1]
    if first[0] == 0.0 and first[1] == 0.0:  # what a return forgets goes last
        first, second = second, first
    one, x, y = unit(first[0], first[1], 1.0, 0.0)
    along = second[0] * x + second[1] * y
    two, s, t = unit(second[0] - along * x, second[1] - along * y, -y, x)
    frame[0, 0], frame[1, 0], frame[0, 1], frame[1, 1] = x, y, s, t
    return one, two


@entry
def stretches(p, chatter, states, frames, growth, log_det, time, outcome):
    """Carry M states and their frames n returns on, in place, and write what each return did; how an orbit ended is repeated."""
    n, m = log_det.shape
    for k in range(m):
        v, phi = states[k]
        for i in range(n):
            how, v, phi, _, time[i, k], _, d = first_return(p, v, phi, chatter, True)
            outcome[i, k] = outcome[i - 1, k] if i > 0 and how == INVALID else how
            one, two = stretched(d, frames[k])
            growth[i, k, 0], growth[i, k, 1] = math.log(one), math.log(two)
            log_det[i, k] = math.log(abs(d[0] * d[3] - d[1] * d[2]))
        states[k, 0], states[k, 1] = v, phi
