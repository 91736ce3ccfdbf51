"""From impact to impact in Arb balls: the next impact of all states of a box, shown to be the first one, with its derivative."""

from collections.abc import Iterable
from math import frexp
from typing import Any, NamedTuple

from flint import arb

from nsmaps.verify.formula import System, UnprovedError, free_motion, harmonic_motion

FIRST, SHORTEST = 2.0**-3, 2.0**-40  #: longest and shortest part of a flight that is looked at at once, as shares of the period
MOST, LONGEST = 100_000, 2.0**10  #: parts of a flight, and its periods: ends of parts are multiples of 2^-53 of these, so exact
ENDS = (1.0, 1.5, 0.75, 0.5, 0.25)  #: lengths of a part that is to end between arrivals, as shares
ROUNDS = 60

State = tuple[arb, arb]
Matrix = tuple[State, State]


class Impact(NamedTuple):
    """The next impact of the states of a box."""

    wall: int
    phase: arb  #: not reduced to one turn
    speed: arb
    derivative: Matrix  #: of phase and speed by those of the start, for all states of the box
    by_walls: Matrix  #: by the place of the wall that is left, and by that of the wall that is met


class _Motion(NamedTuple):
    """Displacement, velocity and acceleration, and the free motion, a time after the departure."""

    z: arb
    v: arb
    push: arb
    a: arb
    da: arb


class Part(NamedTuple):
    """The states point + matrix way: the images of a parallelogram, which the box around them may exceed by far."""

    point: tuple[arb, arb]  #: phase and speed
    matrix: Matrix  #: two rows
    way: tuple[arb, ...]


class _Flight:
    """The flights of a box of departures, phases and speeds of the impact before, or of a parallelogram in it."""

    def __init__(self, system: System, wall: int, phase: arb, speed: arb, part: "Part | None" = None) -> None:
        at, side = system.walls[wall]
        self.system, self.phase, self.loss = system, phase, -side * system.r
        self.middle = _Flight(system, wall, *part.point) if part else None
        columns = zip(*part.matrix, part.way, strict=True) if part else ()
        self.ways = [(first / system.frequency, self.loss * second, way) for first, second, way in columns]
        self.speed, self.w0 = speed, self.loss * speed
        p, q = self.middle.waves[:2] if self.middle else harmonic_motion(system)
        self.waves: tuple[arb, arb, arb, arb] = p, q, -system.frequency * p, system.frequency * q
        departure = phase.sin_cos()
        wave, slope = self._harmonic(departure)
        x, y, b, k = at - wave, self.w0 - slope, system.b, system.k
        start = self._force(departure) - k * at - b * self.w0
        self.falls = b == 0 and k == 0  #: the acceleration is the force
        self.free, self.free_v = (x, b * x + y), (y, system.g - k * x)  # what a' and a are multiplied by
        self.gone, self.gone_v = (-self.w0, -(b * self.w0 + start)), (-start, k * self.w0)

    def _harmonic(self, angle: tuple[arb, arb]) -> tuple[arb, arb]:
        """The harmonic motion and its velocity, by the sine and cosine of the phase."""
        (sine, cosine), (p, q, dp, dq) = angle, self.waves
        return p * cosine + q * sine, dq * cosine + dp * sine

    def _force(self, angle: tuple[arb, arb]) -> arb:
        """The force, by the sine and cosine of the phase."""
        (sine, cosine), system = angle, self.system
        return system.g + system.cosine * cosine + system.sine * sine

    def _angle(self, s: arb) -> tuple[arb, arb]:
        """Sine and cosine of the phase at all times of a ball."""
        return (self.phase + self.system.frequency * s).sin_cos()

    def _place(self, angle: tuple[arb, arb], a: arb, da: arb, fall: arb) -> State:
        """Displacement and velocity of the whole box."""
        (wave, slope), (x, y), (x_v, y_v) = self._harmonic(angle), self.free, self.free_v
        return wave + fall + x * da + y * a, slope + x_v * da + y_v * a

    def at(self, s: arb) -> _Motion:
        """The motion at all times of a ball."""
        (a, da, fall), angle = free_motion(self.system, s), self._angle(s)
        z, v = self._place(angle, a, da, fall)
        push = self._force(angle) if self.falls else self._force(angle) - self.system.k * z - self.system.b * v
        if self.middle is None:
            return _Motion(z, v, push, a, da)
        near, near_v = self.middle._place(self.middle._angle(s), a, da, fall)
        early, early_v = self.early(a, da)
        gone, gone_v = early + v, early_v + push
        for later, slower, way in self.ways:
            near += (gone * later + a * slower) * way
            near_v += (gone_v * later + da * slower) * way
        return _Motion(z.intersection(near), v.intersection(near_v), push, a, da)

    def push(self, s: arb) -> arb:
        """The acceleration at all times of a ball."""
        angle = self._angle(s)
        if self.falls:
            return self._force(angle)
        z, v = self._place(angle, *free_motion(self.system, s))
        return self._force(angle) - self.system.k * z - self.system.b * v

    def early(self, a: arb, da: arb) -> tuple[arb, arb]:
        """The derivatives of displacement and velocity at a given time by that of the departure."""
        (x, y), (x_v, y_v) = self.gone, self.gone_v
        return x * da + y * a, x_v * da + y_v * a

    def over(self, start: float, length: float) -> State:
        """Displacement and velocity from a time on, by the motion at the middle of the times and the acceleration at all."""
        middle, way = arb(start + length / 2), arb(0, length / 2)
        here, fall = self.at(middle), self.push(arb(start + length / 2, length / 2)) * way
        return here.z + here.v * way + fall * way / 2, here.v + fall


def next_impact(system: System, wall: int, phase: arb, speed: arb, states: Part | None = None) -> Impact:
    """The next impact of all states of a box of a wall, or of some in it; `UnprovedError` unless it is the same for all.

    Args:
        phase, speed: of the impact before.
        states: those that are meant where they are not the whole box.
    """
    flight = _Flight(system, wall, phase, speed, states)
    return _landed(flight, *_met(flight, wall))


def _met(flight: _Flight, wall: int) -> tuple[int, arb]:
    """The wall that all states meet next, and a ball of the times at which they do so, with a speed above zero."""
    system = flight.system
    period, start = float((2 * arb.pi() / system.frequency).mid()), 0.0
    part = _dyadic(period * FIRST)
    for _ in range(MOST):
        if part < period * SHORTEST or start > period * LONGEST:
            break
        (z, v), rising = flight.over(start, part), -1
        for other, (at, side) in enumerate(system.walls):
            gap, rate = side * (z - at), side * v
            if gap < 0 or (other == wall and start == 0 and rate < 0):
                continue
            if rising >= 0 or not rate > 0 or (other == wall and start == 0):
                break
            rising = other
        else:
            if rising < 0:
                start, part = start + part, min(2 * part, _dyadic(period * FIRST))
                continue
            ended = _ended(flight, rising, start, part)
            if ended is not None:
                end, hit = ended
                if hit:
                    return rising, _narrowed(flight, rising, arb((start + end) / 2, (end - start) / 2))
                start = end
                continue
        part /= 2
    raise UnprovedError(
        f"the next impact after those of wall {wall} at the phases {flight.phase} with the speeds {flight.speed} is not shown"
    )


def next_impacts(
    system: System, wall: int, point: tuple[arb, arb], matrix: Matrix, way: tuple[arb, arb], impacts: int
) -> tuple[tuple[int, ...], tuple[arb, arb], Matrix]:
    """The walls of the next impacts of all states point + matrix way, the last state of `point`, and the derivative by ways.

    Places of walls that are balls are further ways: each shifts all impacts alike, and the mean value form keeps that. The ways
    have to hold zero: then the middle is one of the states, and its impacts are on the same walls, and within the same times.
    """
    walls, middles = [], system._replace(walls=tuple((arb(at.mid()), side) for at, side in system.walls))
    ways = (*way, *(at - middle for (at, _), (middle, _) in zip(system.walls, middles.walls, strict=True)))
    if not all(x.contains(0) for x in ways):
        raise UnprovedError(f"the point {point} is not shown to be one of the states {way} beside it")
    columns: Any = tuple((*row, *(arb(0) for _ in system.walls)) for row in matrix)
    for _ in range(impacts):
        phase, speed = (x + _product(row, ways) for x, row in zip(point, columns, strict=True))
        flight = _Flight(system, wall, phase, speed, Part(point, columns, ways))
        hit, time = _met(flight, wall)
        whole, here = _landed(flight, hit, time), _Flight(middles, wall, *point)
        columns = tuple([*row] for row in times(whole.derivative, columns))
        for row, (by_left, by_met) in zip(columns, whole.by_walls, strict=True):
            row[2 + wall] += by_left
            row[2 + hit] += by_met
        time = _narrowed(here, hit, time)
        point, wall = (here.phase + system.frequency * time, system.walls[hit][1] * here.at(time).v), hit
        walls.append(wall)
    shifted = tuple(x + _product(row[2:], ways[2:]) for x, row in zip(point, columns, strict=True))
    return tuple(walls), shifted, tuple((row[0], row[1]) for row in columns)  # type: ignore[return-value]


def times(left: Matrix, right: Matrix) -> Matrix:
    """The product of a matrix, shape (2, 2), and one of two rows."""
    return tuple(tuple(row[0] * x + row[1] * y for x, y in zip(*right, strict=True)) for row in left)  # type: ignore[return-value]


def _product(row: Iterable[arb], ways: Iterable[arb]) -> arb:
    """The sum of the products."""
    return sum((x * y for x, y in zip(row, ways, strict=True)), arb(0))


def inverse_of(matrix: tuple[tuple[float, float], tuple[float, float]]) -> Matrix:
    """The inverse of a matrix; `UnprovedError` if it may be singular."""
    (a, b), (c, d) = (tuple(map(arb, row)) for row in matrix)
    full = a * d - b * c
    if full.contains(0):
        raise UnprovedError(f"the matrix {matrix} is not shown to be regular")
    return (d / full, -b / full), (-c / full, a / full)


def _dyadic(x: float) -> float:
    """A number with few binary digits near x, so that sums of such are exact."""
    return 2.0 ** frexp(x)[1] / 2


def _ended(flight: _Flight, wall: int, start: float, part: float) -> tuple[float, bool] | None:
    """The end of a part of the flight, all along which a wall comes nearer, and whether it is met then; None where not sure."""
    at, side = flight.system.walls[wall]
    for share in ENDS:
        end = start + share * part
        gap = side * (flight.at(arb(end)).z - at)
        if gap < 0 and share <= 1:
            return end, False
        if gap > 0 and share <= 1:
            return end, True
        if gap > 0:
            z, v = flight.over(start, end - start)
            if side * v > 0:
                others = [s * (z - x) for k, (x, s) in enumerate(flight.system.walls) if k != wall]
                return (end, True) if all(other < 0 for other in others) else None
    return None


def _narrowed(flight: _Flight, hit: int, time: arb) -> arb:
    """The times of the impact on a wall that is met once in a ball of times, by Newton's method."""
    at = flight.system.walls[hit][0]
    for _ in range(ROUNDS):
        middle = arb(time.mid())
        here = flight.at(middle)
        there = middle - (here.z - at) / (here.v + flight.push(time) * (time - middle))
        if not there.overlaps(time):
            raise UnprovedError("a flight that meets a wall was not followed to it")
        new = there.intersection(time)
        if not new.rad() < 0.9 * time.rad():
            break
        time = new
    return time


def _landed(flight: _Flight, hit: int, time: arb) -> Impact:
    """The impact on a wall that is met at a ball of times."""
    side, system = flight.system.walls[hit][1], flight.system
    motion, w = flight.at(time), system.frequency
    early, early_v = flight.early(motion.a, motion.da)
    by_speed, by_speed_v = flight.loss * motion.a, flight.loss * motion.da
    delay = -early / motion.v, -by_speed / motion.v
    phases = delay[0], w * delay[1]
    speeds = side * (early_v + motion.push * delay[0]) / w, side * (by_speed_v + motion.push * delay[1])
    across, across_v = motion.da + system.b * motion.a, -system.k * motion.a
    left = w * -across / motion.v, side * (across_v - motion.push * across / motion.v)
    met = w / motion.v, side * motion.push / motion.v
    return Impact(hit, flight.phase + w * time, side * motion.v, (phases, speeds), ((left[0], met[0]), (left[1], met[1])))
