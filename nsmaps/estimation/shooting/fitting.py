"""Least squares from one guess: impacts are paired, the unknowns are fitted, and both are repeated with tighter continuity."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.estimation.shooting.problem import GAP, Measured, Pairing, Problem, Shooting

WEIGHTS = (0.3, 3.0, 30.0, 300.0)  #: of continuity, in turn; the last makes it exact to a share of the noise
FIRST_SCALE = 0.12  #: of the mean interval of impacts, by which these are first aligned
TIGHTER = 3.0  #: robust standard deviations of the residuals, by which they are aligned afterwards
ROUNDS, EVALUATIONS = 12, 20  #: of pairing, and of least squares in the first of these; more where later ones converge slowly
FINE, COARSE = 1e-8, 1e-5  #: accuracy of the cost at a minimum, and along a profile
HOPELESS, BETTER = 100.0, 0.8  #: mean squared residual that is not of noise, and its share in a round worth another
TO_SIGMA = 1.4826  #: from the median of absolute residuals to a standard deviation


@dataclass(frozen=True)
class Fit:
    """A local minimum."""

    x: Floats  #: all unknowns
    pairings: tuple[Pairing, ...]
    chi2: float  #: sum of squared residuals of what is paired, over the standard deviations
    residuals: Floats
    jacobian: Floats  #: of all residuals by the unknowns, those of continuity included, weighted by the loss
    unpaired: int  #: impacts that were missed or are spurious, and samples outside of the motion
    converged: bool  #: whether the last pairing is that of the fit, and least squares converged

    @property
    def cost(self) -> float:
        """By which minima are compared: chi2, and a price for each unpaired impact."""
        return self.chi2 + GAP**2 * self.unpaired


def fit(problem: Problem, x: Floats) -> Fit | None:
    """The minimum reached from a guess of all unknowns; None where the guess has no motion.

    Where impacts are unpaired at a minimum, they are aligned there as loosely as at first, while this lowers the cost by a fifth.
    """
    best, before = fitted(problem, x), np.inf
    while best is not None and best.unpaired and np.mean(best.residuals**2) < HOPELESS and best.cost <= BETTER * before:
        before, other = best.cost, fitted(problem, best.x)
        best = other if other is not None and other.cost < before else best
    return best


def fitted(problem: Problem, x: Floats, rounds: int = ROUNDS, accuracy: float = FINE) -> Fit | None:
    """The minimum reached from a guess by so many alignments that tighten; None where the guess has no motion."""
    shooting = problem.shooting
    scales = [FIRST_SCALE * mean_interval(record) for record in shooting.records]
    x, pairings, error, converged = np.clip(x, *problem.limits), list[Pairing](), np.inf, False
    found: Any = None
    for number in range(rounds):
        before, pairings = pairings, shooting.pair(x, scales)
        if number and found.status > 0 and all(a.same(b) for a, b in zip(pairings, before, strict=True)):
            converged = True
            break
        found = minimize(problem, x, pairings, WEIGHTS[-1], EVALUATIONS * max(1, number - 1), accuracy)
        if found is None:
            return None
        x, mean = found.x, float(np.mean(found.fun**2))
        if number and mean > max(HOPELESS, BETTER * error):
            break
        error = mean
        scales = [min(new, old) for new, old in zip(_scales(problem, x, pairings), scales, strict=True)]
    values, _ = shooting.residuals(x, pairings, WEIGHTS[-1])
    chi2, alone = measured_chi2(shooting, values, pairings), unpaired(shooting, pairings)
    return Fit(x, tuple(pairings), chi2, values, found.jac, alone, converged)


def minimize(
    problem: Problem,
    x: Floats,
    pairings: Sequence[Pairing],
    weight: float,
    evaluations: int = EVALUATIONS,
    accuracy: float = FINE,
) -> Any:
    """Least squares with given pairings, the result of scipy; None where the start has no motion.

    Args:
        accuracy: relative change of the cost at which it stops.
    """
    from scipy.optimize import least_squares

    low, high = problem.limits
    inner = np.clip(x, low + 1e-12 * problem.scale, high - 1e-12 * problem.scale)
    value, _ = problem.shooting.residuals(inner, pairings, weight)
    if not np.isfinite(value).all() or not len(value):
        return None
    return least_squares(
        lambda y: problem.shooting.residuals(y, pairings, weight)[0],
        inner,
        lambda y: problem.shooting.residuals(y, pairings, weight)[1],
        bounds=problem.limits,
        x_scale=problem.scale,
        loss=problem.loss,
        max_nfev=evaluations,
        xtol=1e-10,
        ftol=accuracy,
        gtol=1e-12,
    )


def measured_chi2(shooting: Shooting, residuals: Floats, pairings: Sequence[Pairing]) -> float:
    """The sum of squares of all residuals but those of continuity."""
    return float((residuals[is_measured(shooting, pairings)] ** 2).sum())


def is_measured(shooting: Shooting, pairings: Sequence[Pairing]) -> np.ndarray:
    """Which residuals are not of continuity, a mask."""
    sizes = [shooting.sizes(number, pairing) for number, pairing in enumerate(pairings)]
    return np.concatenate([np.repeat([True, False], [sum(part[:3]), part[3]]) for part in sizes])


def unpaired(shooting: Shooting, pairings: Sequence[Pairing]) -> int:
    """Impacts of the records without one of the model, impacts of the model without one of a record, samples off the motion."""
    pairs = zip(shooting.records, pairings, strict=True)
    return sum(
        len(r.times) - len(p.impacts) + p.missed * (len(r.times) > 0) + len(r.sample_times) - len(p.sampled) for r, p in pairs
    )


def _scales(problem: Problem, x: Floats, pairings: Sequence[Pairing]) -> list[float]:
    """The deviations of times by which impacts are aligned next: those of the residuals, the noise at least."""
    shooting, found = problem.shooting, []
    event_map = shooting.model.at(x[: problem.free])
    for number, (pairing, known) in enumerate(zip(pairings, problem.noise_known, strict=True)):
        record, parts = shooting.records[number], shooting.parts(event_map, x, number, pairing)
        noise = record.noise[pairing.impacts]
        differences = np.abs(parts[0][0] * noise) if parts else np.zeros(0)
        if not len(differences):
            found.append(np.inf)
            continue
        least = float(np.median(noise)) if known else 1e-9 * mean_interval(record)
        found.append(max(TIGHTER * TO_SIGMA * float(np.median(differences)), least))
    return found


def mean_interval(record: Measured) -> float:
    """The mean interval of the impacts of a record, or its length without them."""
    first, last = record.span
    return float(last - first) / max(len(record.times) - 1, 1) or 1.0
