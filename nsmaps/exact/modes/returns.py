"""First returns of a system with modes: from event to event until the section is met again, with derivatives through every event."""

import math
from typing import Any, NamedTuple

import numpy as np

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.modes.taylor import ORDER, ROUNDING, features, left_out, project, reach, series, state_at
from nsmaps.exact.modes.zeros import first_zero

MOST_EVENTS = 100_000  # of one return
MOST_PIECES = 1_000_000  # Taylor series of one flight
FARTHEST_PHASE = 1e10  # beyond, a phase has lost its digits
HIGHEST_CODE = 2**62
RETURNED, ESCAPED, UNDECIDED, INVALID = 0, 3, 4, 6  # of `nsmaps.exact.outcome.Outcome`
NO_FUNCTION = -1


class Room(NamedTuple):
    """Memory that a return works in; D directions of derivatives."""

    z: Any  #: shape (N,), features of the state
    dz: Any  #: shape (N, D)
    dphi: Any  #: shape (D,)
    d: Any  #: shape (ORDER + 2, N), Taylor series of the state
    e: Any  #: the same, of a derivative
    a: Any  #: shape (ORDER + 1,), of a function
    field: Any  #: shape (N,)
    on: Any  #: shape (S,), whether each function is zero at the start of the flight
    other: Any  #: shape (N,)
    new: Any  #: shape (n,)
    slopes: Any  #: shape (n, D)


def room(p: Any, directions: int) -> Room:
    """Memory for the returns of one thread."""
    n, width, series_of = p.first.shape[1] - 1, p.resets.shape[2], (ORDER + 2, p.resets.shape[2])
    flat = [np.zeros(width), np.zeros((width, directions)), np.zeros(directions), np.zeros(series_of), np.zeros(series_of)]
    more = [np.zeros(ORDER + 1), np.zeros(width), np.zeros(len(p.functions), bool), np.zeros(width)]
    return Room(*flat, *more, np.zeros(n), np.zeros((n, directions)))


@inner
def dot(row, z):
    """The value of a row, and the sum of the sizes of its terms."""
    total, size = 0.0, 0.0
    for j in range(len(z)):
        term = row[j] * z[j]
        total += term
        size += abs(term)
    return total, size


@inner
def velocity(p, mode, z, field):
    """Write dz/dt in the time unit of the mode."""
    n, turn = p.first.shape[1] - 1, p.rate * p.steps[mode]
    for i in range(n):
        total = 0.0
        for j in range(p.first[mode, i], p.first[mode, i + 1]):
            total += p.values[j] * z[p.columns[j]]
        field[i] = total
    field[n] = 0.0
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        field[c], field[c + 1] = -m * turn * z[c + 1], m * turn * z[c]


@inner
def allowed(p, k, z):
    """Whether the conditions of a transition hold, and whether one of them is zero but for rounding."""
    holds, doubtful = True, False
    for c in range(p.conditions[k], p.conditions[k + 1]):
        value, size = dot(p.where[c], z)
        holds = holds and value >= 0.0
        doubtful = doubtful or abs(value) <= ROUNDING * size
    return holds, doubtful


@inner
def picked(p, function, z):
    """The transition that takes place where a function is zero, -1 for none, and whether that is doubtful."""
    unsure = False
    for c in range(p.choices[function], p.choices[function + 1]):
        holds, doubtful = allowed(p, p.chosen[c], z)
        unsure = unsure or doubtful
        if holds:
            return p.chosen[c], unsure
    return -1, unsure


@inner
def begun(p, row, w):
    """Write the state at the section that coordinates give; the transition that is there, -1 where the coordinates are no state."""
    n, phi = p.first.shape[1] - 1, 0.0
    for c in range(len(p.places)):
        if not math.isfinite(row[c]):
            return -1
        if p.places[c] < 0:
            phi = row[c]
    if abs(phi) > FARTHEST_PHASE:
        return -1
    best, least, made, state = -1, math.inf, w.other, w.new
    for k in range(len(p.starts)):
        for j in range(n):
            made[j] = 0.0
        for c in range(len(p.places)):
            if p.places[c] >= 0:
                made[p.places[c]] = row[c]
        features(p, phi, made, n)
        for i in range(n):
            state[i], _ = dot(p.states[k, i], made)
        for i in range(n):
            made[i] = state[i]
        far = abs(away(p, p.starts[k], made))
        holds, _ = allowed(p, p.starts[k], made)
        if (holds or p.after) and far < least:
            best, least = p.starts[k], far
            for j in range(len(made)):
                w.z[j] = made[j]
    return best


@inner
def away(p, transition, z):
    """The function of a transition at a state, as a share of the sizes of its terms."""
    function = function_of(p, transition)
    value, size = dot(p.functions[function], z)
    return value / size if size > 0.0 else 0.0


@inner
def function_of(p, transition):
    """The function that is watched for a transition."""
    for function in range(len(p.choices) - 1):
        for c in range(p.choices[function], p.choices[function + 1]):
            if p.chosen[c] == transition:
                return function
    return NO_FUNCTION


@inner
def mode_of(p, function):
    """The mode in which a function is watched."""
    mode = 0
    while p.watched[mode + 1] <= function:
        mode += 1
    return mode


@inner
def reset(p, k, w):
    """Write the state just after a transition, and its derivatives; columns of `dz` are directions."""
    n, directions = p.first.shape[1] - 1, w.dz.shape[1]
    if not p.moves[k]:
        return
    for i in range(n):
        w.new[i], _ = dot(p.resets[k, i], w.z)
        for c in range(directions):
            w.slopes[i, c] = 0.0
            for j in range(len(w.z)):
                w.slopes[i, c] += p.resets[k, i, j] * w.dz[j, c]
    for i in range(n):
        w.z[i] = w.new[i]
        for c in range(directions):
            w.dz[i, c] = w.slopes[i, c]


@inner
def shift_waves(p, z, dz, dphi, n):
    """Write the derivatives of the waves of the phase by the directions."""
    for m in range(1, (len(z) - n - 1) // 2 + 1):
        c = n + 2 * m - 1
        for k in range(dz.shape[1]):
            dz[c, k], dz[c + 1, k] = -m * z[c + 1] * dphi[k], m * z[c] * dphi[k]


@inner
def carried(p, mode, tau, dz, d):
    """Carry derivatives by tau along the flow of a mode."""
    n = p.first.shape[1] - 1
    for c in range(dz.shape[1]):
        for j in range(dz.shape[0]):
            d[0, j] = dz[j, c]
        series(p, mode, d)
        for j in range(dz.shape[0]):
            total = d[ORDER, j]
            for k in range(ORDER - 1, -1, -1):
                total = total * tau + d[k, j]
            dz[j, c] = total


@inner
def next_event(p, mode, on, d, a, end):
    """The first function of a mode that is zero within a series: (which, -1 for none, when, whether doubtful)."""
    which, when, doubtful = NO_FUNCTION, end, False
    for f in range(p.watched[mode], p.watched[mode + 1]):
        project(p, f, d, a)
        if on[f]:
            a[0] = 0.0
        found, x, unsure = first_zero(a, when, left_out(p, f, d, when), on[f])
        if found:
            close = which != NO_FUNCTION and when - x <= 4.0 * ROUNDING * when
            which, when, doubtful = f, x, unsure or close
        else:
            doubtful = doubtful or unsure
    return which, when, doubtful


@inner
def saltation(p, mode, function, z, dz, dphi, field):
    """Take derivatives at a fixed time to derivatives at the event."""
    velocity(p, mode, z, field)
    slope, _ = dot(p.functions[function], field)
    n, turn = p.first.shape[1] - 1, p.rate * p.steps[mode]
    for c in range(dz.shape[1]):
        moved = 0.0
        for j in range(len(z)):
            moved += p.functions[function, j] * dz[j, c]
        dt = -moved / slope
        for j in range(len(z)):
            dz[j, c] += field[j] * dt
        dphi[c] += turn * dt


@inner
def launch(p, k, row, phi, w):
    """Write the features at the start, and how they change with the coordinates."""
    n, width, directions = p.first.shape[1] - 1, len(w.z), w.dz.shape[1]
    features(p, phi, w.z, n)
    for c in range(directions):
        w.dphi[c] = 1.0 if p.places[c] < 0 else 0.0
    shift_waves(p, w.z, w.dz, w.dphi, n)
    for c in range(directions):
        w.dz[n, c] = 0.0
        for i in range(n):
            if p.places[c] >= 0:
                w.dz[i, c] = state_slope(p, k, i, p.places[c])
            else:
                w.dz[i, c] = 0.0
                for j in range(n + 1, width):
                    w.dz[i, c] += state_slope(p, k, i, j) * w.dz[j, c]


@inner
def state_slope(p, transition, i, feature):
    """The derivative of a state at the section by a feature."""
    for k in range(len(p.starts)):
        if p.starts[k] == transition:
            return p.states[k, i, feature]
    return 0.0


@inner
def fly(p, mode, phi, w):
    """To the next event: (its function, -1 for none within the horizon; time; phase; whole turns; whether it is doubtful)."""
    n, directions, flight, turns, doubtful = p.first.shape[1] - 1, w.dz.shape[1], 0.0, 0, False
    for _ in range(MOST_PIECES):
        features(p, phi, w.z, n)
        for j in range(len(w.z)):
            w.d[0, j] = w.z[j]
        series(p, mode, w.d)
        which, tau, unsure = next_event(p, mode, w.on, w.d, w.a, reach(p, mode, w.d))
        doubtful = doubtful or unsure
        state_at(w.d, tau, n, w.z)
        if directions > 0:
            shift_waves(p, w.d[0], w.dz, w.dphi, n)
            carried(p, mode, tau, w.dz, w.e)
        step = tau * p.steps[mode]
        flight += step
        phi += p.rate * step
        if phi >= TWO_PI:
            more = math.floor(phi / TWO_PI)
            phi, turns = max(phi - more * TWO_PI, 0.0), turns + more
        if which != NO_FUNCTION or flight >= p.horizon:
            features(p, phi, w.z, n)
            return which, flight, phi, turns, doubtful
        for f in range(p.watched[mode], p.watched[mode + 1]):
            w.on[f] = False
    return NO_FUNCTION, flight, phi, turns, True


@inner
def enter(p, k, w):
    """Take the state through a transition: the mode that follows."""
    reset(p, k, w)
    for f in range(len(w.on)):
        w.on[f] = p.on[k, f]
    return p.target[k]


@inner
def spelled(p, k, code, power):
    """A word with the letter of a transition behind it, and the place of the next letter; below zero where it holds no more."""
    if p.digit[k] == 0 or code < 0:
        return code, power
    if power > HIGHEST_CODE // p.base:
        return -code, power
    return code + p.digit[k] * power, power * p.base


@inner
def starting(p, row, w):
    """The transition at the start, -1 where the row is no state, its phase within a turn, and the whole turns; features written."""
    k, phi = begun(p, row, w), 0.0
    if k < 0:
        return -1, 0.0, 0
    for c in range(len(p.places)):
        if p.places[c] < 0:
            phi = row[c]
    whole = math.floor(phi / TWO_PI)
    phi -= whole * TWO_PI
    launch(p, k, row, phi, w)
    if not p.after:
        f = function_of(p, k)
        velocity(p, mode_of(p, f), w.z, w.field)
        rate, size = dot(p.functions[f], w.field)
        if rate > ROUNDING * size:
            return -1, 0.0, 0
    return k, phi, whole


@inner
def first_return(p, row, image, tangent, w):
    """The first return of a row of coordinates: (outcome, code of its word, time, whole turns of the phase)."""
    k, phi, start = starting(p, row, w)
    for c in range(len(image)):
        image[c] = math.nan
        for j in range(w.dz.shape[1]):
            tangent[c, j] = math.nan
    if k < 0:
        return INVALID, 0, math.nan, 0
    code, power = spelled(p, k, 0, 1)
    if p.after:
        mode = p.target[k]
        for f in range(len(w.on)):
            w.on[f] = p.on[k, f]
    else:
        mode = enter(p, k, w)
    time, turns, doubtful = 0.0, 0, False
    for _ in range(MOST_EVENTS):
        which, flight, phi, more, unsure = fly(p, mode, phi, w)
        time, turns, doubtful = time + flight, turns + more, doubtful or unsure
        if which == NO_FUNCTION:
            return ESCAPED, code, math.nan, 0
        k, unsure = picked(p, which, w.z)
        doubtful = doubtful or unsure
        if k < 0:
            return UNDECIDED, code, math.nan, 0
        if w.dz.shape[1] > 0:
            shift_waves(p, w.z, w.dz, w.dphi, p.first.shape[1] - 1)
            saltation(p, mode, which, w.z, w.dz, w.dphi, w.field)
        code, power = spelled(p, k, code, power)
        if p.target[k] < 0:
            return ESCAPED, code, time, 0
        if p.is_section[k] and not p.after:
            break
        mode = enter(p, k, w)
        if p.is_section[k]:
            break
    else:
        return UNDECIDED, code, math.nan, 0
    for c in range(len(p.places)):
        image[c] = phi if p.places[c] < 0 else w.z[p.places[c]]
        for j in range(w.dz.shape[1]):
            tangent[c, j] = w.dphi[j] if p.places[c] < 0 else w.dz[p.places[c], j]
    return UNDECIDED if doubtful else RETURNED, code, time, turns


@entry
def first_returns(p, starts, image, turns, codes, outcome, time, tangents, w):
    """First returns of a batch, written row by row; derivatives where there is room for them."""
    for r in range(len(starts)):
        slopes = tangents[r if w.dz.shape[1] > 0 else 0]
        outcome[r], codes[r], time[r], whole = first_return(p, starts[r], image[r], slopes, w)
        for c in range(len(p.places)):
            turns[r, c] = whole if p.places[c] < 0 else 0
