"""The result of an estimate: parameters with errors, what was paired with what, and the minima that were found."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.errors import NsmapsError
from nsmaps.errors.arguments import checked
from nsmaps.estimation.records import Record
from nsmaps.results import NONE, Result, array, array_property

LEVELS = (0.6827, 0.9545)  #: of intervals: one and two standard errors of a normal distribution
POOR = 1e-3  #: probability of so large a chi2 below which a model does not describe the data
GAPPED = "-"  #: in words: no impact on this side


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Minima(Result):
    """K local minima, the best first."""

    values: Floats = field(metadata=array("minimum parameter", "values of the parameters", NONE))
    chi2: Floats = field(metadata=array("minimum", "sum of squared residuals in standard deviations", NONE))
    unpaired: Ints = field(metadata=array("minimum", "impacts missed or spurious, and samples off the motion", NONE))
    weights: Floats = field(metadata=array("minimum", "relative likelihoods, by Laplace's approximation, whose sum is 1", NONE))
    reached: Ints = field(metadata=array("minimum", "starts of the search that reached it", NONE))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Pairs(Result):
    """The impacts of records and of the model side by side, L pairs in order; one side is missing of those that are unpaired."""

    record: Ints = field(metadata=array("pair", "number of the record", NONE))
    time: Floats = field(metadata=array("pair", "of the record, in its unit; NaN of an impact that was missed"))
    model_time: Floats = field(metadata=array("pair", "of the model, in the unit of the record; NaN of a spurious impact"))
    wall: NDArray[np.str_] = field(metadata=array("pair", "of the record; '' if unknown or missed", NONE))
    model_wall: NDArray[np.str_] = field(metadata=array("pair", "of the model; '' of a spurious impact", NONE))
    residual: Floats = field(metadata=array("pair", "time of the model less that of the record, in standard deviations", NONE))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Profile(Result):
    """The profile likelihood of one parameter."""

    values: Floats = field(metadata=array("value", "values of the parameter", NONE))
    chi2: Floats = field(metadata=array("value", "least chi2 over all other unknowns, above the minimum", NONE))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Estimate(Result):
    """Estimates of P parameters from records, with their errors.

    Errors are standard errors of the quadratic approximation; `intervals` are those of the profile likelihood where this one
    misleads. All are as wide as the noise of the records says, or, where this is unknown, as the residuals say (`noise`).
    """

    picture: ClassVar[str] = "nsmaps.figures.estimation.estimate"

    names: tuple[str, ...]
    values: Floats = field(metadata=array("parameter", "estimates", NONE))
    errors: Floats = field(metadata=array("parameter", "standard errors; infinite where the data do not determine it", NONE))
    covariance: Floats = field(metadata=array("parameter other", "covariance of the estimates", NONE))
    intervals: Floats = field(metadata=array("parameter level end", "of 68.27 and 95.45 %, low and high", NONE))
    profiled: Bools = field(metadata=array("parameter", "whether the intervals are those of the profile likelihood", NONE))
    relative_errors: Floats = field(metadata=array("direction", "standard errors along `directions`, in units of `scale`", NONE))
    directions: Floats = field(
        metadata=array("direction parameter", "combinations of parameters over `scale`, best known first", NONE)
    )
    scale: Floats = field(metadata=array("parameter", "range of the search", NONE))
    limits: Floats = field(metadata=array("parameter end", "bounds, infinite where there are none", NONE))
    chi2: float
    dof: int  #: degrees of freedom: residuals less unknowns
    noise: float  #: factor of the standard deviations: 1 where all are known, else that with which chi2 is `dof`
    probability: float  #: of a larger chi2, if the model and its noise are right; NaN where the noise is unknown
    converged: bool
    minima: Minima
    pairs: Pairs
    speed_residuals: Floats = field(
        metadata=array("speed", "speeds of the model less measured ones, in standard deviations", NONE)
    )
    sample_residuals: Floats = field(metadata=array("sampled", "samples of the model less measured ones, likewise", NONE))
    starts: Floats = field(
        metadata=array("record coordinate", "states of the section just before its first event in each record")
    )
    start_times: Floats = field(metadata=array("record", "times of these, in the unit of the record"))
    phases: Floats = field(metadata=array("record", "phase of the forcing at time zero of the record", "rad"))
    last_states: Floats = field(metadata=array("record coordinate", "states of the section at the last segment of each record"))
    defect: float  #: largest jump between segments, in standard deviations of the noise
    profiles: Mapping[str, Profile]
    records: tuple[Record, ...]
    coordinates: tuple[str, ...] = ()
    unit_factor: float | None = None  #: of a `time_unit` with which the model describes data that it otherwise does not

    @property
    def parameters(self) -> dict[str, float]:
        """The estimates by name, as `system.at(**estimate.parameters)` takes them."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @property
    def rank(self) -> int:
        """The number of independent combinations of the parameters that the data determine, to less than their range."""
        return int((self.relative_errors < 1.0).sum())

    @property
    def undetermined(self) -> tuple[str, ...]:
        """The parameters that take part in combinations that the data do not determine."""
        loose = self.directions[self.relative_errors >= 1.0]
        share = (loose**2).sum(axis=0) if len(loose) else np.zeros(len(self.names))
        return tuple(name for name, part in zip(self.names, share, strict=True) if part > 0.1)

    @property
    def describes(self) -> bool:
        """Whether the model describes the data: its chi2 is not improbably large, and few impacts are unpaired."""
        pairs, unpaired = len(self.pairs.time), int(self.minima.unpaired[0])
        return not self.probability < POOR and unpaired <= max(2, 0.3 * pairs)

    @property
    def other_unit(self) -> str:
        """The unit of time with which the model would describe the data, in words; "" where there is none."""
        return f", but with a `time_unit` {self.unit_factor:.4g} times as large" if self.unit_factor else ""

    @array_property("parameter other", "correlation of the estimates", NONE)
    def correlation(self) -> Floats:
        """The correlation matrix, shape (P, P)."""
        deviation = np.sqrt(np.diag(self.covariance))
        return np.asarray(self.covariance / np.outer(deviation, deviation))

    @property
    def words(self) -> tuple[tuple[str, str], ...]:
        """Of each record the letters of its impacts and of those of the model, `-` where one side has none."""
        found = []
        for k in range(len(self.records)):
            mine = self.pairs.record == k
            data = np.where(
                np.isnan(self.pairs.time[mine]), GAPPED, np.where(self.pairs.wall[mine] == "", "?", self.pairs.wall[mine])
            )
            model = np.where(self.pairs.model_wall[mine] == "", GAPPED, self.pairs.model_wall[mine])
            found.append(("".join(data), "".join(model)))
        return tuple(found)

    def last_state(self, record: int) -> Floats:
        """The state of the section at the last segment of a record, shape (c,). NsmapsError where there is no such record."""
        if not 0 <= record < len(self.last_states):
            raise NsmapsError(f"there is no record {record}; expected: below {len(self.last_states)}, counted from 0")
        return self.last_states[record]

    @checked
    def draws(self, n_draws: int, rng: int | np.random.Generator = 0) -> Floats:
        """Parameters drawn from the normal distribution of the estimates within their bounds, shape (n_draws, P).

        Directions that the data do not determine are drawn from the range of the search.
        """
        rng = np.random.default_rng(rng)
        spread = np.minimum(self.relative_errors * self.noise, 1.0)
        found, count = np.empty((0, len(self.names))), n_draws
        while len(found) < n_draws:
            steps = (rng.standard_normal((2 * count + 8, len(spread))) * spread) @ self.directions
            drawn = self.values + steps * self.scale
            inside = ((drawn >= self.limits[:, 0]) & (drawn <= self.limits[:, 1])).all(axis=1)
            found = np.concatenate([found, drawn[inside]])
        return found[:n_draws]

    def summary(self) -> str:
        """The numbers that matter."""
        lines = [
            f"{name} = {shown(value, error)}" for name, value, error in zip(self.names, self.values, self.errors, strict=True)
        ]
        fit = f"chi2 {self.chi2:.4g} of {self.dof} degrees of freedom"
        if np.isfinite(self.probability):
            fit += f", probability {self.probability:.2g}"
        fit += "" if self.describes else ": the model does not describe the data"
        fit += self.other_unit
        fit += f"; {len(self.minima.chi2)} minima" if len(self.minima.chi2) > 1 else ""
        fit += f"; unpaired {self.minima.unpaired[0]}" if self.minima.unpaired[0] else ""
        fit += f"; not determined: {', '.join(self.undetermined)}" if self.undetermined else ""
        return "; ".join([*lines, fit])


def shown(value: float, error: float) -> str:
    """A value and its standard error with two digits.

    >>> shown(0.500181, 0.00055), shown(1234.5, float("inf"))
    ('0.50018 +- 0.00055', '1234.5 +- inf')
    """
    if not (np.isfinite(error) and error > 0):
        return f"{value:.6g} +- {error:.2g}"
    digits = max(1 - int(np.floor(np.log10(error))), 0)
    return f"{value:.{digits}f} +- {error:.{digits}f}"
