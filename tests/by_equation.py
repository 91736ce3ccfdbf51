"""Systems with flights in closed form, given by their equation of motion instead, with a nonlinear term below rounding.

Without it their modes would be affine, and their flights power series in closed form.
"""

import sympy as sp
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_vi_pair import VIPair

TINY = sp.Rational(1, 10**40)


class Pair(VIPair):
    """The vibro-impact pair by its equation of motion."""

    def acceleration(self, t, place, velocity):
        return self.g_bar + sp.cos(sp.pi * t) + TINY * place**3


class Oscillator(ImpactOscillator):
    """The linear oscillator by its equation of motion."""

    def acceleration(self, t, place, velocity):
        return self.A * sp.cos(self.w * t) - 2 * self.zeta * velocity - place + TINY * place**3
