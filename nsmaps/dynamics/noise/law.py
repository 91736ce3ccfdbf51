"""The law of the noise: its size and correlation time, and that of a step of a grid in time."""

from typing import Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from nsmaps.arrays import Floats, Storable
from nsmaps.coordinates import Coordinates
from nsmaps.errors import NsmapsError, near_match
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem


class Noise(BaseModel, Storable):
    """Gaussian noise eta ~ N(0, sigma^2): with `tau` a forcing of motions between returns, without it noise on the images.

    The forcing is a stationary Ornstein-Uhlenbeck process, d eta = -eta/tau dt + sigma sqrt(2/tau) dB. To images independent
    deviates are added, one to each coordinate of each image.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    sigma: float = Field(
        ge=0, description="standard deviation: of the forcing, in the system's unit of acceleration, or of images"
    )
    tau: float | None = Field(default=None, gt=0, description="correlation time of the forcing, in the system's time")
    scale: dict[str, float] | None = Field(
        default=None, description="of noise on images: its standard deviation by coordinate, in units of sigma; others have none"
    )

    @model_validator(mode="after")
    def _of_one_kind(self) -> Self:
        if self.scale is not None and (self.tau is not None or min(self.scale.values(), default=0.0) < 0):
            raise ValueError(f"scale is {self.scale}, tau {self.tau}; expected: numbers that are not negative, and no tau")
        return self

    def sizes(self, coordinates: Coordinates) -> Floats:
        """The standard deviations of noise on images, shape (n,). NsmapsError for a name that is not a coordinate."""
        scale = dict.fromkeys(coordinates, 1.0) if self.scale is None else self.scale
        for name in scale:
            if name not in coordinates:
                near = near_match(name, coordinates)
                raise NsmapsError(f"the noise has a scale of {name!r}, which is not a coordinate{near}; expected: {coordinates}")
        return self.sigma * np.array([scale.get(name, 0.0) for name in coordinates])


def usual_step(system: System, tau: float) -> float:
    """The step of the grid in time unless one is given: a hundredth of the period, or a tenth of tau if that is less."""
    period = FlowSystem.require(system, "noise").period()
    return tau / 10 if period is None else min(float(period) / 100, tau / 10)


def linear_law(system: ImpactSystem) -> tuple[float, float]:
    """The k and c of the flights of a system, which obey z'' = -k z - c z' + f(t): noise is added to them by superposition."""
    return system._kernel().closed_form("orbits under noise").law


def exact_step(k: float, c: float, noise: Noise, h: float) -> Floats:
    """The law of (n, n', eta) over a step h, n'' = -k n - c n' + eta: transition and a square root of the covariance, (2, 3, 3).

    Both follow from one matrix exponential (Van Loan 1978) in units of the step, without cancellation for short steps.
    """
    from scipy.linalg import expm

    assert noise.tau is not None
    rates = np.array([[0, 1, 0], [-k * h * h, -c * h, 1], [0, 0, -h / noise.tau]])
    both = np.zeros((6, 6))
    both[:3, :3], both[3:, 3:], both[2, 5] = -rates, rates.T, 1.0
    exponential = expm(both)
    transition = exponential[3:, 3:].T
    root = np.linalg.cholesky(transition @ exponential[:3, 3:]) * np.sqrt(2 * h / noise.tau) * noise.sigma
    units = np.array([h * h, h, 1.0])
    return np.stack([units[:, None] * transition / units, units[:, None] * root])
