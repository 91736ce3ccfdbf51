"""A block of motions at their starts and through events, in loops that become vector instructions.

This holds for *plain* transitions: without contact or a reset by another formula, in systems without sliding. Arithmetic and
decisions are those of `nsmaps.exact.modes.march`.
"""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.constants import MOST_PHASE
from nsmaps.exact.engine.flight.remainders import wave
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.modes.blocks.series_block import weigh_row, write_rates
from nsmaps.exact.modes.blocks.tangents_block import begin_tangents, change_by_row, move_to_event
from nsmaps.exact.modes.blocks.workspace import AT, IN, ROW
from nsmaps.exact.modes.tables.taylor import ROUNDING

NONE = -1  # in place of a transition: none takes place
NOT_PLAIN = -2  # in place of a transition: to be decided for the motion by itself
TOO_SLOW = 10.0 * SUMMED_SPEED  # share of the largest acceleration at which a function falls that events may accumulate


@inner
def write_waves(p, n, b):
    """Write 1 and the waves of the phases of columns behind their states."""
    t, states = b.t, p.first.shape[1] - 1
    for m in range(1, (len(b.z) - states - 1) // 2 + 1):
        sines = states + 2 * m
        cosines = sines - 1
        for k in range(n):
            less, sine, _ = wave(m * t[AT.phase + k])
            b.z[cosines, k], b.z[sines, k] = 1.0 + less, sine


@inner
def check_conditions(p, e, n, b):
    """Write to `done` where the conditions of a transition hold, and to `unsure` where one is zero but for rounding."""
    t, after = b.t, e + 1
    for k in range(n):
        t[AT.done + k], t[AT.unsure + k] = 1.0, 0.0
    for c in range(p.conditions[e], p.conditions[after]):
        weigh_row(p.where[c], b.z, n, t)
        for k in range(n):
            t[AT.done + k] = t[AT.done + k] if t[AT.value + k] >= 0.0 else 0.0
            t[AT.unsure + k] = 1.0 if abs(t[AT.value + k]) <= ROUNDING * t[AT.slope + k] else t[AT.unsure + k]


@inner
def choose_transitions(p, mode, n, b):
    """Write which transitions take place where functions are zero, and whether they are doubtful; and the features' sizes."""
    t, h, following = b.t, b.h, mode + 1
    for k in range(n):
        h[IN.transition + k], t[AT.doubtful + k], t[AT.size + k] = NOT_PLAIN, 0.0, 0.0
    for j in range(len(b.z)):
        for k in range(n):
            t[AT.size + k] += abs(b.z[j, k])
    for f in range(p.watched[mode], p.watched[following]):
        if not p.plain[f]:
            continue
        for k in range(n):
            h[IN.transition + k] = NONE if h[IN.function + k] == f else h[IN.transition + k]
        after = f + 1
        for c in range(p.choices[after] - 1, p.choices[f] - 1, -1):
            e = p.chosen[c]
            check_conditions(p, e, n, b)
            for k in range(n):
                here, holds = h[IN.function + k] == f, t[AT.done + k] > 0.0
                later = 0.0 if holds else t[AT.doubtful + k]
                t[AT.doubtful + k] = max(later, t[AT.unsure + k]) if here else t[AT.doubtful + k]
                h[IN.transition + k] = e if here & holds else h[IN.transition + k]


@inner
def reset_states(p, e, n, b):
    """Change states, and their derivatives, by a transition in the columns that it takes place in."""
    states = p.first.shape[1] - 1 if p.moves[e] else 0
    for i in range(states):
        if p.jumps[e, i] or b.moved.here:
            change_by_row(p.resets[e], b.moved.resets[e] if b.moved.here else p.resets[e], i, n, b)
    for d in range(len(b.features)):
        for i in range(states):
            if p.jumps[e, i] or b.moved.here:
                for k in range(n):
                    b.features[d, i, k] = b.change[d, i, k] if b.h[IN.transition + k] == e else b.features[d, i, k]


@inner
def pass_events(p, mode, found, r, n, b):
    """Take columns through plain events; images before the reset are written, which no plain one of those after it is."""
    following = mode + 1
    choose_transitions(p, mode, n, b)
    if len(b.dz) > 0:
        move_to_event(p, mode, n, b)
    write_images(p, found, r, n, b)
    for f in range(p.watched[mode], p.watched[following]):
        after = f + 1
        for c in range(p.choices[f], p.choices[after] if p.plain[f] else p.choices[f]):
            reset_states(p, p.chosen[c], n, b)


@inner
def write_images(p, found, r, n, b):
    """Write the images of columns whose plain event is the section, and their derivatives, to return number r of a record."""
    following = r + 1
    for k in range(n):
        e, row = b.h[IN.transition + k], b.numbers[b.h[IN.motion + k], ROW]
        if e < 0 or not p.is_section[e]:
            continue
        image, tangent = found.states[following, row], found.tangents[r, row]
        for c in range(len(p.places)):
            image[c] = b.t[AT.phase + k] if p.places[c] < 0 else b.z[p.places[c], k]
            for d in range(len(b.dz)):
                tangent[c, d] = b.dphi[d, k] if p.places[c] < 0 else b.dz[d, p.places[c], k]


@inner
def mark_rising(p, e, n, b):
    """Mark the columns of a transition that cannot have come to the zero of its function, which rises there.

    Those whose function falls so slowly that its events may accumulate are marked too.
    """
    t, h, mode = b.t, b.h, p.mode[e]
    write_rates(p, mode, n, b)
    weigh_row(p.functions[p.function[e]], b.field, n, t)
    for k in range(n):
        rises = (h[IN.transition + k] == e) & (t[AT.value + k] > ROUNDING * t[AT.slope + k])
        h[IN.kind + k], t[AT.rate + k], t[AT.bend + k] = 1 if rises else h[IN.kind + k], t[AT.value + k], 0.0
    if p.bounces[e] < 0:
        return
    for j in range(len(b.z)):
        bend = TOO_SLOW * p.bends[p.bounces[e], j]
        for k in range(n):
            t[AT.bend + k] += bend * abs(b.z[j, k])
    longer = 1.0 / (p.rate * p.steps[mode]) if p.rate > 0.0 else 1.0
    for k in range(n):
        slow = (h[IN.transition + k] == e) & (abs(t[AT.rate + k]) <= longer * t[AT.bend + k])
        h[IN.kind + k] = 1 if slow else h[IN.kind + k]


@inner
def read_starts(p, found, r, row, n, b):
    """Write the phases, the waves and the coordinates of n starts from a row on; `kind` is 1 outside of the domain."""
    t, h, states, following = b.t, b.h, p.first.shape[1] - 1, r + 1
    for k in range(n):
        h[IN.kind + k], t[AT.phase + k], b.z[states, k] = 0, p.phase, 1.0
    for i in range(states):
        for k in range(n):
            b.z[i, k] = 0.0
    for c in range(len(p.places)):
        for k in range(n):
            x = found.states[r, row + k, c]
            found.states[following, row + k, c] = math.nan
            for d in range(len(b.dz)):
                found.tangents[r, row + k, c, d] = math.nan
            h[IN.kind + k] = h[IN.kind + k] if math.isfinite(x) else 1
            if p.places[c] >= 0:
                b.z[p.places[c], k] = x
            else:
                h[IN.kind + k] = h[IN.kind + k] if abs(x) <= MOST_PHASE else 1
                t[AT.phase + k] = x - math.floor(x / TWO_PI) * TWO_PI if h[IN.kind + k] == 0 else 0.0
    write_waves(p, n, b)


@inner
def begin_block(p, e, found, r, row, n, b):
    """Write features of n motions just after their starts, from a row on, by a plain transition; `kind` as `read_starts`.

    There is one start.
    """
    t, h, start = b.t, b.h, 0
    read_starts(p, found, r, row, n, b)
    for d in range(len(b.dz)):
        begin_tangents(p, d, n, b)
    for i in range(p.first.shape[1] - 1):
        change_by_row(p.states[start], b.moved.states[start] if b.moved.here else p.states[start], i, n, b)
    for d in range(len(b.features)):
        for i in range(p.first.shape[1] - 1):
            for k in range(n):
                b.features[d, i, k] = b.change[d, i, k]
    check_conditions(p, e, n, b)
    for k in range(n):
        h[IN.transition + k] = e
        h[IN.kind + k] = h[IN.kind + k] if (t[AT.done + k] > 0.0) | p.after else 1
    if not p.after:
        mark_rising(p, e, n, b)
        reset_states(p, e, n, b)
