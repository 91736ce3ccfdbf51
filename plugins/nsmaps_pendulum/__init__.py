"""The pendulum with a stop: a damped pendulum under harmonic torque that meets a rigid stop."""

from nsmaps_pendulum.system import PendulumStop

__all__ = ["PendulumStop"]
