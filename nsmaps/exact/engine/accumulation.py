"""The time at which impacts on a wall accumulate.

C. Budd and F. Dux, Chattering and related behaviour in impact oscillators, Phil. Trans. R. Soc. A 347 (1994), to the order of the
acceleration; A. Nordmark and P. Piiroinen, Simulation and stability analysis of impacting systems with complete chattering,
Nonlinear Dynamics 58 (2009), to higher orders. Units are those of the system.
"""

from nsmaps.exact.engine.jit import inlined


@inlined
def accumulation_time(u, r, press):
    """The time after which impacts accumulate, to second order, from the speed u after one, at a constant acceleration.

    The acceleration `press` into the wall is positive, and each impact leaves the share r < 1 of the speed: flights take
    2 u/press, 2 r u/press, ..., a geometric series (Budd and Dux).
    """
    return 2.0 * u / (press * (1.0 - r))


@inlined
def corrected_time(x, r, press, jerk, held_jerk):
    """That time x to third order, where the acceleration changes: in flights at the rate `jerk`, held at the wall at `held_jerk`.

    The two are the same, and the correction is - jerk x^2/(3 press), if forces do not depend on the velocity.
    """
    change = jerk * (2.0 * r - 1.0) / 3 - held_jerk * r - (jerk - held_jerk) * r * (1.0 - r) / 2.0
    return x + x * x * change / (press * (1.0 + r))
