"""The bouncing ball: a ball that falls on a table in sinusoidal motion."""

from nsmaps_bouncing_ball.system import BouncingBall

__all__ = ["BouncingBall"]
