"""Derivatives of first returns by the parameters against differences of 60 digits, in many units."""

from types import SimpleNamespace

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from units import UNITS, Ball, Capsule, Oscillator, Units

SYSTEMS = {
    "ball": (Ball(g=1, a=1.9, w=1, r=0.6), [[2.0, 0.3], [3.1, 1.2], [0.9, 2.8], [1.7, 5.1]]),
    "capsule": (Capsule(d=0.3, g=0.2, f=1, w=3, r=0.5), [[0.8, 0.4], [0.5, 1.1], [0.3, 3.0], [0.7, 5.5]]),
    "oscillator": (Oscillator(zeta=0.1, k=1, w=2.1, a=1.5, wall=0.2, r=0.8), [[0.8, 0.4], [0.5, 2.1], [1.3, 4.0]]),
}


class Reference:
    """The return of one class along given walls, in as many digits as mpmath works with, from its formulas alone."""

    def __init__(self, cls):
        t, z, v, x = sp.symbols("_t _z _v _x", real=True)
        symbols = [sp.Symbol(name, positive=True) for name in cls.parameter_names()]
        system = cls.model_construct(**{str(symbol): symbol for symbol in symbols})
        place = system.displacement(x, SimpleNamespace(t=t, z=z, w=v))
        self.place, self.velocity = (
            sp.lambdify((x, t, z, v, *symbols), f, "mpmath", cse=True) for f in (place, sp.diff(place, x))
        )
        self.period = sp.lambdify(symbols, system.period(), "mpmath")
        self.walls = {name: (sp.lambdify(symbols, wall.at, "mpmath"), wall.side) for name, wall in system.walls().items()}
        self.r = [str(symbol) for symbol in symbols].index("r")

    def image(self, numbers, state, names, times):
        """Speed and phase at the last of the impacts, whose walls and times (about) are given; walls that lie behind are met."""
        phase = 2 * mp.pi / self.period(*numbers)
        start = now = state[1] / phase
        speed = state[0]
        for name, after, time in zip(names[:-1], names[1:], times[1:], strict=True):
            at, side = self.walls[name]
            flight = now, at(*numbers), -side * numbers[self.r] * speed, *numbers
            now = start + time
            for _ in range(5):  # from 15 digits
                now -= (self.place(now, *flight) - self.walls[after][0](*numbers)) / self.velocity(now, *flight)
            speed = self.walls[after][1] * self.velocity(now, *flight)
        return np.array([speed, now * phase])

    def by_parameters(self, system, state):
        """The derivatives of one return by each parameter, shape (M, 2)."""
        impacts = system.impacts(state, 20)
        last = 2 + int(np.flatnonzero(impacts.wall[1:] == 0)[0])
        names, times = [system.letters[k] for k in impacts.wall[:last]], impacts.time[:last]
        numbers, moves = [mp.mpf(value) for value in system.parameters.values()], []
        for k, value in enumerate(numbers):
            h = value * mp.mpf("1e-20")
            low, high = (self.image([*numbers[:k], value + d, *numbers[k + 1 :]], state, names, times) for d in (-h, h))
            moves.append(((high - low) / (2 * h)).astype(float))
        return np.array(moves)


@pytest.mark.parametrize("name", SYSTEMS)
def test_sensitivities_are_exact_in_all_units(name):
    plain, states = SYSTEMS[name]
    reference = Reference(type(plain))
    with mp.workdps(60):
        for units in [Units(1.0, 1.0), *(Units(*pair) for pair in UNITS)]:
            system, here = units.of(plain), units.states(states)
            assert system.first_return(here).certified.all()
            exact = np.array([reference.by_parameters(system, state) for state in here])
            got = np.stack([system.sensitivity(here, {key: 1.0}) for key in system.parameters], axis=1)
            off = np.abs(got - exact) / np.where(exact == 0, 1, np.abs(exact))  # what is exactly zero must be
            assert off.max() < 1e-12
