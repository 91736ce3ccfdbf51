"""A scalar impact system with linear flights, in Arb balls, and its flights as tables of doubles with bounds of their errors.

Between impacts z'' = -b z' - k z + g + F cos(w t) + S sin(w t). A wall stops growing (side 1) or falling (side -1) z, and an
impact of speed u is left with r u. With the harmonic motion p of the equation with g = 0, a flight that leaves the place z0
with the velocity w0 at the time t0 is, the time s later,

    z = p(t0 + s) + q(s) + (z0 - p(t0)) c(s) + (w0 - p'(t0)) a(s),

where a'' = -b a' - k a with a(0) = 0, a'(0) = 1, and c = a' + b a, q' = g a with q(0) = 0. A ball of numbers may hold those of
several kinds of motion, such as over- and under-damped ones: a formula of one kind is used only where all numbers are of it.

Phases are the same up to whole turns. An arc is never judged by its two ends alone: one lift to the line is looked at, of a set
and of the one that is to hold it. Two balls may have a phase in common where their difference in turns may be a whole number.
"""

from collections.abc import Mapping
from math import ceil, floor, isfinite, log2, pi
from typing import Any, NamedTuple

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
UNIT = 2.0**-53  #: half the distance of 1 from the next double
WIDER = 1 + 2.0**-40  #: more than a few roundings
PIECES = 2048  #: parts of the longest flight, over each of which a bound is one ball
EXTRA = 30  #: bits that the exponential of a matrix may lose
PERIOD, SPEED = 1.65, 1.0  #: logarithms to base two of the middle of what a period and the largest speed are in their units
KNOWN = 10  #: bits to which the discriminant of the damping is known where a formula divides by its root


class UnprovedError(ArithmeticError):
    """What a certificate states is not shown."""


class System(NamedTuple):
    """The equation, walls and restitution as balls; every number of the file is a decimal and a radius."""

    b: arb
    k: arb
    g: arb
    cosine: arb
    sine: arb
    frequency: arb
    walls: tuple[tuple[arb, int], ...]
    r: arb


def system_of(data: Mapping[str, Any]) -> System:
    """The system of a certificate; `frequency` has a third entry, the power of pi by which it is multiplied: 0 or 1."""
    b, k, g, cosine, sine, r = (ball(data[name]) for name in ("damping", "stiffness", "force", "cosine", "sine", "restitution"))
    frequency, walls = ball(data["frequency"]), tuple((ball(wall["at"]), wall["side"]) for wall in data["walls"])
    if data["frequency"][2] not in (0, 1) or not all(
        x.is_finite() for x in (b, k, g, cosine, sine, r, frequency, *(at for at, _ in walls))
    ):
        raise ValueError("a number of the system is not finite, or its frequency not a number or one times pi")
    places = {side: at for at, side in walls}
    if not (frequency > 0 and 0 <= r <= 1 and b >= 0) or len(places) < len(walls) or not {-1, 1} >= set(places) > set():
        raise ValueError("the system needs a frequency > 0, a damping >= 0, a restitution in [0, 1] and one wall on a side")
    if len(walls) == 2 and not places[-1] < places[1]:
        raise ValueError("the wall that stops a falling displacement is not shown to be below the one that stops a growing one")
    return System(b, k, g, cosine, sine, frequency * arb.pi() ** data["frequency"][2], walls, r)


def in_units(system: System, top: float) -> tuple[System, float]:
    """The system in units in which a period and the speed `top` are near one, for bounds of rounding, and that unit of speed.

    They are powers of 16, so that no number loses a digit.
    """
    time, unit = (16.0 ** round((log2(x) - y) / 4) for x, y in ((2 * pi / float(system.frequency.mid()), PERIOD), (top, SPEED)))
    b, k, g, cosine, sine, frequency, walls, r = system
    force, places = time / unit, tuple((at / (time * unit), side) for at, side in walls)
    return System(b * time, k * time**2, g * force, cosine * force, sine * force, frequency * time, places, r), unit


def ball(entry: Any) -> arb:
    """The ball of a decimal and a decimal radius, both as text."""
    return arb(f"{entry[0]} +/- {entry[1]}")


def in_words(data: Mapping[str, Any]) -> str:
    """The equation, walls and restitution of a certificate, with the decimals and radii that it states."""
    names = {"b": "damping", "k": "stiffness", "g": "force", "F": "cosine", "S": "sine"}
    numbers = [f"{letter} = {_written(data[name])}" for letter, name in names.items()]
    numbers.append(f"w = {_written(data['frequency'])}{' times pi' if data['frequency'][2] else ''}")
    stops = {1: "z stops growing", -1: "z stops falling"}
    walls = [f"on wall {wall['letter']}, z = {_written(wall['at'])}, {stops[wall['side']]}" for wall in data["walls"]]
    return (
        f"The system: z'' = -b z' - k z + g + F cos(w t) + S sin(w t) with {', '.join(numbers)}; {' and '.join(walls)}; an "
        f"impact is left with {_written(data['restitution'])} times its speed."
    )


def _written(entry: Any) -> str:
    """A number of a certificate with its radius, if it has one."""
    return str(entry[0]) if arb(str(entry[1])) == 0 else f"{entry[0]} +/- {entry[1]}"


class Tables(NamedTuple):
    """What the images of cells need: doubles, all within `eps` of the numbers that they stand for, and upper bounds."""

    phases: Doubles  #: (N, 3): p, p' and the force g + F cos + S sin, at the phases 2 pi i/N
    flights: Doubles  #: (M, 3): a, a' and q at the times (m - before) period/N
    before: int  #: place of the time zero in `flights`
    numbers: Doubles  #: b, k, g, r
    places: Doubles  #: of the walls
    sides: Doubles  #: of the walls
    step: float  #: period/N, rounded up
    eps: float  #: bound of the error of every number y above relative to max(1, |y|), apart from `gap`
    size: float  #: one more than all absolute values in `phases`, `numbers` and `places`
    bounds: Doubles  #: as of `bounds_of`
    gap: float  #: bound of the error of `places` where k = 0, else within `eps`
    unit: float  #: errors of rounding in images are below unit (size^2 (1 + |a| + |a'|) (size + kappa) + 1 + |q|), see `images`
    slack: float  #: that bound at a = 0, a' = 1, q = 0 with the fastest departure


def tables_of(system: System, n: int, before: int, periods: int, speed: float) -> Tables:
    """Tables at n phases, for flights up to a number of periods, of cells with speeds up to `speed`; `before` < n."""
    b, k, g, cosine, sine, w, walls, r = system
    p, q = harmonic_motion(system)
    rounded = _Rounded()
    phases = np.empty((n, 3))
    for i in range(n):
        si, co = (arb(2 * i) / n).sin_cos_pi()
        phases[i] = rounded(p * co + q * si), rounded(w * (q * co - p * si)), rounded(g + cosine * co + sine * si)
    step = 2 * arb.pi() / w / n
    flights = np.array([[rounded(x) for x in free_motion(system, step * m)] for m in range(-before, periods * n + 1)])
    numbers = np.array([rounded(x) for x in (b, k, g, r)])
    separate = _Rounded() if k == 0 else rounded
    places = np.array([separate(at) for at, _ in walls])
    size = 1 + max(float(np.abs(x).max()) for x in (phases, numbers, places))
    unit = 2.0**12 * size * (rounded.worst + UNIT)
    slack = unit * (2 * size**2 * (size + speed) + 1) * WIDER
    bounds = bounds_of(system, p, q, step * before, step * (periods * n), abs(r) * speed + 4 * slack)
    sides = np.array([float(side) for _, side in walls])
    gap = separate.worst * max(1.0, float(np.abs(places).max())) * (1 + 2.0**-50)
    return Tables(phases, flights, before, numbers, places, sides, _up(step), rounded.worst, size, bounds, gap, unit, slack)


def bounds_of(system: System, p: arb, q: arb, before: arb, horizon: arb, depart: arb) -> Doubles:
    """Bounds of the derivatives that remainders depend on, for departures of speeds up to `depart`, times -before to `horizon`.

    They are the largest |a'| and |a''|, and, of z(t1; t0, kappa) with the departure at t0 and the departure speed kappa, those of
    |d2 z'/dt0 dt0|, |d2 z'/dt0 dt1|, |d3 z/dt1^3| (of the acceleration along a flight) and of the force's derivative.
    """
    b, k, g, cosine, sine, w, walls, _ = system
    pieces = [free_motion(system, t) for t in _pieces(before, horizon)]
    a, da, fall = (_largest([x[i] for x in pieces]) for i in range(3))
    wave, force = (p * p + q * q).sqrt(), (cosine * cosine + sine * sine).sqrt()
    wall = _largest([at for at, _ in walls])
    b, k, g = abs(b), abs(k), abs(g)
    push, c, dc, dda = w * force, da + b * a, k * a, b * da + k * a
    start = g + force + k * wall + b * depart  # the acceleration at departure
    z = wave + fall + (wall + wave) * c + (depart + w * wave) * a
    v = w * wave + g * a + (wall + wave) * dc + (depart + w * wave) * da
    early, late = depart * c + start * a, depart * dc + start * da  # |dz/dt0|, |dz'/dt0|
    jerk = b * (g + force + k * z + b * v) + k * v + push
    return np.array([_up(x) for x in (da, dda, depart * k * da + start * dda + push * da, b * late + k * early, jerk, push)])


def harmonic_motion(system: System) -> tuple[arb, arb]:
    """The coefficients of cos(w t) and sin(w t) of the harmonic motion; `UnprovedError` at a possible resonance."""
    b, k, _, cosine, sine, w, _, _ = system
    d, e = k - w * w, b * w
    square = d * d + e * e
    if square.contains(0):
        raise UnprovedError(
            f"a force of frequency {w} may be in resonance with a stiffness {k} and damping {b}; expected: no resonance"
        )
    return (d * cosine - e * sine) / square, (d * sine + e * cosine) / square


def free_motion(system: System, s: arb) -> tuple[arb, arb, arb]:
    """The functions a, a' and q at a ball of times, for all numbers in the balls of the system."""
    b, k, g = system.b, system.k, system.g
    if b == 0 and k == 0:
        return s, arb(1), g * s * s / 2
    inside = k - b * b / 4
    if not (inside > 0 and inside.rel_accuracy_bits() > KNOWN):
        return _by_exponential(system, s)
    root, decay = inside.sqrt(), (-b * s / 2).exp()
    sine, cosine = (root * s).sin_cos()
    a = decay * sine / root
    da = decay * cosine - b / 2 * a
    return a, da, g * (1 - da - b * a) / k


def _by_exponential(system: System, s: arb) -> tuple[arb, arb, arb]:
    """The same where the motion may be over-damped, critical, or without stiffness.

    With h' = a, h(0) = 0 it is a' = 1 - b a - k h, so that h and a are entries of the exponential of a matrix, without divisions.
    For a ball of times they are those at its middle, and what derivatives at all of its times add.
    """
    b, k, g = system.b, system.k, system.g
    with ctx.workprec(ctx.prec + EXTRA):
        (h, a), way = _entries(system, arb(s.mid())), s - s.mid()
        da = 1 - b * a - k * h
        if not s.is_exact():
            late_h, late_a = _entries(system, s)
            rate = 1 - b * late_a - k * late_h
            bend = -b * rate - k * late_a
            h, a, da = h + (a + rate * way / 2) * way, a + (da + bend * way / 2) * way, da + bend * way
        return a, da, g * h


def _entries(system: System, s: arb) -> tuple[arb, arb]:
    """The functions h and a."""
    power = (arb_mat([[0, 1, 0], [-system.k, -system.b, 1], [0, 0, 0]]) * s).exp()
    return power[0, 2], power[1, 2]


def _pieces(before: arb, horizon: arb) -> list[arb]:
    """Balls that cover the times from -before to `horizon`."""
    width = (before + horizon) / PIECES
    return [((2 * i + 1) * width / 2 - before) + width * arb(0, 0.5) for i in range(PIECES)]


def _largest(values: list[arb]) -> arb:
    """The largest absolute value."""
    return arb(max(_up(x) for x in values))


def _up(x: arb) -> float:
    """A double above the absolute value of a ball: the conversion rounds by less than 2^-52 of it."""
    upper = float(abs(x).abs_upper()) * (1 + 4 * UNIT) + 1e-300
    if not isfinite(upper):
        raise UnprovedError("a flight of the longest time that is followed has no bound in double precision")
    return upper


class _Rounded:
    """Doubles of balls; `worst` bounds all errors so far, each relative to max(1, |y|) with the double y."""

    def __init__(self) -> None:
        self.worst = 0.0

    def __call__(self, x: arb) -> float:
        y = float(x.mid())
        self.worst = max(self.worst, _up(x - arb(y)) / max(1.0, abs(y)) * (1 + 4 * UNIT))
        return y


def nearest_turn(gap: arb) -> int:
    """The whole turns nearest the middle of a difference of phases: a choice, by which nothing is shown."""
    whole = (arb(gap.mid()) / (2 * arb.pi()) + 0.5).mid().floor().unique_fmpz()
    return 0 if whole is None else int(whole)


def only_turn(gap: arb) -> int | None:
    """The whole turns that a difference of phases is, if it is any; None where it may be several."""
    turns = nearest_turn(gap)
    return turns if abs(gap / (2 * arb.pi()) - turns) < 1 else None


def may_meet(a: arb, b: arb) -> bool:
    """Whether two balls may have a phase in common."""
    return bool(((a - b) / (2 * arb.pi())).contains_integer())


def lifts(first: float, last: float, centre: float, reach: float) -> range:
    """The turns by which an arc from `first` to `last`, moved back, may lie within `reach` of `centre`; none may be missing."""
    spare = 1e-9 * (1 + abs(first) + abs(last) + abs(centre) + reach)
    return range(ceil((last - centre - reach - spare) / (2 * pi)), floor((first - centre + reach + spare) / (2 * pi)) + 1)
