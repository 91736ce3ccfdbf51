"""What is observed along returns: words and derivatives by the state (first returns), by the parameters, and every impact."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.constants import MOST_IMPACTS
from nsmaps.exact.engine.flight.derivatives import parameter_tangent_at, tangent_at
from nsmaps.exact.engine.flight.flow import (
    angle,
    begin,
    evaluate,
    on_top,
    phase_rate,
    rebound,
    wall_place,
    walls_of,
)
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.returns import (
    CHATTER,
    ESCAPED,
    FOREVER,
    IMPACT,
    INVALID,
    PHASE,
    REST,
    SPEED,
    Impact,
    append_symbol,
    follow,
    phase_at,
)

BASE, OTHER = 1, 2  #: letters of the walls in a word's code
MARKS = 2  #: further letters of a word: chatter, rest


class Word(NamedTuple):
    """A word that grows; the letter of the last impacts is written when their row ends, once if it ends in chatter."""

    code: int  #: of what is written
    place_value: int  #: of the next letter; 0: the word is longer than a code holds
    letter: int  #: of the last impacts
    row: int  #: their number


class Path(NamedTuple):
    """What a first return has on its way."""

    word: Word
    derivative: tuple[float, float, float, float]  #: of (speed, phase) by the start, row by row


class FirstReturn(NamedTuple):
    """A first return; where there is none, its state is NaN, as in `Return`."""

    outcome: int
    speed: float
    phase: float
    turns: int
    time: float
    code: int  #: of the word, see `nsmaps.exact.words`
    derivative: tuple[float, float, float, float]  #: of (speed, phase) by the start, row by row


@inlined
def base_of(p):
    """The base of the codes of words, in which zero ends a word: one more than the number of letters."""
    has_up, has_down, _ = walls_of(p)
    return (2 if has_up and has_down else 1) + MARKS + 1


@inlined
def mark_of(base, ended):
    """The symbol of chatter or rest in words of this base."""
    return base - MARKS - 1 + ended


@inlined
def append_impact(word, base, same_wall, letter):
    """The word with an impact on the wall of the last one, or on the other."""
    if same_wall:
        return Word(word.code, word.place_value, word.letter, word.row + 1)
    code, place_value = append_symbol(word.code, word.place_value, base, word.letter, word.row)
    return Word(code, place_value, letter, 1)


@inlined
def append_rest(word, base, ended):
    """The word with chatter or rest on the wall of the last impact."""
    code, place_value = append_symbol(word.code, word.place_value, base, word.letter, 1)
    code, place_value = append_symbol(code, place_value, base, mark_of(base, ended), 1)
    return Word(code, place_value, word.letter, 0)


@inlined
def saltation(into, velocity, acceleration, by_speed, tangents, rate, d):
    """Carry the derivative d of (speed, phase) through an impact and the flight after it.

    With the displacement z(s; phi, w) of the flight, z = 0 at its end gives ds = -(z_phi dphi + z_w dw)/z', and from there
    dv = z'' ds + z'_phi dphi + z'_w dw: M. A. Aizerman and F. R. Gantmakher, On the stability of periodic motions, J. Appl. Math.
    Mech. 22 (1958). Here `into` is 1 on the upper wall and -1 on the lower, dw is `by_speed` times the derivative of the speed
    before the flight, `tangents` the result of `tangent_at` at its end, and `rate` that of the phase.
    """
    z_phi, z_w, v_phi, v_w = tangents
    v_by_v, v_by_phi, phi_by_v, phi_by_phi = d
    w_by_v, w_by_phi = by_speed * v_by_v, by_speed * v_by_phi
    slowness = -1.0 / velocity
    s_by_v = (z_phi * phi_by_v + z_w * w_by_v) * slowness
    s_by_phi = (z_phi * phi_by_phi + z_w * w_by_phi) * slowness
    return (
        into * (acceleration * s_by_v + v_phi * phi_by_v + v_w * w_by_v),
        into * (acceleration * s_by_phi + v_phi * phi_by_phi + v_w * w_by_phi),
        phi_by_v + rate * s_by_v,
        phi_by_phi + rate * s_by_phi,
    )


@inlined
def advance_tangent(p, impact, event, d):
    """Carry the derivative d of (speed, phase) through an impact and the flight after it, which `p` holds."""
    tangents = tangent_at(p, angle(impact.phase), event.time)
    _, velocity, acceleration, _, _, _ = evaluate(p, event.time)
    by_speed = -event.slope if impact.up else event.slope
    return saltation(1.0 if event.up else -1.0, velocity, acceleration, by_speed, tangents, phase_rate(p), d)


@inlined
def extend_path(p, impact, event, with_derivative, path):
    """The observer of first returns. After chatter and rest the motion does not depend on the start."""
    word, d = path.word, path.derivative
    if event.ended == IMPACT:
        word = append_impact(word, base_of(p), event.up == impact.up, BASE if event.up == on_top(p) else OTHER)
        if with_derivative:
            d = advance_tangent(p, impact, event, d)
    elif event.ended in (CHATTER, REST):
        word, d = append_rest(word, base_of(p), event.ended), (0.0, 0.0, 0.0, 0.0)
    return Path(word, d)


@inner
def first_return(p, v, phi, chatter, derivative):
    """The first return from an impact of speed v at phase phi on the base wall, with its derivative if it is asked for."""
    start = Path(Word(0, 1, BASE, 1), (1.0, 0.0, 0.0, 1.0))
    found, path = follow(p, Impact(on_top(p), phi, v), chatter, MOST_IMPACTS, extend_path, derivative, start)
    word, d = path.word, path.derivative
    code = 0 if found.outcome == INVALID else word.code
    if math.isnan(found.phase):
        d = (math.nan, math.nan, math.nan, math.nan)
    else:
        code, _ = append_symbol(word.code, word.place_value, base_of(p), word.letter, word.row)
    return FirstReturn(found.outcome, found.speed, found.phase, found.turns, found.time, code, d)


class Rows(NamedTuple):
    """The first n returns of M orbits."""

    states: Any  #: shape (n, M, 2)
    turns: Any  #: shape (n, M, 2)
    codes: Any  #: shape (n, M)
    outcome: Any  #: shape (n, M)
    time: Any  #: shape (n, M)
    tangents: Any  #: shape (n, M, 2, 2), or (0, M, 2, 2) without derivatives


@inner
def write_return(rows, i, k, found):
    """Write return number i of orbit k, the derivative if there are rows for it."""
    rows.outcome[i, k], rows.time[i, k], rows.codes[i, k] = found.outcome, found.time, found.code
    rows.states[i, k, SPEED], rows.states[i, k, PHASE] = found.speed, found.phase
    rows.turns[i, k, SPEED], rows.turns[i, k, PHASE] = 0, found.turns
    if len(rows.tangents):
        d = rows.tangents[i, k]
        d[SPEED, SPEED], d[SPEED, PHASE], d[PHASE, SPEED], d[PHASE, PHASE] = found.derivative


class Track(NamedTuple):
    """Arrays for at most n impacts of one trajectory, each of shape (n,)."""

    on_base: Any  #: True on the base wall
    time: Any  #: since the start
    phase: Any
    speed: Any
    mark: Any  #: how the event before each impact ended; of the last impact how the motion ends there, if it does


class Written(NamedTuple):
    """What is written of a trajectory."""

    number: int  #: of impacts
    time: float  #: of the last one, since the start


@inlined
def write_impact(p, impact, track, written):
    """Write an impact, at the time of `written`, behind those that are."""
    k = written.number
    track.on_base[k], track.time[k] = impact.up == on_top(p), written.time
    track.phase[k], track.speed[k] = impact.phase, impact.speed
    return Written(k + 1, written.time)


@inlined
def extend_track(p, impact, event, track, written):
    """The observer of trajectories."""
    if event.ended in (FOREVER, ESCAPED):
        last = written.number - 1
        track.mark[last] = event.ended
        return written
    track.mark[written.number] = event.ended
    following = Impact(event.up, phase_at(p, impact.phase, event.time), event.speed)
    return write_impact(p, following, track, Written(written.number, written.time + event.time))


@entry
def trajectory(p, impact, chatter, track):
    """Every impact of one trajectory, from an impact on any wall, written into a track; returns their number."""
    written, n = write_impact(p, impact, track, Written(0, 0.0)), len(track.time)
    while written.number < n:
        found, written = follow(p, impact, chatter, n - written.number, extend_track, track, written)
        if math.isnan(found.phase):
            break
        impact = Impact(on_top(p), found.phase, found.speed)
    return written.number


@entry
def sample_flight(p, impact, times, places, velocities):
    """Displacements and velocities at times after an impact, all of shape (N,), written into the given arrays."""
    u, _ = rebound(p, impact.up, impact.speed)
    begin(p, angle(impact.phase), wall_place(p, impact.up), -u if impact.up else u)
    for i in range(len(times)):
        places[i], velocities[i], _, _, _, _ = evaluate(p, times[i])


class ParameterTangent(NamedTuple):
    """The derivatives of the state along a direction of the parameters, the start being fixed."""

    speed: float
    phase: float
    smooth: bool  #: False after chatter or rest


@inner
def advance_parameters(p, impact, event, by_parameters, tangent):
    """The observer of sensitivities: the derivatives through an impact and the flight after it.

    The table of the flow `by_parameters` has the derivatives of all numbers of the table along the parameters.
    """
    if event.ended != IMPACT:
        return ParameterTangent(tangent.speed, tangent.phase, False)
    into, s, at = 1.0 if impact.up else -1.0, event.time, angle(impact.phase)
    z, z_p, wall_p = wall_place(p, impact.up), wall_place(by_parameters, impact.up), wall_place(by_parameters, event.up)
    u_p, _ = rebound(by_parameters, impact.up, impact.speed)
    place_p, velocity_p = parameter_tangent_at(p, by_parameters, at, z, z_p, event.velocity, s)
    w_p = -into * (event.slope * tangent.speed + u_p)
    z_phi, z_w, velocity_phi, velocity_w = tangent_at(p, at, s)
    _, velocity, a, _, _, _ = evaluate(p, s)
    s_p = -(z_p - wall_p + place_p + z_phi * tangent.phase + z_w * w_p) / velocity
    speed_p = (1.0 if event.up else -1.0) * (a * s_p + velocity_p + velocity_phi * tangent.phase + velocity_w * w_p)
    return ParameterTangent(speed_p, tangent.phase + (phase_rate(by_parameters) * s + phase_rate(p) * s_p), tangent.smooth)


@entry
def sensitivities(p, by_parameters, states, chatter, tangents):
    """The derivatives of the images of first returns (N, 2) along the parameters; NaN where they rest or have no image."""
    start = ParameterTangent(0.0, 0.0, True)
    for i in range(len(states)):
        impact = Impact(on_top(p), states[i, PHASE], states[i, SPEED])
        found, tangent = follow(p, impact, chatter, MOST_IMPACTS, advance_parameters, by_parameters, start)
        known = tangent.smooth and not math.isnan(found.phase)
        tangents[i, SPEED], tangents[i, PHASE] = tangent.speed if known else math.nan, tangent.phase if known else math.nan
