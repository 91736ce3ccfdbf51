"""The transition that takes place at an event, and how far a state is from one."""

from typing import NamedTuple

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import call_reset
from nsmaps.exact.modes.flights.laws import VALUE, parameter_column, slope_column
from nsmaps.exact.modes.flights.states import derive, dot, row_value, velocity
from nsmaps.exact.modes.tables.memory import END, RATE_ABOVE, RATE_BELOW, SURFACE
from nsmaps.exact.modes.tables.taylor import ROUNDING


class Conditions(NamedTuple):
    """The conditions of a transition."""

    satisfied: bool
    doubtful: bool  #: one of them is zero but for rounding


class Choice(NamedTuple):
    """The transition that takes place at an event."""

    transition: int  #: -1 for none
    doubtful: bool


@inner
def check_conditions(p, k, z, w):
    """The `Conditions` of a transition at features z, shape (N,)."""
    holds, doubtful = True, False
    for c in range(p.conditions[k], p.conditions[k + END]):
        value, size = row_value(p, p.where[c], z, w)
        holds = holds and value >= 0.0
        doubtful = doubtful or abs(value) <= ROUNDING * size
    return Conditions(holds, doubtful)


@inner
def transition_at(p, function, z, w):
    """The transition that takes place where a function is zero: a `Choice`."""
    unsure = False
    for c in range(p.choices[function], p.choices[function + END]):
        holds, doubtful = check_conditions(p, p.chosen[c], z, w)
        unsure = unsure or doubtful
        if holds:
            return Choice(p.chosen[c], unsure)
    return Choice(-1, unsure)


@inner
def away(p, start, w):
    """How far a state is from one at which the transition of a start takes place: its function is zero there, no other is below.

    Just after it none is below zero in the mode that follows, and of several events those of the start's surface are zero. The
    largest violation of this, as a share of the sizes of the function's terms and of its change within a longest step.
    """
    transition = p.starts[start]
    far, mode = 0.0, p.target[transition] if p.after else p.mode[transition]
    velocity(p, mode, w.z, w.field, w)
    for i in range(p.landings.shape[1]):
        value, size = dot(p.landings[start, i], w.z)
        size += abs(dot(p.landings[start, i], w.field).value)
        far = max(far, abs(value) / size if size > 0.0 else 0.0)
    for f in range(p.watched[mode], p.watched[mode + END]):
        value, size = row_value(p, p.functions[f], w.z, w)
        size += abs(dot(p.functions[f], w.field).value)
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
        call_reset(p.laws[k], phi, w.z.ctypes.data, p.parameters.ctypes.data, w.curved.ctypes.data)
        apply_law(p, k, w)
    for i in range(n):
        w.z[i] = w.new[i]
        for c in range(directions):
            w.dz[i, c] = w.slopes[i, c]
    derive(p, w.z, w)


@inner
def apply_law(p, k, w):
    """Take over what the compiled part of a reset has written."""
    own = p.own
    for i in range(own):
        if p.curved[k, i]:
            w.new[i] = w.curved[i, VALUE]
            for c in range(w.dz.shape[1]):
                w.slopes[i, c] = w.curved[i, slope_column(own)] * w.dphi[c]
                for j in range(own):
                    w.slopes[i, c] += w.curved[i, slope_column(j)] * w.dz[j, c]
                if w.moved.here:
                    for j in range(len(p.parameters)):
                        w.slopes[i, c] += w.curved[i, parameter_column(p, j)] * w.moved.parameters[j]


@inner
def is_repelled(p, mode, w):
    """Whether a state lies on a surface beside its mode, but for rounding, from which both fields lead away."""
    for s in range(len(p.surfaces)):
        if p.beside[s, mode]:
            value, size = row_value(p, p.surfaces[s, SURFACE], w.z, w)
            up, one = row_value(p, p.surfaces[s, RATE_ABOVE], w.z, w)
            down, other = row_value(p, p.surfaces[s, RATE_BELOW], w.z, w)
            if abs(value) <= ROUNDING * size and up > ROUNDING * one and down > ROUNDING * other:
                return True
    return False


@inner
def apply_transition(p, k, with_reset, phi, w):
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
def contact_distance(p, j, z):
    """How far a state is from lasting contact, as a share of the sizes of terms: from what the transition to it makes of it."""
    far = 0.0
    for i in range(p.own):
        value, size = dot(p.resets[j, i], z)
        if abs(value - z[i]) > far * (size + abs(z[i])):
            far = abs(value - z[i]) / (size + abs(z[i]))
    return far


@inner
def falling(p, k, w):
    """Whether the function of a transition does not rise, but for rounding, at the state before it."""
    velocity(p, p.mode[k], w.z, w.field, w)
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
    velocity(p, mode, w.z, w.field, w)
    for f in range(p.watched[mode], p.watched[mode + END]):
        own = p.on[transition, f] > 0 if p.after else f == p.function[transition]
        value, size = row_value(p, p.functions[f], w.z, w)
        rate, steep = dot(p.functions[f], w.field)
        if not own and abs(value) <= ROUNDING * size and rate < -ROUNDING * steep:
            count += 1
    return count
