"""How a value of a formula joins its total; shared by the loops of impact systems and of systems with modes."""

import math

from nsmaps.exact.engine.jit import inlined
from nsmaps.exact.engine.law import reset_by

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
LEAST = 1e-17  # of the first speed: slower impacts of chatter are not added
MOST_CHATTER = 10_000_000  # impacts of chatter that are added: after more the totals are not known
NARROWINGS = 40  # of the interval about the largest sample: to the root of rounding, where values agree to rounding


@inlined
def cleared(q):
    """Begin the totals."""
    for c in range(len(q.total)):
        q.total[c] = -math.inf if q.largest[c] else 0.0


@inlined
def written(q, ended, b, k, time, totals):
    """Write the totals of a batch of returns, NaN if the orbit has ended."""
    time[b, k] = math.nan if ended else time[b, k]
    for c in range(len(q.total)):
        totals[b, k, c] = math.nan if ended else q.total[c]


@inlined
def joined(q, c, value):
    """Join a value to a total."""
    q.total[c] = max(q.total[c], value) if q.largest[c] else q.total[c] + value


@inlined
def evaluated(q, address, phi):
    """Let the formulas at an address write their values for the inputs `q.y`."""
    reset_by(address, phi, q.y.ctypes.data, q.parameters.ctypes.data, q.out.ctypes.data)


@inlined
def at_impact(q, row, phi):
    """Join the values of an impact, whose inputs are written."""
    evaluated(q, q.impact, phi)
    for c in range(q.at.shape[1]):
        if q.at[row, c]:
            joined(q, c, q.out[c, 0])


@inlined
def at_rest(q, row, phi):
    """Join what impacts that accumulate tend to, whose inputs are written: they are infinitely many."""
    evaluated(q, q.impact, phi)
    for c in range(q.at.shape[1]):
        if q.at[row, c] and q.out[c, 0] != 0.0 and not q.largest[c]:
            q.total[c] += math.copysign(math.inf, q.out[c, 0])


@inlined
def sampled(q, row, phi, s, weight):
    """Add the values at an instant of a flight, whose inputs are written, and take note of the largest."""
    evaluated(q, q.flight, phi)
    first = q.at.shape[1]
    for c in range(q.over.shape[1]):
        if q.over[row, c]:
            if not q.largest[first + c]:
                q.total[first + c] += weight * q.out[c, 0]
            elif q.out[c, 0] > q.peak[c]:
                q.peak[c], q.when[c] = q.out[c, 0], s


@inlined
def panels(q, s):
    """The number of panels of a flight, and their length."""
    n = max(1, math.ceil(s / q.panel))
    return n, s / n
