"""The derivatives of a flight at a fixed time: by phase, place and velocity at the start, and by the parameters."""

from nsmaps.exact.engine.flight.chains import chain_at
from nsmaps.exact.engine.flight.flow import begin, by_phase, evaluate, width_of
from nsmaps.exact.engine.flight.layout import (
    AT_CHAINS,
    AT_POWERS,
    AT_RATES,
    AT_TERMS,
    CHAIN,
    CHAIN_POWER,
    CHAINED,
    PLACE,
    POWERS,
    SIMPLE,
    SPEED,
    VELOCITY,
)
from nsmaps.exact.engine.flight.motion import pair
from nsmaps.exact.engine.flight.remainders import remainders
from nsmaps.exact.engine.jit import inlined, inner

BY_PHASE = -1  #: beside PLACE and VELOCITY, by which a flight has derivatives


@inlined
def by_feature(t, row, at, feature):
    """The derivative of a row by BY_PHASE, PLACE or VELOCITY."""
    return by_phase(t, row, at) if feature == BY_PHASE else t[row + feature]


@inner
def tangent_by(p, s, at, feature):
    """The derivatives of displacement and velocity at s by phase, place or velocity of the start: see `by_feature`."""
    t = p.table
    width, powers, plain = width_of(t), int(t[POWERS]), int(t[SIMPLE])
    begins, terms, rates = int(t[AT_POWERS]), int(t[AT_TERMS]), int(t[AT_RATES])
    d, v = (s, 1.0) if feature == VELOCITY else (0.0, 0.0)
    power = s
    for n in range(powers):
        x = by_feature(t, begins + n * width, at, feature)
        v += x * power
        power *= s / (n + 2)
        d += x * power
    less, zero = complex(0.0, 0.0), complex(0.0, 0.0)
    for i in range(plain + int(t[CHAINED])):
        x, y = by_feature(t, terms + 2 * i * width, at, feature), by_feature(t, terms + (2 * i + 1) * width, at, feature)
        alpha, omega = pair(t, rates, i)
        if i < plain:
            remainder_re, remainder_im, real, imaginary = remainders(alpha, omega, s)
            d += x * remainder_re + y * remainder_im
            if alpha == 0.0:
                v += omega * y * real + -omega * x * imaginary
            else:
                v += (alpha * x + omega * y) * real + (alpha * y - omega * x) * imaginary
        else:
            less = zero if t[int(t[AT_CHAINS]) + CHAIN * (i - plain) + CHAIN_POWER] == 0.0 else less
            _, from_zero, remainder = chain_at(p, i - plain, s)
            d += (complex(x, -y) * remainder).real
            v += (complex(x, -y) * (complex(alpha, omega) * from_zero + less)).real
            less = from_zero
    return d, v


@inner
def tangent_at(p, at, s):
    """d displacement/d phi, d displacement/d w, d velocity/d phi, d velocity/d w at fixed s."""
    d_phi, v_phi = tangent_by(p, s, at, BY_PHASE)
    d_w, v_w = tangent_by(p, s, at, VELOCITY)
    return d_phi, d_w, v_phi, v_w


@inner
def parameter_tangent_at(p, by_parameters, at, z, z_by_parameters, w, s):
    """Derivatives of displacement and velocity at fixed s along a direction of the parameters, on which the place depends too.

    The table of the flow `by_parameters` has the derivatives of the numbers of that of p.
    """
    begin(by_parameters, at, z, w)
    by_parameters.flight[SPEED] = 0.0  # the velocity of the start does not depend on the parameters here
    d, v, _, _, _, _ = evaluate(by_parameters, s)
    d_z, v_z = tangent_by(p, s, at, PLACE)
    return d + d_z * z_by_parameters, v + v_z * z_by_parameters
