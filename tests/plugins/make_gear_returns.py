"""First returns of the gear in 50 digits, from the closed form of its flight and without code of nsmaps.

Run by hand, `PYTHONPATH=tests python tests/plugins/make_gear_returns.py`; it takes 15 seconds. The first impact is proved and
not sampled (`proved.py`).
"""

import json
from pathlib import Path

import mpmath as mp
import numpy as np
from proved import first

DATA = Path(__file__).parents[1] / "data" / "gear_rattle.json"
SETS = {
    "three attractors": {"delta": 0.6, "eps": 1.0, "r": 0.9},
    "silence or rattle": {"delta": 0.6, "eps": 0.1, "r": 0.9},
    "hard drive": {"delta": 0.1, "eps": 2.5, "r": 0.5},
    "little drag": {"delta": 1e-6, "eps": 0.3, "r": 0.7},
}
RETURNS, EDGES, DIGITS, STEP = 30, 6, 50, mp.mpf("1e-20")
NEAR = mp.mpf("1e-9")  #: of the two states on either side of a graze
MOST = 40  #: impacts of a return


class Flight:
    """x = a + 4 pi t + eps cos 2 pi t + b exp(-delta (t - t0)) from the place x0 with the velocity u."""

    def __init__(self, system, t0, x0, u):
        self.delta, self.eps, self.t0 = mp.mpf(system["delta"]), mp.mpf(system["eps"]), t0
        self.b = (4 * mp.pi - 2 * mp.pi * self.eps * mp.sin(2 * mp.pi * t0) - u) / self.delta
        self.a = x0 - 4 * mp.pi * t0 - self.eps * mp.cos(2 * mp.pi * t0) - self.b

    def at(self, s):
        """Place and velocity the time s after the start."""
        turn, decay = 2 * mp.pi * (self.t0 + s), self.b * mp.exp(-self.delta * s)
        place = self.a + 2 * turn + self.eps * mp.cos(turn) + decay
        return place, 4 * mp.pi - 2 * mp.pi * self.eps * mp.sin(turn) - self.delta * decay

    def bend(self, s):
        """A bound on the acceleration from the time s on."""
        return 4 * mp.pi**2 * self.eps + self.delta**2 * abs(self.b) * mp.exp(-self.delta * s)

    def gap(self, side, s):
        """The distance from an end, and its rate."""
        place, rate = self.at(s)
        return 1 - side * place, -side * rate

    def impact(self):
        """The side of the first impact, its time since the start, and the velocity just before it."""
        s, side = first({1: lambda s: self.gap(1, s), -1: lambda s: self.gap(-1, s)}, self.bend, 1 / mp.mpf(8))
        return side, s, self.at(s)[1]


def first_return(system, v, phi):
    """Word, speed, phase on a continued turn, and time of the first return to D; None if there are too many impacts."""
    start = phi / (2 * mp.pi)
    t, side, u, word = start, 1, -mp.mpf(system["r"]) * v, "D"
    while len(word) < MOST:
        side, s, u = Flight(system, t, mp.mpf(side), u).impact()
        t, word = t + s, word + ("D" if side > 0 else "C")
        if side > 0:
            return word, u, 2 * mp.pi * t, t - start
        u = -mp.mpf(system["r"]) * u
    return None


def slope(system, v, phi):
    """The largest derivative of speed, phase and time by the state, by differences."""
    ends = [
        [first_return(system, v + k * h * (j == 0), phi + k * h * (j == 1)) for k in (1, -1)] for j in (0, 1) for h in (STEP,)
    ]
    return max(abs(a - b) / (2 * STEP) for up, down in ends for a, b in zip(up[1:], down[1:], strict=True))


def row(system, v, phi, kind):
    """One return with what is known of it, or None."""
    v, phi = mp.mpf(v), mp.mpf(phi)
    found = first_return(system, v, phi)
    if found is None:
        return None
    image = [mp.nstr(value, 40) for value in found[1:3]]
    return {
        "kind": kind,
        "start": [float(v), float(phi)],
        "word": found[0],
        "image": image,
        "time": mp.nstr(found[3], 40),
        "slope": float(slope(system, v, phi)),
    }


def edge(system, rng):
    """Two states in floats next to each other whose words differ, at a graze or at the edge of one impact more."""
    while True:
        ends = [(mp.mpf(v), mp.mpf(phi)) for v, phi in zip(rng.uniform(1, 14, 2), rng.uniform(0, 6.28, 2), strict=True)]
        found = [first_return(system, *end) for end in ends]
        if None in found or found[0][0] == found[1][0]:
            continue
        while abs(ends[0][0] - ends[1][0]) + abs(ends[0][1] - ends[1][1]) > NEAR:
            middle = tuple((a + b) / 2 for a, b in zip(*ends, strict=True))
            here = first_return(system, *middle)
            same = here is not None and here[0] == found[0][0]
            ends = [middle, ends[1]] if same else [ends[0], middle]
        return [[float(x) for x in end] for end in ends]


def main():
    """Write the returns of all sets of parameters."""
    mp.mp.dps, rng, result = DIGITS, np.random.default_rng(1694), {}
    for name, system in SETS.items():
        starts = [(v, phi, "random") for v, phi in zip(rng.uniform(0.1, 16, RETURNS), rng.uniform(0, 6.28, RETURNS), strict=True)]
        starts += [(*end, "edge") for _ in range(EDGES) for end in edge(system, rng)]
        rows = [each for start in starts if (each := row(system, *start)) is not None]
        result[name] = {"parameters": system, "returns": rows}
        print(
            name, len(rows), "returns", {each["word"] for each in rows}, "steepest", f"{max(each['slope'] for each in rows):.1e}"
        )
    DATA.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
