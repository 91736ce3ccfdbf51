"""A block that rocks about one edge, and its returns by its own closed form in mpmath: what growing flights are compared with.

Nothing of the engine is used. A flight is scanned in floats, by samples too dense for a gap to close and open between two of them
unless it is small at one; what is found there is settled in multiple precision.
"""

from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
import sympy as sp
from numpy.typing import NDArray

from nsmaps import ImpactSystem, Wall

DIGITS = 45
SAMPLES = 200  # of a flight, a period of the forcing
SUMMED = 1e-10  # impact speeds in units of what the acceleration gives in a radian, below which hops are taken by Taylor
CHATTER = 1e-12  # the same, of impacts on the floor that are told as one
EPS = 2.0**-53


class Block(ImpactSystem):
    """y'' + 2 zeta y' - y = -tilt + A cos(w t) above a floor, and below a ceiling where it is `ceiled`.

    Above a floor alone it is a slender block on a shaking base that rocks about one edge and may overturn, time in units of
    its growth; below a ceiling too a pendulum upside down between two walls.
    """

    tilt: float = 0.0
    A: float = 1.0
    w: float = 2.0
    zeta: float = 0.0
    r: float = 0.8
    floor: float = 0.0
    ceiling: float = 0.0
    ceiled: bool = False

    def walls(self) -> Mapping[str, Wall]:
        return {"B": Wall(at=self.floor, side=-1), **({"T": Wall(at=self.ceiling, side=1)} if self.ceiled else {})}

    def period(self) -> Any:
        return 2 * sp.pi / self.w

    def steady(self, t: Any) -> Any:
        """The motion that neither grows nor decays."""
        stiff, drag = 1 + self.w**2, 2 * self.zeta * self.w
        return self.tilt + self.A * (drag * sp.sin(self.w * t) - stiff * sp.cos(self.w * t)) / (stiff**2 + drag**2)

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s, x, k = t - hit.t, sp.Dummy(), sp.sqrt(1 + self.zeta**2)
        z, w = hit.z - self.steady(hit.t), hit.w - self.steady(x).diff(x).subs(x, hit.t)
        return self.steady(t) + sp.exp(-self.zeta * s) * (z * sp.cosh(k * s) + (w + self.zeta * z) / k * sp.sinh(k * s))


class Flight:
    """A flight of a block from the phase phi, the place z and the velocity w, in mpmath."""

    def __init__(self, block: Block, phi: Any, z: Any, w: Any) -> None:
        self.tilt, self.A, self.omega, self.zeta = (mp.mpf(x) for x in (block.tilt, block.A, block.w, block.zeta))
        self.k, stiff, drag = mp.sqrt(1 + self.zeta**2), 1 + self.omega**2, 2 * self.zeta * self.omega
        self.grows, self.decays = self.k - self.zeta, -self.k - self.zeta
        self.c, self.s = -self.A * stiff / (stiff**2 + drag**2), self.A * drag / (stiff**2 + drag**2)
        self.walls = [mp.mpf(block.floor), mp.mpf(block.ceiling)][: 1 + block.ceiled]
        self.phi, self.z, self.w = phi, z, w
        place, velocity = self.steady(mp.mpf(0))
        self.up, self.down = self.shares(z - place, w - velocity)
        self.reach = abs(self.tilt) + abs(self.c) + abs(self.s) + max(map(abs, self.walls))

    def shares(self, z: Any, w: Any) -> tuple[Any, Any]:
        """What grows and what decays of a free motion that begins at z with velocity w."""
        return (w - self.decays * z) / (2 * self.k), (self.grows * z - w) / (2 * self.k)

    def free(self, t: Any, up: Any, down: Any) -> tuple[Any, Any]:
        """Place and velocity of a free motion with these shares."""
        up, down = up * mp.exp(self.grows * t), down * mp.exp(self.decays * t)
        return up + down, self.grows * up + self.decays * down

    def steady(self, t: Any) -> tuple[Any, Any]:
        """Place and velocity of the motion that neither grows nor decays."""
        c, s = mp.cos_sin(self.phi + self.omega * t)
        return self.tilt + self.c * c + self.s * s, self.omega * (self.s * c - self.c * s)

    def at(self, t: Any) -> tuple[Any, Any]:
        """Place and velocity."""
        (y, v), (free_y, free_v) = self.steady(t), self.free(t, self.up, self.down)
        return y + free_y, v + free_v

    def acceleration(self, t: Any) -> Any:
        """By the equation of motion."""
        y, v = self.at(t)
        return y - self.tilt + self.A * mp.cos(self.phi + self.omega * t) - 2 * self.zeta * v

    def gap_to(self, wall: int, rates: int = 0) -> Callable[[Any], tuple[Any, Any]]:
        """The gap to a wall and its rate, by the time; or the rate and the rate of that."""
        away = 1 if wall == 0 else -1

        def gap(t: Any) -> tuple[Any, Any]:
            y, v = self.at(t)
            return away * (y - self.walls[wall]), away * v

        return (lambda t: (gap(t)[1], away * self.acceleration(t))) if rates else gap

    def times(self) -> NDArray[np.float64]:
        """Times from the start on until the flight grows away for ever, denser and denser towards the start."""
        step = min(2 * np.pi / float(self.omega) / SAMPLES, 0.02)
        a, w = abs(float(self.acceleration(0))), abs(float(self.w))
        first = min(step / 2, w / a / 500) if a > 0 and w > 0 else step / 1000
        end = float(mp.log(1 + 3 * (self.reach + abs(self.down)) / abs(self.up)) / self.grows)
        early = np.geomspace(first, step, 10 + int(7 * np.log(step / first)))
        return np.concatenate([early, np.arange(2 * step, end + 2 * step, step)])

    def gaps(self, wall: int, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """The gap to a wall at these times, in floats but where they would not do."""
        up, down, grows, decays, omega = map(float, (self.up, self.down, self.grows, self.decays, self.omega))
        q, away, gap = float(self.phi) + omega * t, 1 if wall == 0 else -1, self.gap_to(wall)
        y = float(self.tilt) + float(self.c) * np.cos(q) + float(self.s) * np.sin(q)
        y = away * (y + up * np.exp(grows * t) + down * np.exp(decays * t) - float(self.walls[wall]))
        for i in np.flatnonzero(np.abs(y) < 1e-10 * float(self.reach + abs(self.down))):
            y[i] = gap(mp.mpf(t[i]))[0]
        return y

    def brackets(self) -> Iterator[tuple[Any, Any, int]]:
        """Between which times which wall is met for the first time, of each wall that is."""
        t = self.times()
        dip = 5 * float(self.reach + self.A) * (t[-1] - t[-2]) ** 2
        for wall in range(len(self.walls)):
            gap = self.gaps(wall, t)
            met = int(np.argmax(gap <= 0)) if (gap <= 0).any() else len(gap)
            low = 1 + np.flatnonzero((gap[1:-1] <= gap[:-2]) & (gap[1:-1] <= gap[2:]) & (gap[1:-1] < dip))
            for i in low[low < met]:
                least = root(self.gap_to(wall, rates=1), mp.mpf(t[i - 1]), mp.mpf(t[i + 1]))
                if least is not None and self.gap_to(wall)(least)[0] < 0:
                    yield mp.mpf(t[i - 1]), least, wall
                    break
            else:
                if met < len(gap):
                    yield mp.mpf(t[met - 1]), mp.mpf(t[met]), wall

    def first_hit(self) -> tuple[Any, int] | None:
        """When which wall is met first, or None."""
        hits = [(root(self.gap_to(wall), *ends), wall) for *ends, wall in self.brackets()]
        return min(hits, default=None)

    def lost(self, t: Any) -> float:
        """What rounding of what grows, each number off by EPS, has become at a time; without one when what grows is the reach."""
        pace = abs(self.w) + self.omega * (abs(self.c) + abs(self.s))
        grown = 1 / abs(self.up) if t is None else mp.exp(self.grows * t) / self.reach
        return float(EPS * self.shares(self.reach, pace)[0] * grown)

    def bend(self, t: Any) -> Any:
        """The derivative by the phase of the velocity of the motion that neither grows nor decays."""
        c, s = mp.cos_sin(self.phi + self.omega * t)
        return -self.omega * (self.c * c + self.s * s)

    def moved(self, t: Any) -> list[tuple[Any, Any]]:
        """The derivatives of place and velocity at a fixed time by phase, place and velocity of the start."""
        at_start, now = self.steady(mp.mpf(0))[1] / self.omega, self.steady(t)[1] / self.omega
        by_phase = self.free(t, *self.shares(-at_start, -self.bend(0)))
        rest = [self.free(t, *self.shares(*one)) for one in ((1, 0), (0, 1))]
        return [(by_phase[0] + now, by_phase[1] + self.bend(t)), *rest]

    def spread(self, t: Any, phase: float, speed: float) -> tuple[float, float]:
        """How far phase and speed of an impact at t are off for roundings of phase and speed at the start, and on the way.

        Every number that enters, and every sum, is off by EPS of the sizes of its terms; what that does is by the derivative.
        """
        v, a, forced = self.at(t)[1], self.acceleration(t), abs(self.c) + abs(self.s)
        sizes = phase, EPS * (abs(self.z) + self.reach), speed + EPS * (abs(self.w) + self.omega * forced)
        grown, fallen = abs(self.up) * mp.exp(self.grows * t), abs(self.down) * mp.exp(self.decays * t)
        size, pace = self.reach + grown + fallen, self.omega * forced + self.grows * grown - self.decays * fallen
        late, off = EPS * (size / abs(v) + t), EPS * (size * abs(a / v) + pace)
        for share, by_phase, (dy, dv) in zip(sizes, (1, 0, 0), self.moved(t), strict=True):
            late += share * abs(by_phase / self.omega - dy / v)
            off += share * abs(dv - a * dy / v)
        return float(late * self.omega + EPS * (self.phi + self.omega * t)), float(off)


def root(f: Callable[[Any], tuple[Any, Any]], low: Any, high: Any) -> Any:
    """Where a function, given with its rate, changes sign between two places, or None where it does not: Newton in a bracket."""
    sign = mp.sign(f(low)[0])
    if sign * f(high)[0] > 0:
        return None
    x = (low + high) / 2
    for _ in range(300):
        y, rate = f(x)
        low, high = (x, high) if sign * y > 0 else (low, x)
        step = y / rate if rate else high - low
        if min(abs(step), high - low) <= mp.mpf(10) ** (6 - DIGITS) * abs(x):
            return x
        x = x - step if low < x - step < high else (low + high) / 2
    raise ArithmeticError(f"no root between {low} and {high}")


class Return(NamedTuple):
    """A first return to the floor: its word or how it ended, speed, phase continued from the start, time.

    In floats phase and speed may be off by `spread`, and the first flight by `lost`, in units of its reach.
    """

    word: str
    v: Any = mp.nan
    phi: Any = mp.nan
    time: Any = mp.nan
    spread: tuple[float, float] = (0.0, 0.0)
    lost: float = 0.0


def first_return(block: Block, v: Any, phi: Any) -> Return:
    """The first return to the floor of a state, as mpmath computes it."""
    v, phi, r = mp.mpf(v), mp.mpf(phi), mp.mpf(block.r)
    wall, word, spread, lost, start = 0, "B", (0.0, 0.0), 0.0, phi
    while True:
        into, z = (-1, mp.mpf(block.floor)) if wall == 0 else (1, mp.mpf(block.ceiling))
        flight = Flight(block, phi, z, -into * r * v)
        press = into * flight.acceleration(0)
        if press > 0 and v * flight.omega <= press * (CHATTER if wall == 0 else SUMMED):
            rest = accumulated(flight, into, r)
            phi = released(flight, wall, rest)
            if phi is None:
                return Return("rests")
            if v > 0 or phi - rest > SUMMED:
                word = word.rstrip("T") + ("T" if wall else "") + ("~" if v > 0 else "_")
                v, spread = mp.mpf(0), (4 * EPS * float(phi), 0.0)
                if wall == 0:
                    return Return(word, v, phi, (phi - start) / flight.omega, spread, lost)
            flight = Flight(block, phi, z, mp.mpf(0))
        t, wall = flight.first_hit() or (None, wall)
        lost = lost or flight.lost(t)
        if t is None:
            return Return("escaped", lost=lost)
        spread = flight.spread(t, spread[0], block.r * spread[1])
        v, phi, word = abs(flight.at(t)[1]), phi + flight.omega * t, word + "BT"[wall]
        if wall == 0:
            return Return(word, v, phi, (phi - start) / flight.omega, spread, lost)


def accumulated(flight: Flight, into: int, r: Any) -> Any:
    """The phase at which the hops that a flight begins accumulate, each by its Taylor polynomial of third order."""
    phi, u = flight.phi, abs(flight.w)
    while u > mp.mpf("1e-40"):
        press = into * (flight.z - flight.tilt + flight.A * mp.cos(phi)) + 2 * flight.zeta * u
        jerk = u + into * flight.A * flight.omega * mp.sin(phi) + 2 * flight.zeta * press
        s = 2 * u / press * (1 + 2 * jerk * u / (3 * press**2))
        u, phi = r * (press * s - jerk * s * s / 2 - u), phi + flight.omega * s
    return phi


def released(flight: Flight, wall: int, phi: Any) -> Any:
    """The first phase from phi on at which the block is not pressed onto a wall any more, or None."""
    lift = (flight.tilt - flight.z) / flight.A  # what the cosine is where the acceleration vanishes
    if abs(lift) >= 1:
        return None
    first = mp.acos(lift) * (-1 if wall == 0 else 1)
    return first + 2 * mp.pi * mp.ceil((phi - first) / (2 * mp.pi))
