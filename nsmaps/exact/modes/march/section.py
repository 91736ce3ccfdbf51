"""The state at the section that coordinates give, and the transition that takes place at an event."""

import math

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import reset_by
from nsmaps.exact.engine.returns import MOST_PHASE
from nsmaps.exact.modes.march.flight import dot, shift_waves, velocity
from nsmaps.exact.modes.tables.taylor import ROUNDING, features

AS_NEAR = 16.0 * ROUNDING  # of the sizes of terms: surfaces from which a state is as far


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
def away(p, transition, w):
    """How far a state is from one at which a transition takes place: its function is zero there, no other one is below it.

    Just after it none is below zero in the mode that follows. The largest violation of this, as a share of the sizes of the
    function's terms and of its change within a longest step.
    """
    far, mode = 0.0, p.target[transition] if p.after else p.mode[transition]
    velocity(p, mode, w.z, w.field)
    for f in range(p.watched[mode], p.watched[mode + 1]):
        value, size = dot(p.functions[f], w.z)
        size += abs(dot(p.functions[f], w.field)[0])
        if p.after:
            wrong = -value if p.on[transition, f] == 0 else 0.0
        else:
            wrong = abs(value) if f == p.function[transition] else -value
        if wrong > far * size:
            far = wrong / size
    return far


@inner
def reset(p, k, phi, w):
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
                if w.moved.here:
                    w.slopes[i, c] += w.moved.resets[k, i, j] * w.z[j]
    if p.laws[k] != 0:
        reset_by(p.laws[k], phi, w.z.ctypes.data, p.parameters.ctypes.data, w.curved.ctypes.data)
        curved(p, k, w)
    for i in range(n):
        w.z[i] = w.new[i]
        for c in range(directions):
            w.dz[i, c] = w.slopes[i, c]


@inner
def curved(p, k, w):
    """Take over what the compiled part of a reset has written."""
    n = p.first.shape[1] - 1
    for i in range(n):
        if p.curved[k, i]:
            w.new[i] = w.curved[i, 0]
            for c in range(w.dz.shape[1]):
                w.slopes[i, c] = w.curved[i, n + 1] * w.dphi[c]
                for j in range(n):
                    w.slopes[i, c] += w.curved[i, 1 + j] * w.dz[j, c]
                if w.moved.here:
                    for j in range(len(p.parameters)):
                        w.slopes[i, c] += w.curved[i, n + 2 + j] * w.moved.parameters[j]


@inner
def repelled(p, mode, w):
    """Whether a state lies on a surface beside its mode, but for rounding, from which both fields lead away."""
    for s in range(len(p.surfaces)):
        if p.beside[s, mode]:
            value, size = dot(p.surfaces[s, 0], w.z)
            up, one = dot(p.surfaces[s, 1], w.z)
            down, other = dot(p.surfaces[s, 2], w.z)
            if abs(value) <= ROUNDING * size and up > ROUNDING * one and down > ROUNDING * other:
                return True
    return False


@inner
def enter(p, k, with_reset, phi, w):
    """Take the state through a transition, whose reset may lie behind it: the mode that follows."""
    if with_reset:
        reset(p, k, phi, w)
    for f in range(len(w.on)):
        w.on[f] = p.on[k, f]
    return p.target[k]


@inner
def contact_of(p, mode):
    """A transition with which the lasting contact of a mode begins, -1 of another mode."""
    for j in range(len(p.contacts)):
        if p.contacts[j] >= 0 and p.target[j] == mode:
            return j
    return -1


@inner
def lifted(p, j, z):
    """How far a state is from lasting contact, as a share of the sizes of terms: from what the transition to it makes of it."""
    far = 0.0
    for i in range(p.resets.shape[1]):
        value, size = dot(p.resets[j, i], z)
        if abs(value - z[i]) > far * (size + abs(z[i])):
            far = abs(value - z[i]) / (size + abs(z[i]))
    return far


@inner
def falling(p, k, w):
    """Whether the function of a transition does not rise, but for rounding, at the state before it."""
    velocity(p, p.mode[k], w.z, w.field)
    rate, size = dot(p.functions[p.function[k]], w.field)
    return rate <= ROUNDING * size


@inner
def seen_before(p, k):
    """Whether the state of a start is that just before its transition too: there is no reset, or sliding or contact ends."""
    return not p.after or not p.moves[k] or p.leaves[p.function[k]]


@inner
def below_after(p, transition, w):
    """How many functions are below zero just after the state of a transition: those crossed before, or zero and falling."""
    mode = p.target[transition] if p.after else p.mode[transition]
    count = p.below[mode]
    velocity(p, mode, w.z, w.field)
    for f in range(p.watched[mode], p.watched[mode + 1]):
        own = p.on[transition, f] > 0 if p.after else f == p.function[transition]
        value, size = dot(p.functions[f], w.z)
        rate, steep = dot(p.functions[f], w.field)
        if not own and abs(value) <= ROUNDING * size and rate < -ROUNDING * steep:
            count += 1
    return count


@inner
def begun(p, row, phi, w):
    """Write the features at the section that coordinates give; the number of the start, -1 for coordinates outside of the domain.

    Among several starts it is the one whose state lies nearest to its surface, or one in lasting contact that is pressed; of
    those that are as near it is one whose function falls, and of these the one in whose mode fewest clocks and other functions
    are below zero: they distinguish modes with one surface.
    """
    n, best, least, falls, fewest, given = p.first.shape[1] - 1, -1, math.inf, False, 0, w.other
    features(phi, w.z, n)
    for j in range(len(w.z)):
        given[j] = w.z[j] if j >= n else 0.0
    for c in range(len(p.places)):
        if p.places[c] >= 0:
            given[p.places[c]] = row[c]
    for k in range(len(p.starts)):
        for i in range(n):
            w.z[i], _ = dot(p.states[k, i], given)
        holds, _ = allowed(p, p.starts[k], w.z)
        far = away(p, p.starts[k], w) if len(p.starts) > 1 else 0.0
        j = contact_of(p, p.mode[p.starts[k]])
        if j >= 0:
            far = max(far, lifted(p, j, w.z))
            far = -1.0 if far <= 4.0 * ROUNDING else far
        same = seen_before(p, p.starts[k])
        down = not same or falling(p, p.starts[k], w)
        count = below_after(p, p.starts[k], w) if len(p.starts) > 1 else 0
        better = down > falls or (down == falls and count < fewest)
        if (holds or not same) and (far < least - AS_NEAR or (far <= least + AS_NEAR and better)):
            best, least, falls, fewest = k, far, down, count
            for i in range(n):
                w.new[i] = w.z[i]
    for i in range(n):
        w.z[i] = w.new[i]
    return best


@inner
def phase_of(p, row):
    """The phase that coordinates give, within a turn, without one that of the section; NaN outside of the domain."""
    phi = p.phase
    for c in range(len(p.places)):
        if not math.isfinite(row[c]):
            return math.nan
        if p.places[c] < 0:
            phi = row[c]
    return phi - math.floor(phi / TWO_PI) * TWO_PI if abs(phi) <= MOST_PHASE else math.nan


@inner
def launch(p, start, row, w):
    """Write how the features at a start change with the coordinates."""
    n, width, directions = p.first.shape[1] - 1, len(w.z), w.dz.shape[1]
    if w.moved.here:
        launch_moved(p, start, row, w)
        return
    for c in range(directions):
        w.dphi[c] = 1.0 if p.places[c] < 0 else 0.0
    shift_waves(w.z, w.dz, w.dphi, n)
    for c in range(directions):
        w.dz[n, c] = 0.0
        for i in range(n):
            if p.places[c] >= 0:
                w.dz[i, c] = p.states[start, i, p.places[c]]
            else:
                w.dz[i, c] = 0.0
                for j in range(n + 1, width):
                    w.dz[i, c] += p.states[start, i, j] * w.dz[j, c]


@inner
def launch_moved(p, start, row, w):
    """Write how the start changes with the parameters, at fixed coordinates."""
    n, width = p.first.shape[1] - 1, len(w.z)
    for j in range(n):
        w.other[j] = 0.0
    for c in range(len(p.places)):
        if p.places[c] >= 0:
            w.other[p.places[c]] = row[c]
    for j in range(n, width):
        w.other[j], w.dz[j, 0] = w.z[j], 0.0
    w.dphi[0] = w.moved.phase
    shift_waves(w.z, w.dz, w.dphi, n)
    for i in range(n):
        w.dz[i, 0], _ = dot(w.moved.states[start, i], w.other)
        for j in range(n + 1, width):
            w.dz[i, 0] += p.states[start, i, j] * w.dz[j, 0]


@inner
def starting(p, row, w):
    """The transition at the start, -1 for a row outside of the domain, and the phase within a turn; features are written."""
    phi = phase_of(p, row)
    start = -1 if math.isnan(phi) else begun(p, row, phi, w)
    if start < 0:
        return -1, 0.0
    launch(p, start, row, w)
    k = p.starts[start]
    j = contact_of(p, p.mode[k])
    if j >= 0:
        reset(p, j, phi, w)
    return (k, phi) if not seen_before(p, k) or falling(p, k, w) else (-1, 0.0)
