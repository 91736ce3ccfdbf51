"""Derivatives of the image of a first return by the parameters, through every impact: exact, without finite differences."""

import math

from nsmaps.exact.engine.flight.flow import angle, evaluate, moves_at, phase_rate, rebound, tangent_at, wall_places, walls_of
from nsmaps.exact.engine.jit import entry, inner
from nsmaps.exact.engine.returns import IMPACT, MOST_IMPACTS, is_state, next_impact, onward


@inner
def sensitivity(p, moved, v, phi, chatter):
    """The derivatives of speed and phase of a first return by the parameters; NaN where it rests or has no image.

    The table `moved` holds the derivatives of all entries of the table of the system along a direction of the parameters.
    """
    base_up = walls_of(p)[2]
    v_p, phi_p, up = 0.0, 0.0, base_up
    if not is_state(v, phi):
        return math.nan, math.nan
    phi, _ = onward(p, phi, 0.0)
    for _ in range(MOST_IMPACTS):
        ended, now_up, s, now_v, _, slope, w = next_impact(p, up, phi, v, chatter)
        if ended != IMPACT:
            break
        into, now_into = 1.0 if up else -1.0, 1.0 if now_up else -1.0
        top, bottom = wall_places(p)
        z = top if up else bottom
        top_p, bottom_p = wall_places(moved)
        u_p, rate_p = rebound(moved, up, v)[0], phase_rate(moved)
        z_p, wall_p = top_p if up else bottom_p, top_p if now_up else bottom_p
        place_p, velocity_p = moves_at(p, moved, angle(phi), z, z_p, w, s)
        w_p = -into * (slope * v_p + u_p)
        z_phi, z_w, velocity_phi, velocity_w = tangent_at(p, angle(phi), s)
        _, velocity, a, _, _, _ = evaluate(p, s)
        s_p = -(z_p - wall_p + place_p + z_phi * phi_p + z_w * w_p) / velocity
        v_p = now_into * (a * s_p + velocity_p + velocity_phi * phi_p + velocity_w * w_p)
        phi_p += rate_p * s + phase_rate(p) * s_p
        phi, _ = onward(p, phi, s)
        v, up = now_v, now_up
        if up == base_up:
            return v_p, phi_p
    return math.nan, math.nan


@entry
def sensitivities(p, moved, states, chatter, moves):
    """The sensitivities of a batch, written into the given array."""
    for i in range(len(states)):
        moves[i, 0], moves[i, 1] = sensitivity(p, moved, states[i, 0], states[i, 1], chatter)
