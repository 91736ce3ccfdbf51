"""The functions that `ballcode.py` writes for each system, in balls: what `flow.py` names, over sets of states and times.

`balls.py` has the arithmetic; `swarm.py` and `cells.py` are written against this file, as `flight.py` is against `flow.py`.
"""

from typing import Any

Ball = tuple[float, float]
Balls = tuple[Ball, ...]


def ball_places(p: Any) -> Balls:
    """Displacement of the upper and of the lower wall."""
    raise NotImplementedError


def ball_rebound(p: Any, up: bool, v: Ball) -> Balls:
    """Speed after an impact of speed v on the upper (or lower) wall, and its first and second derivative."""
    raise NotImplementedError


def ball_rate(p: Any) -> Balls:
    """Radians of phase a unit of time, alone in a tuple."""
    raise NotImplementedError


def ball_coefficients(p: Any, at: Balls, z: Ball, w: Ball) -> Balls:
    """What of the flight does not depend on s."""
    raise NotImplementedError


def ball_bounds(p: Any, at: Balls, z: Ball, w: Ball) -> Balls:
    """Bounds on |jerk| and |snap| for all s in [0, horizon]."""
    raise NotImplementedError


def ball_motion(c: Balls, s: Ball) -> Balls:
    """Displacement since the start, velocity, acceleration and jerk at s."""
    raise NotImplementedError


def ball_tangent(p: Any, at: Balls, z: Ball, w: Ball, s: Ball) -> Balls:
    """d displacement/d phi, d displacement/d w, d velocity/d phi, d velocity/d w at fixed s."""
    raise NotImplementedError


def ball_bends(p: Any, at: Balls, z: Ball, w: Ball, s: Ball) -> Balls:
    """Derivatives at fixed s of displacement and velocity by phase twice, by both, by w twice; then of acceleration by each."""
    raise NotImplementedError
