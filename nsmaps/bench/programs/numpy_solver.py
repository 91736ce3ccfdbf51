"""First returns by NumPy alone: all flights side by side, each step of the search for those that a mask keeps.

The search cannot miss an impact: the acceleration vanishes at known times, between two of them the velocity has at most one
zero, and between two zeros of the velocity the displacement meets a wall at most once. Displacement is that since the last
impact, without cancellation.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats
from nsmaps.bench.programs.solver import Solver
from nsmaps.bench.task import Answer, Pair

PI = np.pi
Mask = NDArray[np.bool_]
MOST_STEPS, MOST_IMPACTS = 100, 120
SERIES = [(-1.0) ** k / np.prod(np.arange(1.0, 2 * k + 2)) for k in range(1, 9)]


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """Moments of many flights: time since the impact, displacement, velocity, acceleration."""

    t: Floats
    w: Floats
    v: Floats
    a: Floats

    def __getitem__(self, k: Mask) -> "States":
        return States(self.t[k], self.w[k], self.v[k], self.a[k])

    def put(self, k: Mask, other: "States") -> None:
        """Write the moments of those flights that a mask keeps."""
        for field in fields(self):
            getattr(self, field.name)[k] = getattr(other, field.name)


@dataclass(frozen=True, slots=True, eq=False)
class Flights:
    """Many flights: gravity, phase at the start, velocity after the impact."""

    g: float
    phi: Floats
    w: Floats

    def __getitem__(self, k: Mask) -> "Flights":
        return Flights(self.g, self.phi[k], self.w[k])

    def at(self, t: Floats) -> States:
        """The moments at times t."""
        x = PI * t
        c, s, sin, cos1 = np.cos(self.phi), np.sin(self.phi), np.sin(x), -2 * np.sin(x / 2) ** 2
        z = np.minimum(x, 1) ** 2
        series = np.zeros_like(z)
        for coefficient in reversed(SERIES):
            series = coefficient + z * series
        sin3 = np.where(x > 1, sin - x, x * z * series)
        w = t * (self.w + self.g * t / 2) + (s * sin3 - c * cos1) / PI**2
        return States(t, w, self.w + self.g * t + (s * cos1 + c * sin) / PI, self.g + c + c * cos1 - s * sin)

    def turnings(self, left: States, right: States) -> States:
        """Where the velocity vanishes, which has opposite signs at both ends; Newton between brackets."""
        lo, hi, rising = left.t.copy(), right.t.copy(), right.v > left.v
        flat = lo + (hi - lo) * (0.5 + np.arcsin((left.v + right.v) / (left.v - right.v)) / PI)
        with np.errstate(divide="ignore"):
            line = lo - left.v / left.a
        x = np.where((line > lo) & (line < hi), line, flat)
        done = np.zeros(len(x), bool)
        for _ in range(MOST_STEPS):
            q = self.at(x)
            lo, hi = np.where((q.v > 0) == rising, lo, x), np.where((q.v > 0) == rising, x, hi)
            step = q.v / q.a
            newton = (x - step >= lo) & (x - step <= hi)
            done |= (newton & (np.abs(step) <= 1e-8 * x)) | (hi - lo <= 4e-16 * x)
            if done.all():
                break
            x = np.where(done, x, np.where(newton, x - step, (lo + hi) / 2))
        return States(x - step, q.w - q.v * step / 2, np.zeros_like(x), q.a)

    def crossings(self, wall: Floats, left: States, right: States) -> States:
        """Where the displacement meets a wall, which it does once; Halley between brackets, from a parabola at the left."""
        lo, hi, rising, y = left.t.copy(), right.t.copy(), right.w > left.w, wall - left.w
        root = np.sqrt(np.maximum(left.v**2 + 2 * left.a * y, 0))
        with np.errstate(divide="ignore"):
            x = lo + 2 * y / (left.v + np.where(rising, root, -root))
        x = np.where((x > lo) & (x < hi), x, lo + (hi - lo) * y / (right.w - left.w))
        done = np.zeros(len(x), bool)
        for _ in range(MOST_STEPS):
            q = self.at(x)
            beyond = (q.w > wall) == rising
            lo, hi = np.where(beyond, lo, x), np.where(beyond, x, hi)
            step = (q.w - wall) / q.v
            step = step / (1 - step * q.a / q.v / 2)
            halley = (x - step >= lo) & (x - step <= hi)
            small = np.abs(step) ** 3 * (q.a**2 / (4 * q.v**2) + 1 / np.abs(q.v)) <= 1e-16 * x
            done |= (halley & small) | (hi - lo <= 4e-16 * x)
            x = np.where(done & ~small, x, np.where(halley, x - step, np.where(done, x, (lo + hi) / 2)))
            if done.all():
                break
        return self.at(x)

    def impacts(self, low: Floats, high: Floats) -> States:
        """The first impact of each flight on a wall at displacement low or high."""
        n = len(self.phi)
        found, live = States(*np.full((4, n), np.nan)), np.ones(n, bool)
        left = States(np.zeros(n), np.zeros(n), self.w.copy(), self.g + np.cos(self.phi))
        alpha = np.arccos(-self.g)
        k = (self.phi >= alpha) * 1 + (self.phi >= 2 * PI - alpha)
        for _ in range(MOST_STEPS):
            flights, start = self[live], left[live]
            zero = np.where(k[live] % 2, 2 * PI - alpha, alpha) + 2 * PI * (k[live] // 2)
            end = flights.at((zero - flights.phi) / PI)
            middle = States(*np.array([end.t, end.w, end.v, np.zeros_like(end.t)]))
            turns = (start.v > 0) != (end.v > 0)
            if turns.any():
                middle.put(turns, flights[turns].turnings(start[turns], end[turns]))
            lows, highs = low[live], high[live]
            open_ = np.ones(len(lows), bool)
            met = States(*np.full((4, len(lows)), np.nan))
            for a, b in ((start, middle), (middle, end)):
                hits = open_ & ((b.w <= lows) | (b.w >= highs))
                if hits.any():
                    wall = np.where(b.w <= lows, lows, highs)[hits]
                    met.put(hits, flights[hits].crossings(wall, a[hits], b[hits]))
                    open_ &= ~hits
            found.put(live, met)
            left.put(live, States(end.t, end.w, end.v, np.zeros_like(end.t)))
            live[live] = open_
            k += 1
            if not live.any():
                break
        return found


@dataclass(frozen=True)
class Masks(Solver):
    """NumPy with masks."""

    family = "NumPy masks"
    setting = ""

    def prepare(self) -> str:
        """Nothing to prepare."""
        return f"numpy {np.__version__}"

    def solve(self, pair: Pair, starts: Floats) -> Callable[[], Answer]:
        """All flights from B, then all that continue from T, until every ball has returned."""
        n = len(starts)
        answer = Answer.none(n)
        v, phi, on_base, tops, live = -starts[:, 0], starts[:, 1].copy(), True, 0, np.arange(n)
        while len(live) and tops < MOST_IMPACTS:
            zero, room = np.zeros(len(live)), np.full(len(live), pair.d)
            low, high = (-room, zero) if on_base else (zero, room)
            met = Flights(pair.g_bar, phi, pair.r * v).impacts(low, high)
            phi, back = (phi + PI * met.t) % (2 * PI), met.v > 0
            answer.image[live[back]] = np.column_stack([met.v, phi])[back]
            answer.tops[live[back]] = tops
            v, phi, live = -met.v[~back], phi[~back], live[~back]
            on_base, tops = False, tops + 1
        return lambda: answer
