"""The functions that the generator writes for each system, in numbers and without cancellation.

`flight.py` and `returns.py` are written against this file; `kernel.py` puts generated functions of these names in its place.
A flight starts on a wall at phase phi (radians) and place `z` with velocity `w`, `at` is (phi, cos phi - 1, sin phi); `s` is the
time since then; `p` holds the parameters.
"""

from typing import Any

Numbers = tuple[float, ...]

HAS_UP = True  #: is there a wall that stops growing displacement
HAS_DOWN = True  #: is there a wall that stops falling displacement
BASE_UP = True  #: is the base wall the upper one
WIDE = True  #: are the functions such that a compiler can compute them for many flights side by side


def phase_rate(p: Any) -> float:
    """Radians of phase a unit of time."""
    raise NotImplementedError


def horizon(p: Any) -> float:
    """The longest flight followed, in the system's time."""
    raise NotImplementedError


def wall_places(p: Any) -> tuple[float, float]:
    """Displacement of the upper and of the lower wall."""
    raise NotImplementedError


def rebound(p: Any, up: bool, v: float) -> tuple[float, float]:
    """Speed just after an impact of speed v on the upper (or lower) wall, and its derivative."""
    raise NotImplementedError


def coefficients_at(p: Any, at: Numbers, z: float, w: float) -> Numbers:
    """What of the flight does not depend on s."""
    raise NotImplementedError


def bounds_at(p: Any, at: Numbers, z: float, w: float) -> tuple[float, float, float, float]:
    """Bounds on the third to the sixth derivative (|jerk|, |snap|, |crackle|, |pop|) for all s in [0, horizon]."""
    raise NotImplementedError


def held_at(p: Any, at: Numbers, z: float) -> tuple[float, float, float]:
    """Acceleration of a ball held at rest at z, its rate in time, and a bound on its second rate at all phases."""
    raise NotImplementedError


def evaluate(c: Numbers, s: float) -> tuple[float, float, float, float, float, float]:
    """Displacement since the start, velocity, acceleration, jerk, snap and crackle at s."""
    raise NotImplementedError


def weighed(c: Numbers, s: float) -> tuple[float, float, float, float, float, float, float]:
    """As `evaluate`, and behind it the size of all that the displacement is the sum of, signs forgotten (see `rounding.py`)."""
    raise NotImplementedError


def start(c: Numbers) -> tuple[float, float, float, float]:
    """Acceleration, jerk, snap and crackle at s = 0."""
    raise NotImplementedError


def tangent_at(p: Any, at: Numbers, z: float, w: float, s: float) -> tuple[float, float, float, float]:
    """d displacement/d phi, d displacement/d w, d velocity/d phi, d velocity/d w at fixed s."""
    raise NotImplementedError


def law_moves(p: Any, way: Any, up: bool, v: float) -> tuple[float, float, float, float]:
    """The derivatives by the parameters along a way of the upper and lower wall's place, the rebound and the phase rate."""
    raise NotImplementedError


def moves_at(p: Any, way: Any, at: Numbers, z: float, moved: float, w: float, s: float) -> tuple[float, float]:
    """The derivatives of displacement and velocity at s by the parameters along a way, the start's place moved with them."""
    raise NotImplementedError
