"""A block of motions in one mode, a column each: the pieces of their flights, in loops that become vector instructions.

Functions watched are looked at in the basis of Bernstein; those that have one zero, or a first one far from any doubt, are
followed to it by Newton's method, and every other one by `first_zero_of` of `flight.py`, a column by itself.
"""

from nsmaps.exact.engine.jit import fused, inner
from nsmaps.exact.modes.blocks.events_block import write_waves
from nsmaps.exact.modes.blocks.newton_block import find_zeros
from nsmaps.exact.modes.blocks.series_block import combine, evaluate_row
from nsmaps.exact.modes.blocks.tangents_block import write_wave_tangents
from nsmaps.exact.modes.blocks.workspace import AT, IN, PITCH, POINTS
from nsmaps.exact.modes.flights.motion import within_turn
from nsmaps.exact.modes.march.flight import first_zero_of
from nsmaps.exact.modes.tables.memory import NO_FUNCTION
from nsmaps.exact.modes.tables.taylor import AT_ONCE, EQUAL, ORDER, ROUNDING, TERMS

UNSURE = 2  # in place of a doubt: two functions may be zero at once, or the doubt be before the event


@fused
def count_signs(sign, n, t):
    """Write how many coefficients of `POINTS`, with a sign and shifted, are positive, how often signs change, and the least size.

    A first coefficient of zero has the sign of the second.
    """
    for k in range(n):
        value = sign * (t[POINTS + PITCH + k] if t[AT.at_zero + k] > 0.0 else t[POINTS + k]) + t[AT.shift + k]
        positive = 1.0 if value > 0.0 else 0.0
        t[AT.least + k], t[AT.changes + k], t[AT.positives + k], t[AT.slope + k] = abs(value), 0.0, positive, positive
    for i in range(ORDER // 3):
        first = POINTS + (1 + 3 * i) * PITCH
        second, third = first + PITCH, first + PITCH + PITCH
        for k in range(n):
            x, y, z = t[first + k], t[second + k], t[third + k]
            x, y, z = sign * x + t[AT.shift + k], sign * y + t[AT.shift + k], sign * z + t[AT.shift + k]
            up, then, last = 1.0 if x > 0.0 else 0.0, 1.0 if y > 0.0 else 0.0, 1.0 if z > 0.0 else 0.0
            t[AT.least + k] = min(min(t[AT.least + k], abs(x)), min(abs(y), abs(z)))
            t[AT.changes + k] += abs(up - t[AT.slope + k]) + abs(then - up) + abs(last - then)
            t[AT.positives + k] += up + then + last
            t[AT.slope + k] = last


@inner
def screen(p, f, n, b, w):
    """Write which columns have no zero of a function (0), one (1) or an unknown number (2).

    A function that differs from one before by its sign and a constant has the same coefficients, which are there already if
    it follows that.
    """
    t, h, sign, states = b.t, b.h, p.signs[f], p.first.shape[1] - 1
    constant = p.functions[f, states]
    if p.twins[f] == f:
        combine(p.shapes[f], (b.all_features, b.all_used), ORDER, POINTS, b.z, n, t)
    for k in range(n):
        t[AT.value + k], t[AT.slope + k] = 0.0, 0.0
    for j in range(len(w.z)):
        size, left = p.sizes[f, j], p.left[f, j]
        for k in range(n):
            t[AT.value + k] += size * abs(b.z[j, k])
            t[AT.slope + k] += left * abs(b.z[j, k])
    for k in range(n):
        t[AT.zero_terms + k] = p.on[h[IN.start + k], f] if h[IN.start + k] >= 0 else 0.0
    for k in range(n):
        start, size, terms = sign * t[POINTS + k], t[AT.value + k], t[AT.zero_terms + k]
        error = ROUNDING * size * (1.0 + t[AT.growth + k]) + t[AT.slope + k]
        on_surface = start + constant <= AT_ONCE * size if terms == 0.0 else terms == TERMS
        h[IN.doubtful + k] = UNSURE if on_surface & (h[IN.start + k] >= 0) else h[IN.doubtful + k]
        near = (start + constant >= 0.0) & (start + constant <= error)
        t[AT.error + k], t[AT.shift + k] = error, -start if terms > 0.0 else constant
        t[AT.at_zero + k] = 1.0 if (terms > 0.0) | near else 0.0
    count_signs(sign, n, t)
    for k in range(n):
        ups, sure = t[AT.positives + k], (t[AT.least + k] > t[AT.error + k]) & (t[AT.zero_terms + k] <= 1.0)
        one = (t[AT.changes + k] == 1.0) & (t[AT.slope + k] == 0.0) & (ups > 1.0)
        h[IN.kind + k] = (0 if ups == ORDER + 1.0 else 1 if one else 2) if sure else 2


@inner
def load_column(k, b, w):
    """Write a column to the memory of a single motion."""
    for j in range(len(w.z)):
        w.z[j] = b.z[j, k]
        for d in range(len(b.dz)):
            w.dz[j, d] = b.dz[d, j, k]
    for d in range(len(b.dz)):
        w.dphi[d] = b.dphi[d, k]


@inner
def store_column(k, b, w):
    """Write the memory of a single motion to a column."""
    for j in range(len(w.z)):
        b.z[j, k] = w.z[j]
        for d in range(len(b.dz)):
            b.dz[d, j, k] = w.dz[j, d]
    for d in range(len(b.dz)):
        b.dphi[d, k] = w.dphi[d]


@inner
def next_events(p, mode, n, b, w):
    """Write the first event of each column within a longest step: which function, when, and whether that is doubtful."""
    t, h, following = b.t, b.h, mode + 1
    for k in range(n):
        h[IN.function + k], t[AT.time + k], h[IN.doubtful + k] = NO_FUNCTION, 1.0, 0
    for f in range(p.watched[mode], p.watched[following]):
        screen(p, f, n, b, w)
        find_zeros(p, f, n, b)
        for k in range(n):
            if h[IN.kind + k] == 0:
                continue
            when = t[AT.time + k]
            near = 0.0 if h[IN.function + k] == NO_FUNCTION else EQUAL * when
            if h[IN.kind + k] == 2 or abs(t[AT.guess + k] - when) <= EQUAL * when:
                load_column(k, b, w)
                for g in range(len(w.on)):
                    w.on[g] = p.on[h[IN.start + k], g] if h[IN.start + k] >= 0 else 0
                found, x, unsure = first_zero_of(p, f, when + near, t[AT.growth + k], w)
            else:
                found, x, unsure = t[AT.guess + k] < when, t[AT.guess + k], False
            if found and h[IN.function + k] != NO_FUNCTION and abs(x - when) <= near:
                h[IN.doubtful + k] = UNSURE
            elif found:
                doubt = UNSURE if h[IN.doubtful + k] > 0 else 1 if unsure else 0
                h[IN.function + k], t[AT.time + k], h[IN.doubtful + k] = f, x, doubt
            elif unsure and h[IN.doubtful + k] == 0:
                h[IN.doubtful + k] = 1


@inner
def move(p, mode, n, b):
    """Move states and their derivatives to the times of columns, exp(Y tau) times them, and phases with their waves.

    Entries of exp(Y tau) - 1 are polynomials; those of some states are given less those of another one.
    """
    states = p.first.shape[1] - 1
    for d in range(len(b.dz)):
        write_wave_tangents(p, d, n, b)
        for k in range(n):
            b.dphi[d, k] += b.moved.rate * b.t[AT.time + k] * p.steps[mode]
    for q in range(states):
        write_change(p, mode, p.flow_order[mode, q], n, b)
    for i in range(states):
        for j in range(len(b.z) if b.moved.here else 0):
            row, last = b.moved.flows[mode, i, j], TERMS - 1
            while last >= 0 and row[last] == 0.0:
                last -= 1
            if last < 0:
                continue
            evaluate_row(row, last + 1, n, b.t)
            for d in range(1, len(b.features)):
                for k in range(n):
                    b.change[d, i, k] += b.t[AT.value + k] * b.z[j, k]
    for d in range(len(b.features)):
        for i in range(states):
            for k in range(n):
                b.features[d, i, k] += b.change[d, i, k]
    t, h = b.t, b.h
    for k in range(n):
        t[AT.phase + k], h[IN.windings + k] = within_turn(t[AT.phase + k] + p.rate * (t[AT.time + k] * p.steps[mode]))
    write_waves(p, n, b)


@inner
def write_change(p, mode, i, n, b):
    """Write the change of a state, and of its derivatives, without that of the flow with parameters."""
    (order, used), base, last = p.flow_features, p.flow_bases[mode, i], TERMS - 1
    for d in range(len(b.features)):
        for k in range(n):
            b.change[d, i, k] = b.change[d, base, k] if base != i else 0.0
    for number in range(len(b.z)):
        j = order[mode, i, number]
        while last >= 0 and used[mode, i, last] <= number:
            last -= 1
        if last < 0:
            break
        evaluate_row(p.flows[mode, i, j], last + 1, n, b.t)
        for d in range(len(b.features)):
            for k in range(n):
                b.change[d, i, k] += b.t[AT.value + k] * b.features[d, j, k]
