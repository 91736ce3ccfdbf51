"""Polish the cycles of tests/data/cycles.json in 60 digits, check each by the equations of motion, and write the file anew.

Run by hand, `python docs/benchmarks/make_cycles.py`; it takes half a minute. The file's own states are the guesses, from which
nsmaps gives the order and rough times of the impacts; all else is made here: Z'' = cos(pi t) + g_bar between walls at -d/2 (T)
and d/2 (B), and an impact that is left with r times the speed with which it was met. The unknowns are the times of all impacts of
a cycle, in which nothing is singular at a graze.
"""

import json
from itertools import pairwise
from math import pi
from pathlib import Path

import mpmath as mp
from nsmaps_vi_pair import VIPair

mp.mp.dps = 60
FILE = Path(__file__).parents[2] / "tests" / "data" / "cycles.json"
D, R = mp.mpf("0.35"), mp.mpf("0.5")
G = mp.mpf("0.1245") * mp.mpf("9.8") * mp.sin(mp.pi / 3) / 5
SIZE = mp.mpf(10) ** -50


class Flight:
    """From the wall at z0 at time a to the wall at z1 at time b."""

    def __init__(self, a, z0, b, z1):
        self.a, self.z0, self.b, x = a, z0, b, b - a
        mean = (z1 - z0 - G * x * x / 2 + (mp.cos(mp.pi * b) - mp.cos(mp.pi * a)) / mp.pi**2) / x
        start, end = mp.sin(mp.pi * a) / mp.pi, mp.sin(mp.pi * b) / mp.pi
        self.left, self.met = start + mean, mean + G * x + end
        by_a, by_b = (G * x + start + mean) / x, -(G * x + end + mean) / x  # of the mean
        self.left_by = mp.cos(mp.pi * a) + by_a, by_b
        self.met_by = by_a - G, by_b + G + mp.cos(mp.pi * b)

    def velocity(self, t):
        return self.left - mp.sin(mp.pi * self.a) / mp.pi + G * (t - self.a) + mp.sin(mp.pi * t) / mp.pi

    def place(self, t):
        x, drift = t - self.a, self.left - mp.sin(mp.pi * self.a) / mp.pi
        return self.z0 + drift * x + G * x * x / 2 - (mp.cos(mp.pi * t) - mp.cos(mp.pi * self.a)) / mp.pi**2

    def checked(self):
        """Leaves inwards, arrives outwards, and at every turning point is between the walls."""
        assert self.left * self.z0 < 0
        assert self.place(self.b) * self.met > 0
        zero, first = mp.acos(-G) / mp.pi, int(mp.floor(self.a / 2)) - 1
        cuts = [s * zero + 2 * k for k in range(first, int(mp.floor(self.b / 2)) + 3) for s in (1, -1)]  # where Z'' vanishes
        ends = [self.a, *sorted(t for t in cuts if self.a < t < self.b), self.b]
        for low, high in pairwise(ends):
            if self.velocity(low) * self.velocity(high) < 0:
                turn = mp.findroot(self.velocity, (low, high), solver="anderson", tol=1e-45)
                assert low <= turn <= high
                assert abs(self.place(turn)) < D / 2

    def derivative(self):
        """Of (velocity met, its time) by (velocity left, its time)."""
        x, force = self.b - self.a, G + mp.cos(mp.pi * self.b)
        by_t = -(mp.cos(mp.pi * self.a) + G) * x - self.left  # of the place at a time b
        rate = -(mp.cos(mp.pi * self.a) + G)
        return mp.matrix([[1 - force * x / self.met, rate - force * by_t / self.met], [-x / self.met, -by_t / self.met]])


def flights(times, places, turns):
    """One from each impact to the next, the last to the first a number of periods later."""
    later = [*times[1:], times[0] + 2 * turns]
    return [Flight(a, z, b, y) for a, z, b, y in zip(times, places, later, [*places[1:], places[0]], strict=True)]


def solved(times, places, turns):
    """The flights of a cycle, by Newton's method in the times of its impacts."""
    n = len(times)
    for _ in range(30):
        made = flights(times, places, turns)
        jacobian = mp.zeros(n)
        for i in range(n):
            before, here = made[i - 1], made[i]
            jacobian[i, i] += here.left_by[0] + R * before.met_by[1]
            jacobian[i, (i + 1) % n] += here.left_by[1]
            jacobian[i, i - 1 if i else n - 1] += R * before.met_by[0]
        step = mp.lu_solve(jacobian, mp.matrix([-made[i].left - R * made[i - 1].met for i in range(n)]))
        times = [t + s for t, s in zip(times, step, strict=True)]
        if max(abs(s) for s in step) < SIZE:
            return flights(times, places, turns)
    raise ArithmeticError("Newton's method does not converge")


def polished(system, row):
    """The row of a cycle with the digits of its state and multipliers anew."""
    walls = "".join(word[:-1] for word in row["words"].split())  # of all impacts, the first on B
    rough = system.impacts([float(x) for x in row["state"]], len(walls) + 1)
    times = [mp.mpf(float(rough.phase[0]) / pi + float(t - rough.time[0])) for t in rough.time]
    turns = round(float(times[-1] - times[0]) / 2)
    made = solved(times[:-1], [D / 2 if wall == "B" else -D / 2 for wall in walls], turns)
    product = mp.eye(2)
    for flight in made:
        flight.checked()
        product = flight.derivative() * mp.matrix([[-R, 0], [0, 1]]) * product
    trace, det = product[0, 0] + product[1, 1], R ** (2 * len(walls))
    large = (trace + mp.sign(trace) * mp.sqrt(trace**2 - 4 * det)) / 2
    state = made[-1].met, mp.fmod(made[0].a, 2) * mp.pi
    return {**row, "state": [mp.nstr(x, 40, strip_zeros=False) for x in state], "multipliers": [float(large), float(det / large)]}


if __name__ == "__main__":
    old = json.loads(FILE.read_text())
    system = VIPair(d=0.35, r=0.5, M=0.1245, g=9.8, beta=pi / 3, F=5)
    rows = ",\n".join(json.dumps(polished(system, row)) for row in old["rows"])
    FILE.write_text(f'{{"about": {json.dumps(old["about"])},\n"rows": [\n{rows}\n]}}\n')
