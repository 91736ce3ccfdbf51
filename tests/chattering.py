"""Systems with modes whose impacts accumulate; the bouncing ball's in 60 digits until then, and its flight from the release."""

from itertools import pairwise

import mpmath as mp
import numpy as np
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_two_masses import TwoMasses

from nsmaps import Guard
from nsmaps.dynamics import CompleteChatter


class Held(TwoMasses):
    """The first of two masses rests at its stop; its release depends on the second."""

    def guards(self, t, y):
        return {"I": Guard("free", self.d - y.x, reset={"v": -self.r * y.v}, rests="held")}


def flight(gamma, speed, phase, guess):
    """The ball's next impact, from the speed after one: impact speed and phase in the digits of mpmath, by Newton's method."""
    up, s, last, step = speed + gamma * mp.cos(phase), mp.mpf(guess), mp.inf, mp.mpf(guess)
    while abs(step) < last / 2:  # until rounding
        mean, last = 2 * gamma * mp.cos(phase + s / 2) * mp.sin(s / 2) / s, abs(step)  # of gamma cos over the flight
        step = (up - s / 2 - mean) / (mp.mpf(1) / 2 + (gamma * mp.cos(phase + s) - mean) / s)
        s += step
    return gamma * mp.cos(phase + s) - up + s, phase + s


def until_rest(gamma, r, v, phase, passed=None):
    """The phase at which impacts accumulate, or None where the table throws the ball off before; the impacts are listed."""
    with mp.workdps(60):
        gamma, r, v, phase = mp.mpf(gamma), mp.mpf(r), mp.mpf(v), mp.mpf(phase)
        while v > mp.mpf(10) ** -45:
            if passed is not None:
                passed.append((v, phase))
            u, press, rate = r * v, 1 - gamma * mp.sin(phase), -gamma * mp.cos(phase)
            if v > 0.01:
                guess = system_flight(gamma, float(u), float(phase))
            elif press**2 / 4 + 2 * rate * u / 3 < 0:  # no zero of u - press s/2 - rate s^2/6
                return None
            else:
                guess = 2 * u / (press / 2 + mp.sqrt(press**2 / 4 + 2 * rate * u / 3))
            v, phase = flight(gamma, u, phase, guess)
        return phase + 2 * r * v / (1 - gamma * mp.sin(phase)) / (1 - r)


def system_flight(gamma, speed, phase):
    """The time of a flight to few digits, by the map of a ball that loses no speed."""
    return float(BouncingBall(Gamma=float(gamma), r=1.0).first_return([[max(speed, 1e-9), phase]]).time[0])


def after_release(gamma):
    """Impact speed and phase of the flight from the release."""
    with mp.workdps(60):
        gamma = mp.mpf(gamma)
        release = mp.asin(1 / gamma)
        near = CompleteChatter(BouncingBall(Gamma=float(gamma), r=0.5)).first_return([[0.5, 3.0]])
        return flight(gamma, mp.mpf(0), release, float(near.lifted[0, 1] % (2 * np.pi) - release) % (2 * mp.pi))


def sums_to_rest(gamma, r):
    """Round the orbit with complete chatter: the loss, the sum of v cos(phi) over impacts, the integral of the gap over time."""

    def area(speed, phase, s):
        up, low = speed + gamma * mp.cos(phase), gamma * s * mp.sin(phase)
        return up * s**2 / 2 - s**3 / 6 + gamma * (mp.cos(phase + s) - mp.cos(phase)) + low

    with mp.workdps(60):
        gamma, r, impacts = mp.mpf(gamma), mp.mpf(r), []
        release = mp.asin(1 / gamma)
        first = after_release(gamma)
        until_rest(gamma, r, *first, impacts)
        loss = sum((1 - r**2) * v**2 / 2 for v, _ in impacts)
        wave = sum(v * mp.cos(phase) for v, phase in impacts)
        over = area(mp.mpf(0), release, first[1] - release) + sum(area(r * v, a, b - a) for (v, a), (_, b) in pairwise(impacts))
        return np.array([loss, wave, over])


def slopes_to_rest(gamma, r, by):
    """Their derivatives along a direction of gamma and r."""
    with mp.workdps(60):
        h = mp.mpf(10) ** -15
        ends = [sums_to_rest(gamma + sign * h * by[0], r + sign * h * by[1]) for sign in (-1, 1)]
        return ((ends[1] - ends[0]) / (2 * h)).astype(float)
