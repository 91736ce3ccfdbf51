"""Which motion a record shows under the estimated parameters, and how far it is from another one: sampled."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import Floats, Ints
from nsmaps.dynamics.attractors.basins import basins
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.dynamics.lyapunov import lyapunov
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.errors import NsmapsError
from nsmaps.estimation.result import Estimate, shown
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.progress import beat, shows
from nsmaps.results import NONE, Result, array

ENDED = "none"  #: the name of the motion where no attractor was found
RETURNS, TRANSIENT = 400, 400  #: for the exponent of a draw


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Margins(Result):
    """The nearest events on the branch of a periodic motion, on either side along each parameter; the others are held."""

    parameter: NDArray[np.str_] = field(metadata=array("event", "name of the parameter", NONE))
    kind: NDArray[np.str_] = field(metadata=array("event", "such as 'period doubling' or 'grazing'", NONE))
    value: Floats = field(metadata=array("event", "of the parameter", NONE))
    distance: Floats = field(metadata=array("event", "from the estimate, in its standard errors", NONE))
    probability: Floats = field(metadata=array("event", "share of the draws beyond it; sampled", NONE))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Motions(Result):
    """The motion of one record at the estimate and at N draws of the parameters; all probabilities are sampled."""

    picture: ClassVar[str] = "nsmaps.figures.estimation.motions"

    names: tuple[str, ...]
    label: str  #: of the motion at the estimate, such as 1:1/T
    period: int  #: in returns, 0 without one
    words: tuple[str, ...]
    exponent: float  #: the largest Lyapunov exponent at the estimate, per return
    exponent_error: float  #: standard deviation over the draws with this motion
    draws: Floats = field(metadata=array("draw parameter", "parameters", NONE))
    labels: NDArray[np.str_] = field(metadata=array("draw", "the motion on which the record ends", NONE))
    exponents: Floats = field(metadata=array("draw", "largest Lyapunov exponents, per return", NONE))
    margins: Margins

    @property
    def shares(self) -> dict[str, float]:
        """The probability of each motion, sampled, the most probable first."""
        labels, counts = np.unique(self.labels, return_counts=True)
        order: Ints = np.argsort(-counts, kind="stable")
        return {str(labels[k]): float(counts[k] / len(self.labels)) for k in order}

    def summary(self) -> str:
        """The numbers that matter."""
        shares = ", ".join(f"{label} {100 * share:.0f} %" for label, share in self.shares.items())
        near = np.argsort(self.margins.distance)[:1]
        event = "".join(
            f"; nearest event: {self.margins.kind[k]} at {self.margins.parameter[k]} = {self.margins.value[k]:.6g}, "
            f"{self.margins.distance[k]:.2g} standard errors away, probability beyond {self.margins.probability[k]:.2g}"
            for k in near
        )
        exponent = shown(self.exponent, self.exponent_error)
        return f"{self.label}, exponent {exponent} per return{event}; sampled: {shares} of {len(self.labels)} draws"


@shows
def motions(
    system: FlowSystem,
    estimate: Estimate,
    *,
    record: int = 0,
    n_draws: int = 64,
    max_returns: int = 1000,
    rng: int | np.random.Generator = 0,
) -> Motions:
    """The motion on which a record ends, its nearest events, and the probabilities of other motions.

    From the state at the last segment of the record the motion is followed to its attractor, at the estimate and at draws of the
    parameters. That another attractor is reached at a draw includes changes of the motion as well as of its basin.

    Args:
        system: that of the estimate.
        estimate: of `nsmaps.estimate`.
        record: number of the record.
        n_draws: of the parameters, by the covariance of the estimate.
        max_returns: within which an attractor must be reached.
        rng: random numbers.

    Raises:
        NsmapsError: there is no such record, or an argument is out of range.
    """
    if n_draws < 1 or max_returns < 1:
        raise NsmapsError(f"n_draws {n_draws}, max_returns {max_returns}; expected: at least 1 of each")
    state, draws = estimate.last_state(record), estimate.draws(n_draws, rng)
    best = system.at(**estimate.parameters)
    label, period, words, exponent = _classified(best, state, max_returns)
    labels, exponents = [], []
    for k, row in enumerate(draws):
        one = _classified(system.at(**dict(zip(estimate.names, row.tolist(), strict=True))), state, max_returns)
        labels.append(one[0])
        exponents.append(one[3])
        beat((k + 1) / len(draws))
    names, values = np.array(labels, str), np.array(exponents)
    same = values[(names == label) & np.isfinite(values)]
    spread = float(np.std(same)) if len(same) > 1 else float("nan")
    margins = margins_of(best, estimate, state, period, draws)
    return Motions(estimate.names, label, period, words, exponent, spread, draws, names, values, margins)


def _classified(system: FlowSystem, state: Floats, max_returns: int) -> tuple[str, int, tuple[str, ...], float]:
    """Name, period and words of the attractor that a state reaches, and the largest exponent."""
    found = basins(system, state[None], max_returns=max_returns)
    if not found.attractors:
        return ENDED, 0, (), float("nan")
    attractor = found.attractors[0]
    exponents = lyapunov(system, starts=state, n_returns=RETURNS, transient=TRANSIENT).exponents
    period = 0 if attractor.period is None else int(attractor.period)
    return str(attractor.label), period, tuple(map(str, attractor.words)), float(np.max(exponents))


def margins_of(system: FlowSystem, estimate: Estimate, state: Floats, period: int, draws: Floats) -> Margins:
    """The nearest events along each parameter, of a periodic motion."""
    rows: list[tuple[str, str, float, float, float]] = []
    orbit: Any = None
    if period > 0:
        end = system.orbits(state[None], TRANSIENT).image[-1]
        orbit = periodic_orbit(system, end, period)
    for k, name in enumerate(estimate.names if orbit is not None and orbit.converged else ()):
        value, error = float(estimate.values[k]), float(estimate.errors[k])
        for event, at in _nearest_events(system, name, orbit, value, estimate, k).items():
            beyond = draws[:, k] > at if at > value else draws[:, k] < at
            rows.append((name, event, at, abs(at - value) / error, float(beyond.mean())))
    columns: Any = list(zip(*rows, strict=True)) if rows else [()] * 5
    texts = (np.array(column, str) for column in columns[:2])
    return Margins(*texts, *(np.array(column, float) for column in columns[2:]))


def _nearest_events(system: FlowSystem, name: str, orbit: Any, value: float, estimate: Estimate, k: int) -> Mapping[str, float]:
    """The nearest event on either side, by kind."""
    reach = float(estimate.scale[k])
    low, high = max(value - reach, estimate.limits[k, 0]), min(value + reach, estimate.limits[k, 1])
    found: dict[str, float] = {}
    try:
        events = continue_branch(system, name, orbit, value, (low, high), direction="both").events
    except NsmapsError:
        return found
    for side in (-1, 1):
        near = [event for event in events if side * (event.value - value) > 0]
        for event in sorted(near, key=lambda one: abs(one.value - value))[:1]:
            found[event.kind] = float(event.value)
    return found
