"""Systems with flights in closed form, given by their equation of motion instead."""

import sympy as sp
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_vi_pair import VIPair


class Pair(VIPair):
    """The vibro-impact pair by its equation of motion."""

    def acceleration(self, t, place, velocity):
        return self.g_bar + sp.cos(sp.pi * t)


class Oscillator(ImpactOscillator):
    """The linear oscillator by its equation of motion."""

    def acceleration(self, t, place, velocity):
        return self.A * sp.cos(self.w * t) - 2 * self.zeta * velocity - place
