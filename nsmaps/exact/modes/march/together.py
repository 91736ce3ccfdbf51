"""Two guards that are met at once: whether the order of their events matters."""

from nsmaps.exact.engine.jit import inner
from nsmaps.exact.engine.law import call_reset
from nsmaps.exact.modes.flights.laws import VALUE
from nsmaps.exact.modes.flights.states import derive, dot, row_value, velocity
from nsmaps.exact.modes.march.section import transition_at
from nsmaps.exact.modes.tables.memory import END
from nsmaps.exact.modes.tables.taylor import AT_ONCE

NOWHERE = -2  # in place of a mode: no event takes place


@inner
def just_after(p, k, phi, z, after, w):
    """Write the features just after a transition."""
    for j in range(len(z)):
        after[j] = z[j]
    if not p.moves[k]:
        return
    n = p.first.shape[1] - 1
    for i in range(n):
        after[i] = dot(p.resets[k, i], z).value
    if p.laws[k] != 0:
        call_reset(p.laws[k], phi, z.ctypes.data, p.parameters.ctypes.data, w.curved.ctypes.data)
        for i in range(n):
            after[i] = w.curved[i, VALUE] if p.curved[k, i] else after[i]
    derive(p, after, w)


@inner
def same_function(p, function, mode):
    """The function that is watched in a mode and is the same as one of another mode, -1 for none."""
    for f in range(p.watched[mode], p.watched[mode + END]):
        same = True
        for j in range(p.functions.shape[1]):
            same = same and p.functions[f, j] == p.functions[function, j]
        if same:
            return f
    return -1


@inner
def function_due(p, function, mode, z, falling, w):
    """The function in a mode that is the same as one of another mode, if it is zero and falls, or else rises; -1 for none."""
    f = same_function(p, function, mode) if mode >= 0 else -1
    if f < 0:
        return -1
    value, size = row_value(p, p.functions[f], z, w)
    velocity(p, mode, z, w.field, w)
    rate, _ = dot(p.functions[f], w.field)
    return f if abs(value) <= AT_ONCE * (size + abs(rate)) and (rate < 0.0) == falling else -1


@inner
def in_order(p, first, second, phi, after, w):
    """Write the features after the event of one function and, if it is then due, that of another; the mode that follows."""
    k, _ = transition_at(p, first, w.z, w)
    if k < 0:
        return NOWHERE
    just_after(p, k, phi, w.z, after, w)
    mode = p.target[k]
    f = function_due(p, second, mode, after, True, w)
    k = transition_at(p, f, after, w).transition if f >= 0 else -1
    if k < 0:
        return mode
    for j in range(len(after)):
        w.other[j] = after[j]
    just_after(p, k, phi, w.other, after, w)
    return p.target[k]


@inner
def same_image(p, function, other, phi, w):
    """Whether the section, met where a function is zero, has the same image before and after the event of another one."""
    k, m = transition_at(p, function, w.z, w).transition, transition_at(p, other, w.z, w).transition
    n = p.first.shape[1] - 1
    just_after(p, m, phi, w.z, w.one, w)
    f = function_due(p, function, p.target[m], w.one, True, w)
    j = transition_at(p, f, w.one, w).transition if f >= 0 else -1
    if j < 0 or not p.is_section[j]:
        return False
    for i in range(n):
        w.two[i], w.other[i] = w.z[i], w.one[i]
    if p.after:
        just_after(p, k, phi, w.z, w.two, w)
        just_after(p, j, phi, w.one, w.other, w)
    for c in range(len(p.places)):
        i = p.places[c]
        if i >= 0 and abs(w.two[i] - w.other[i]) > AT_ONCE * (abs(w.z[i]) + abs(w.two[i]) + abs(w.other[i])):
            return False
    return True


@inner
def order_matters(p, one, two, phi, w):
    """Whether two functions that are zero at once lead to different images, states or modes, by which event is first."""
    k, m = transition_at(p, one, w.z, w).transition, transition_at(p, two, w.z, w).transition
    if k >= 0 and m >= 0 and p.is_section[k] != p.is_section[m]:
        return not (same_image(p, one, two, phi, w) if p.is_section[k] else same_image(p, two, one, phi, w))
    if in_order(p, one, two, phi, w.one, w) != in_order(p, two, one, phi, w.two, w):
        return True
    for i in range(p.first.shape[1] - 1):
        size = abs(w.z[i]) + abs(w.one[i]) + abs(w.two[i])
        if abs(w.one[i] - w.two[i]) > AT_ONCE * size:
            return True
    return False
