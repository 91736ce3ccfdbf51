"""A scalar impact system with linear flights, in Arb balls, and its flights as tables of doubles with bounds of their errors.

Between impacts z'' = -b z' - k z + g + F cos(w t) + S sin(w t). A wall stops growing (side 1) or falling (side -1) z, and an
impact of speed u is left with r u. With the harmonic motion p of the equation with g = 0, a flight that leaves the place z0
with the velocity w0 at the time t0 is, the time s later,

    z = p(t0 + s) + q(s) + (z0 - p(t0)) c(s) + (w0 - p'(t0)) a(s),

where a'' = -b a' - k a with a(0) = 0, a'(0) = 1, and c = a' + b a, q' = g a with q(0) = 0.
"""

from typing import Any, NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

Doubles = NDArray[np.float64]
UNIT = 2.0**-53  #: half the distance of 1 from the next double
PIECES = 2048  #: parts of the longest flight, over each of which a bound is one ball


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


def system_of(data: dict[str, Any]) -> System:
    """The system of a certificate; `frequency` has a third entry, the power of pi by which it is multiplied."""
    b, k, g, cosine, sine, r = (ball(data[name]) for name in ("damping", "stiffness", "force", "cosine", "sine", "restitution"))
    frequency = ball(data["frequency"]) * arb.pi() ** int(data["frequency"][2])
    walls = tuple((ball(wall["at"]), int(wall["side"])) for wall in data["walls"])
    sides = sorted(side for _, side in walls)
    if not (frequency > 0 and 0 <= r <= 1 and b >= 0) or sides not in ([-1], [1], [-1, 1]):
        raise ValueError("the system needs a frequency > 0, a damping >= 0, a restitution in [0, 1] and one wall on a side")
    return System(b, k, g, cosine, sine, frequency, walls, r)


def ball(entry: Any) -> arb:
    """The ball of a decimal and a decimal radius, both as text."""
    return arb(f"{entry[0]} +/- {entry[1]}")


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
    bounds = bounds_of(system, p, q, step * before, step * (periods * n), speed)
    size = 1 + max(float(np.abs(x).max()) for x in (phases, numbers, places))
    sides = np.array([float(side) for _, side in walls])
    gap = separate.worst * max(1.0, float(np.abs(places).max())) * (1 + 2.0**-50)
    return Tables(phases, flights, before, numbers, places, sides, _up(step), rounded.worst, size, bounds, gap)


def bounds_of(system: System, p: arb, q: arb, before: arb, horizon: arb, speed: float) -> Doubles:
    """Bounds of the derivatives that remainders depend on, for all departures and the times from -before to `horizon`.

    They are the largest |a'| and |a''|, and, of z(t1; t0, kappa) with the departure at t0 and the departure speed kappa, those of
    |d2 z'/dt0 dt0|, |d2 z'/dt0 dt1|, |d3 z/dt1^3| (of the acceleration along a flight) and of the force's derivative.
    """
    b, k, g, cosine, sine, w, walls, r = system
    pieces = [free_motion(system, t) for t in _pieces(before, horizon)]
    a, da, fall = (_largest([x[i] for x in pieces]) for i in range(3))
    wave, force = (p * p + q * q).sqrt(), (cosine * cosine + sine * sine).sqrt()
    wall, depart = _largest([at for at, _ in walls]), abs(r) * arb(speed) * 1.01  # rounding included
    b, k, g = abs(b), abs(k), abs(g)
    push, c, dc, dda = w * force, da + b * a, k * a, b * da + k * a
    start = g + force + k * wall + b * depart  # the acceleration at departure
    z = wave + fall + (wall + wave) * c + (depart + w * wave) * a
    v = w * wave + g * a + (wall + wave) * dc + (depart + w * wave) * da
    early, late = depart * c + start * a, depart * dc + start * da  # |dz/dt0|, |dz'/dt0|
    jerk = b * (g + force + k * z + b * v) + k * v + push
    return np.array([_up(x) for x in (da, dda, depart * k * da + start * dda + push * da, b * late + k * early, jerk, push)])


def harmonic_motion(system: System) -> tuple[arb, arb]:
    """The coefficients of cos(w t) and sin(w t) of the harmonic motion."""
    b, k, _, cosine, sine, w, _, _ = system
    d, e = k - w * w, b * w
    return (d * cosine - e * sine) / (d * d + e * e), (d * sine + e * cosine) / (d * d + e * e)


def free_motion(system: System, s: arb) -> tuple[arb, arb, arb]:
    """The functions a, a' and q at a ball of times; equations at the edge between two regimes of damping are not enclosed."""
    b, k, g = system.b, system.k, system.g
    if b == 0 and k == 0:
        return s, arb(1), g * s * s / 2
    inside, decay = b * b / 4 - k, (-b * s / 2).exp()
    root = abs(inside).sqrt()
    if inside < 0:
        sine, cosine = (root * s).sin_cos()
    elif inside > 0:
        sine, cosine = (root * s).sinh_cosh()
    else:
        raise ValueError("the damping is critical within the accuracy of the parameters; expected: another one")
    a = decay * sine / root
    da = decay * cosine - b / 2 * a
    return a, da, g * (1 - da - b * a) / k if k != 0 else g * (s - a) / b


def _pieces(before: arb, horizon: arb) -> list[arb]:
    """Balls that cover the times from -before to `horizon`."""
    width = (before + horizon) / PIECES
    return [((2 * i + 1) * width / 2 - before) + width * arb(0, 0.5) for i in range(PIECES)]


def _largest(values: list[arb]) -> arb:
    """The largest absolute value."""
    return arb(max(_up(x) for x in values))


def _up(x: arb) -> float:
    """A double above the absolute value of a ball: the conversion rounds by less than 2^-52 of it."""
    return float(abs(x).abs_upper()) * (1 + 4 * UNIT) + 1e-300


class _Rounded:
    """Doubles of balls; `worst` bounds all errors so far, each relative to max(1, |y|) with the double y."""

    def __init__(self) -> None:
        self.worst = 0.0

    def __call__(self, x: arb) -> float:
        y = float(x.mid())
        self.worst = max(self.worst, _up(x - arb(y)) / max(1.0, abs(y)) * (1 + 4 * UNIT))
        return y
