"""The spring-loaded inverted pendulum: a mass on a spring that runs and hops."""

from nsmaps_hopper.system import Hopper

__all__ = ["Hopper"]
