"""What observables are summed in, and how a value of a formula joins its total; shared by the loops of all flights.

Units are those of the system and of the formula, phases in radians.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from nsmaps.exact.engine.jit import inlined, inner
from nsmaps.exact.engine.law import call_reset

NODES, WEIGHTS = 0.5 * np.array(np.polynomial.legendre.leggauss(12))  #: of Gauss's rule in a panel, shape (12,)
NODES += 0.5  #: on [0, 1], where the weights have the sum 1
PANEL = 3.0  #: length of a panel, in units of the fastest rate: products of three states are integrated to rounding
VALUE, BY_INPUT = range(2)  #: columns of what formulas give: the value, its derivatives by inputs, then by phase and parameters
GOLDEN = 0.5 * (math.sqrt(5) - 1)
LEAST = 1e-17  # of the first speed: slower impacts of chatter are not added
MOST_CHATTER = 10_000_000  # impacts of chatter that are added: after more the totals are not known
STATE, RETURN = range(2)  # the numbers of a state and of its return, from which on totals are to be computed
FIRST = 0  # coordinate of a state, NaN where an orbit has ended
SMOOTH = 1e-13  # of the largest value: difference of a mean by a rule from that by two that counts as none
PARTS = (0.0, 1.0, 1.0), (0.0, 0.5, -1.0), (0.5, 0.5, -1.0)  # of a step: begin and length of the whole and of both halves, signs
SHORTEST = 1e-13  # of a panel: a part of which the rule is not tried
BESIDE = 0.2  # of a panel: the largest value of a flight is sought this near to the largest sample
NARROWINGS = 40  # of the interval about the largest sample: to the root of rounding, where values agree to rounding


class Quantities(NamedTuple):
    """K formulas of impacts and F of flights of a system; D inputs of formulas, the phase and parameters not counted."""

    impact: int  #: address of the compiled formulas of impacts, 0 without any
    flight: int  #: and of those of flights
    parameters: Any  #: shape (P,)
    at: Any  #: shape (R, K), whether an impact on a wall, or a transition, counts
    over: Any  #: shape (M, F), whether a flight from a wall, or in a mode, counts
    departed: bool  #: whether flights with modes count by the letter of the event at which they begin
    largest: Any  #: shape (K + F,), whether the largest value takes the place of the sum
    panel: float  #: the longest part of a flight that one rule covers
    rough: bool  #: whether a formula of flights may have kinks or jumps, or be steep, so that a rule may cover less
    y: Any  #: shape (D,), what the formulas take
    out: Any  #: shape (max(K, F), 1 + derivatives), what they give
    total: Any  #: shape (K + F,)
    peak: Any  #: shape (F,), largest value of the samples of a flight
    when: Any  #: shape (F,), its time
    gap: Any  #: shape (F,), difference of a rule from those on both halves
    size: Any  #: shape (F,), largest magnitude of the samples


@inlined
def begin_totals(q):
    """Begin the totals."""
    for c in range(len(q.total)):
        q.total[c] = -math.inf if q.largest[c] else 0.0


@inlined
def join_value(q, c, value):
    """Join a value to a total."""
    q.total[c] = max(q.total[c], value) if q.largest[c] else q.total[c] + value


@inlined
def evaluate_formulas(q, address, phi):
    """Let the formulas at an address write their values for the inputs `q.y`."""
    call_reset(address, phi, q.y.ctypes.data, q.parameters.ctypes.data, q.out.ctypes.data)


@inlined
def at_impact(q, row, phi):
    """Join the values of an impact, whose inputs are written."""
    evaluate_formulas(q, q.impact, phi)
    for c in range(q.at.shape[1]):
        if q.at[row, c]:
            join_value(q, c, q.out[c, VALUE])


@inlined
def at_rest(q, row, phi):
    """Join what impacts that accumulate tend to, whose inputs are written: they are infinitely many."""
    evaluate_formulas(q, q.impact, phi)
    for c in range(q.at.shape[1]):
        if q.at[row, c] and q.out[c, VALUE] != 0.0 and not q.largest[c]:
            q.total[c] += math.copysign(math.inf, q.out[c, VALUE])


@inlined
def join_sample(q, row, phi, s, weight):
    """Add the values at an instant of a flight, whose inputs are written, and take note of the largest."""
    evaluate_formulas(q, q.flight, phi)
    first = q.at.shape[1]
    for c in range(q.over.shape[1]):
        if q.over[row, c]:
            if not q.largest[first + c]:
                q.total[first + c] += weight * q.out[c, VALUE]
            elif q.out[c, VALUE] > q.peak[c]:
                q.peak[c], q.when[c] = q.out[c, VALUE], s


@inlined
def panels(q, s):
    """The number of panels of a flight, and their length."""
    n = max(1, math.ceil(s / q.panel))
    return n, s / n


@inner
def highest(q, c, low, high, instant, flight):
    """The largest value of formula c between two times of a flight, by golden sections, at least that of the samples.

    `instant(q, s, flight)` writes the inputs at a time s and returns the phase.
    """
    largest = q.peak[c]
    for _ in range(NARROWINGS):
        one, two = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        evaluate_formulas(q, q.flight, instant(q, one, flight))
        at_one = q.out[c, VALUE]
        evaluate_formulas(q, q.flight, instant(q, two, flight))
        at_two = q.out[c, VALUE]
        largest = max(largest, max(at_one, at_two))
        low, high = (one, high) if at_one < at_two else (low, two)
    return largest


@inner
def length_of_rule(q, row, low, step, panel, instant, flight):
    """The length, at most a step, of the part of a flight from a time on for which one rule gives what one on each half does.

    `instant(q, s, flight)` writes the inputs at a time s and returns the phase. Without rough formulas it is the whole step.
    """
    while q.rough and step > SHORTEST * panel:
        q.gap[:] = 0.0
        for begin, share, sign in PARTS:
            for j in range(len(NODES)):
                evaluate_formulas(q, q.flight, instant(q, low + step * (begin + share * NODES[j]), flight))
                for c in range(len(q.gap)):
                    q.gap[c] += sign * share * WEIGHTS[j] * q.out[c, VALUE]
                    q.size[c] = max(q.size[c], abs(q.out[c, VALUE]))
        agree = True
        for c in range(len(q.gap)):
            summed = q.over[row, c] and not q.largest[q.at.shape[1] + c]
            agree = agree and not (summed and abs(q.gap[c]) > SMOOTH * q.size[c])
        if agree:
            break
        step *= 0.5
    return step


@inner
def over_panel(q, row, span, instant, flight, visit, context):
    """Call `visit(s, weight, context)` at the nodes of a panel of a flight, whose begin and length are in `span`.

    These are those of one rule, or of several where one does not give what two give (`length_of_rule`).
    """
    begin, length = span
    x, step = 0.0, length
    while x < length:
        step = length_of_rule(q, row, begin + x, min(step, length - x), length, instant, flight)
        for j in range(len(NODES)):
            visit(begin + x + step * NODES[j], step * WEIGHTS[j], context)
        x, step = x + step, 2.0 * step


@inner
def join_node(s, weight, context):
    """Join the values at a time of a flight."""
    q, row, instant, flight = context
    join_sample(q, row, instant(q, s, flight), s, weight)


@inner
def join_panels(q, row, time, instant, flight):
    """Join the values of a flight, or a part of one, of this time.

    `instant(q, s, flight)` writes the inputs at a time s and returns the phase.
    """
    first, (count, h) = q.at.shape[1], panels(q, time)
    q.peak[:], q.size[:] = -math.inf, 0.0
    join_sample(q, row, instant(q, 0.0, flight), 0.0, 0.0)
    for i in range(count):
        over_panel(q, row, (h * i, h), instant, flight, join_node, (q, row, instant, flight))
    join_sample(q, row, instant(q, time, flight), time, 0.0)
    for c in range(q.over.shape[1]):
        if q.over[row, c] and q.largest[first + c]:
            low, high = max(q.when[c] - BESIDE * h, 0.0), min(q.when[c] + BESIDE * h, time)
            join_value(q, first + c, highest(q, c, low, high, instant, flight))


@inner
def follow_batches(q, at, batches, limit, image_of, context):
    """Follow M states through the returns of all batches, from `at` on: whether all totals are known.

    `image_of(context, state, counts)` replaces a state by its image and returns its outcome, its time and what it costs; its
    values join the totals if it counts. The function returns as soon as costs reach the limit.
    """
    states, time, length, cost = batches.states, batches.time, batches.length, 0
    while at[STATE] < len(states):
        k = at[STATE]
        for i in range(at[RETURN], batches.discard + len(time) * length):
            b = (i - batches.discard) // length if i >= batches.discard else -1
            if b >= 0 and (i - batches.discard) % length == 0:
                begin_totals(q)
                time[b, k] = 0.0
            if i == 0 or not math.isnan(states[k, FIRST]):
                batches.outcome[k], taken, more = image_of(context, states[k], b >= 0)
                cost += more
                if b >= 0:
                    time[b, k] += taken
            if b >= 0 and (i - batches.discard) % length == length - 1:
                ended = math.isnan(states[k, FIRST])
                time[b, k] = math.nan if ended else time[b, k]
                for c in range(len(q.total)):
                    batches.totals[b, k, c] = math.nan if ended else q.total[c]
            at[RETURN] = i + 1
            if cost >= limit:
                return False
        at[STATE], at[RETURN] = k + 1, 0
    return True
