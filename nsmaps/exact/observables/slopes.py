"""Derivatives of observables of first returns by the state and by parameters, for orbits without rest and chatter."""

import math
from typing import Any, NamedTuple

from nsmaps.exact.engine.constants import MOST_IMPACTS
from nsmaps.exact.engine.flight.derivatives import parameter_tangent_at, tangent_at
from nsmaps.exact.engine.flight.flow import angle, evaluate, on_top, phase_rate, rebound, wall_place
from nsmaps.exact.engine.jit import entry, inlined, inner
from nsmaps.exact.engine.returns import IMPACT, PHASE, SPEED, Impact, follow, phase_at
from nsmaps.exact.observables.flights import AT_PLACE, AT_VELOCITY, PLACE, V_AFTER, Flown, V, instant, row_of
from nsmaps.exact.observables.sums import BY_INPUT, VALUE, evaluate_formulas, over_panel, panels

BY_SPEED, BY_PHASE, BY_PARAMETERS = range(3)
OF_IMPACTS, OF_FLIGHTS = 3, 2  # inputs of formulas
AFTER = 0  # the row of `Directions.back` with the derivatives of the velocity after an impact


class Directions(NamedTuple):
    """What derivatives are carried in, along D directions."""

    way: Any  #: shape (P,), of the parameters
    d: Any  #: shape (inputs, D), of the inputs of formulas; of an impact system also of its state
    phase: Any  #: shape (D,), of the phase
    carried: Any  #: shape (2, D), of the state of an impact system: speed and phase
    back: Any  #: shape (inputs, D)
    moving: bool  #: whether the last direction, of an impact system, or all of them are those of the parameters


class Slopes(NamedTuple):
    """Where derivatives of totals are summed, and of what."""

    moved: Any  #: a Flow with the derivatives of all numbers of the table along the parameters
    q: Any  #: Quantities
    g: Any  #: Directions
    slopes: Any  #: shape (C, 3), of the totals by speed and phase of the start, and along the parameters


class Leg(NamedTuple):
    """A flight after an impact, and derivatives by the parameters."""

    row: int  #: of its wall in the tables of a plan
    phase: float  #: at the start
    place: float
    velocity: float
    place_p: float  #: derivative of the place
    speed_p: float  #: of the speed after the impact, that before it being fixed
    rate_p: float  #: of the rate of the phase


@inlined
def add_slopes(q, g, count, row, of_flights, weight, slopes):
    """Add the derivatives of formulas, which are written, times a weight; `count` inputs have the derivatives `g.d`."""
    rows, first = (q.over, q.at.shape[1]) if of_flights else (q.at, 0)
    by_phase = BY_INPUT + count
    by_parameters = by_phase + 1
    for c in range(rows.shape[1]):
        if rows[row, c]:
            explicit = 0.0
            for k in range(len(g.way)):
                explicit += q.out[c, by_parameters + k] * g.way[k]
            for j in range(len(g.phase)):
                total = q.out[c, by_phase] * g.phase[j]
                for i in range(count):
                    total += q.out[c, BY_INPUT + i] * g.d[i, j]
                if g.moving and j == len(g.phase) - 1:
                    total += explicit
                slopes[first + c, j] += weight * total


@inlined
def add_impact(sums, leg, impact, slope, speed_after):
    """Add the derivatives of an impact, at which the derivative of the impact law is `slope`."""
    _, q, g, slopes = sums
    q.y[V], q.y[V_AFTER], q.y[PLACE] = impact.speed, speed_after, leg.place
    for j in range(3):
        by = 1.0 if j == BY_PARAMETERS else 0.0
        g.d[V, j] = g.carried[SPEED, j]
        g.d[V_AFTER, j] = slope * g.carried[SPEED, j] + by * leg.speed_p
        g.d[PLACE, j] = by * leg.place_p
        g.phase[j] = g.carried[PHASE, j]
    evaluate_formulas(q, q.impact, impact.phase)
    add_slopes(q, g, OF_IMPACTS, leg.row, False, 1.0, slopes)


@inner
def add_instant(x, weight, context):
    """Add the derivatives at a time x of a flight, with `g.back` those of its velocity at the start."""
    p, sums, leg = context
    moved, q, g, slopes = sums
    at = angle(leg.phase)
    place_p, velocity_p = parameter_tangent_at(p, moved, at, leg.place, leg.place_p, leg.velocity, x)
    z_phi, z_w, v_phi, v_w = tangent_at(p, at, x)
    d, v, _, _, _, _ = evaluate(p, x)
    q.y[AT_PLACE], q.y[AT_VELOCITY] = leg.place + d, v
    for j in range(3):
        by, turned = (1.0 if j == BY_PARAMETERS else 0.0), g.carried[PHASE, j]
        g.d[AT_PLACE, j] = z_phi * turned + z_w * g.back[AFTER, j] + by * (leg.place_p + place_p)
        g.d[AT_VELOCITY, j] = v_phi * turned + v_w * g.back[AFTER, j] + by * velocity_p
        g.phase[j] = turned + by * leg.rate_p * x
    evaluate_formulas(q, q.flight, phase_at(p, leg.phase, x))
    add_slopes(q, g, OF_FLIGHTS, leg.row, True, weight, slopes)


@inner
def carry_to_impact(p, sums, leg, up, s):
    """Carry the derivatives of the state to the next impact, after a time s, and add those of the time of the flight."""
    moved, q, g, slopes = sums
    at = angle(leg.phase)
    place_p, velocity_p = parameter_tangent_at(p, moved, at, leg.place, leg.place_p, leg.velocity, s)
    z_phi, z_w, v_phi, v_w = tangent_at(p, at, s)
    d, velocity, a, _, _, _ = evaluate(p, s)
    into, wall_p, first = (1.0 if up else -1.0), wall_place(moved, up), q.at.shape[1]
    if q.flight != 0:
        q.y[AT_PLACE], q.y[AT_VELOCITY] = leg.place + d, velocity
        evaluate_formulas(q, q.flight, phase_at(p, leg.phase, s))
    for j in range(3):
        by, turned = (1.0 if j == BY_PARAMETERS else 0.0), g.carried[PHASE, j]
        dt = -(by * (leg.place_p - wall_p + place_p) + z_phi * turned + z_w * g.back[AFTER, j]) / velocity
        g.carried[SPEED, j] = into * (a * dt + by * velocity_p + v_phi * turned + v_w * g.back[AFTER, j])
        g.carried[PHASE, j] = turned + by * leg.rate_p * s + phase_rate(p) * dt
        for c in range(q.over.shape[1]):
            if q.over[leg.row, c]:
                slopes[first + c, j] += q.out[c, VALUE] * dt


@inner
def add_event(p, impact, event, sums, smooth):
    """The observer of derivatives: add those of an impact and of the flight after it; False after chatter or rest."""
    moved, q, g, _ = sums
    if event.ended != IMPACT or not smooth:
        return False
    z, z_p, into = wall_place(p, impact.up), wall_place(moved, impact.up), 1.0 if impact.up else -1.0
    u_p, _ = rebound(moved, impact.up, impact.speed)
    leg = Leg(row_of(p, impact.up), impact.phase, z, event.velocity, z_p, u_p, phase_rate(moved))
    if q.impact != 0:
        add_impact(sums, leg, impact, event.slope, -into * event.velocity)
    for j in range(3):
        g.back[AFTER, j] = -into * (event.slope * g.carried[SPEED, j] + (u_p if j == BY_PARAMETERS else 0.0))
    if q.flight != 0:
        count, h = panels(q, event.time)
        flown = Flown(p, z, impact.phase, event.time, True)
        for i in range(count):
            over_panel(q, leg.row, (h * i, h), instant, flown, add_instant, (p, sums, leg))
    carry_to_impact(p, sums, leg, event.up, event.time)
    return True


@entry
def observed_slopes(p, sums, states, chatter):
    """The derivatives of the totals of first returns (N, 2), where `sums` has the array of all slopes, shape (N, C, 3)."""
    moved, q, g, slopes = sums
    for i in range(len(states)):
        g.carried[:] = 0.0
        g.carried[SPEED, BY_SPEED], g.carried[PHASE, BY_PHASE] = 1.0, 1.0
        slopes[i] = 0.0
        impact = Impact(on_top(p), states[i, PHASE], states[i, SPEED])
        found, smooth = follow(p, impact, chatter, MOST_IMPACTS, add_event, Slopes(moved, q, g, slopes[i]), True)
        if math.isnan(found.phase) or not smooth:
            slopes[i] = math.nan
