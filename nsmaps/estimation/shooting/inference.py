"""What a fit says of the parameters: covariance, directions that the data do not determine, profile likelihoods."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.estimation.shooting.fitting import COARSE, WEIGHTS, Fit, measured_chi2, minimize
from nsmaps.estimation.shooting.problem import Pairing, Problem

SINGULAR = 1e-12  #: of the largest singular value, below which one is rounding
REACH, POINTS = 3.0, 13  #: standard errors on either side of a profile, and its points
STEEP, HALVINGS = 4.0, 5  #: rise of chi2 between points at which a step is halved, and how often at most
MISLEADS = 0.25  #: relative difference of the profile from the parabola at two standard errors


@dataclass(frozen=True)
class Spread:
    """The quadratic approximation of the likelihood at a minimum."""

    covariance: Floats  #: shape (P, P), of the free parameters; infinite along what is not determined
    of_unknowns: Floats  #: shape (K, K), of all unknowns, by the pseudo-inverse
    singular: Floats  #: shape (P,), relative errors along the principal directions, in units of `scale`, the largest last
    directions: Floats  #: shape (P, P), these directions as rows, in the same units


def spread_of(found: Fit, free: int, scale: Floats) -> Spread:
    """The spread of a fit; of the P free parameters the information that is left when all others adapt.

    Args:
        scale: of all unknowns.
    """
    table = found.jacobian * scale
    _, values, rows = np.linalg.svd(table, full_matrices=False)
    kept = values > SINGULAR * values.max(initial=0.0)
    inverse = rows[kept].T / values[kept]
    of_unknowns = inverse @ inverse.T
    own, others = table[:, :free], table[:, free:]
    u, s, _ = np.linalg.svd(others, full_matrices=False)
    u = u[:, s > SINGULAR * s.max(initial=0.0)]
    _, left, directions = np.linalg.svd(own - u @ (u.T @ own), full_matrices=False)
    floor = 1e-9 * np.linalg.norm(own) + 1e-300  # what is left of a column by rounding
    errors = np.where(left > floor, 1.0 / np.maximum(left, floor), np.inf)
    finite = np.where(np.isfinite(errors), errors, 1e9)
    covariance = (directions.T * finite**2) @ directions * np.outer(scale[:free], scale[:free])
    return Spread(covariance, of_unknowns * np.outer(scale, scale), errors, directions)


@dataclass(frozen=True)
class ProfileLine:
    """The least chi2 over all other unknowns at values of one parameter."""

    values: Floats  #: shape (V,)
    chi2: Floats  #: shape (V,), above the minimum
    others: Floats  #: shape (V, P), all free parameters there


def profile(problem: Problem, found: Fit, number: int, error: float, spread: Spread) -> ProfileLine:
    """The profile of a parameter within `REACH` standard errors of its estimate, and within its limits."""
    low, high = (each[number] for each in problem.limits)
    best, free = found.x[number], problem.free
    values = np.unique(np.append(np.clip(best + error * np.linspace(-REACH, REACH, POINTS), low, high), best))
    middle = int(np.argmin(np.abs(values - best)))
    chi2, points = np.full(len(values), np.nan), np.full((len(values), free), np.nan)
    chi2[middle], points[middle] = 0.0, found.x[:free]
    first = spread.of_unknowns[:, number] / max(spread.of_unknowns[number, number], 1e-300)
    for way in (range(middle + 1, len(values)), range(middle - 1, -1, -1)):
        point = Held(found.x, found.chi2, first)
        for k in way:
            following = reached(problem, found, point, number, values[k])
            if following is None:
                break
            rise, point = following.chi2 - point.chi2, following
            chi2[k], points[k] = point.chi2 - found.chi2, point.x[:free]
            if _is_steep(rise, found):
                break
    return ProfileLine(values, chi2, points)


@dataclass(frozen=True)
class Held:
    """A point of a profile."""

    x: Floats  #: all unknowns
    chi2: float
    slope: Floats  #: of the unknowns by the one that is held


def _is_steep(rise: float, found: Fit) -> bool:
    """Whether chi2 rises more between two points than a parabola does."""
    return rise > STEEP * max(1.0, found.chi2 / len(found.residuals))


def reached(problem: Problem, found: Fit, point: Held, number: int, value: float, halvings: int = HALVINGS) -> Held | None:
    """The next point of a profile, None where none is found: by steps that are halved where chi2 rises steeply.

    The least residuals lie in a narrow valley where motions are sensitive, which a long step misses.
    """
    step, pairings = value - point.x[number], found.pairings
    x, chi2 = held(problem, pairings, point.x + point.slope * step, number, value), np.inf
    if x is not None:
        residuals, _ = problem.shooting.residuals(x, pairings, WEIGHTS[-1])
        chi2 = measured_chi2(problem.shooting, residuals, pairings)
    if halvings and _is_steep(chi2 - point.chi2, found):
        half = reached(problem, found, point, number, point.x[number] + step / 2, halvings - 1)
        if half is None or _is_steep(half.chi2 - point.chi2, found):
            return None
        return reached(problem, found, half, number, value, halvings - 1)
    return None if x is None else Held(x, chi2, (x - point.x) / step)


def held(problem: Problem, pairings: Sequence[Pairing], guess: Floats, number: int, value: float) -> Floats | None:
    """The unknowns at the least residuals with one of them at a value; None where there is no motion."""
    low, high = (each.copy() for each in problem.limits)
    narrow = 1e-9 * problem.scale[number]
    low[number], high[number] = value - narrow, value + narrow
    guess = np.clip(guess, low, high)
    result = minimize(replace(problem, limits=(low, high)), guess, pairings, WEIGHTS[-1], 12, COARSE)
    return None if result is None else np.asarray(result.x, float)


def crossing(values: Floats, chi2: Floats, level: float) -> tuple[float, float]:
    """Where a profile reaches a level on either side of its minimum; infinite where it does not, NaN where it ends before."""
    middle = int(np.nanargmin(chi2))
    roots, ends = np.sqrt(np.maximum(chi2, 0.0)), {-1: -np.inf, 1: np.inf}
    for step, way in ((-1, range(middle, 0, -1)), (1, range(middle, len(values) - 1))):
        for k in way:
            a, b = roots[k], roots[k + step]
            if np.isnan(b):
                ends[step] = np.nan
                break
            if b >= np.sqrt(level) > a:
                ends[step] = float(values[k] + (values[k + step] - values[k]) * (np.sqrt(level) - a) / (b - a))
                break
    return ends[-1], ends[1]


def misleads(lines: Sequence[ProfileLine], best: Floats, errors: Floats) -> list[bool]:
    """Of each profile, whether it differs from the parabola by more than `MISLEADS` at two standard errors."""
    found = []
    for number, line in enumerate(lines):
        parabola = ((line.values - best[number]) / errors[number]) ** 2
        near = (parabola > 0.5) & (parabola < 5.0)
        found.append(bool((~(np.abs(line.chi2 / np.where(near, parabola, 1.0) - 1) <= MISLEADS) & near).any()))
    return found
