"""Periodic orbits from many starts: the distinct ones of a period, perhaps of one word."""

from collections.abc import Sequence

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import as_states
from nsmaps.dynamics.periodic import PeriodicOrbit, periodic_orbit
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.progress import shows


@shows
def periodic_orbits(
    system: ReturnMap,
    starts: ArrayLike,
    period: int = 1,
    *,
    words: Sequence[str] | None = None,
    tolerance: float = 1e-10,
    min_distance: float = 1e-6,
) -> tuple[PeriodicOrbit, ...]:
    """The periodic orbits, stable or not, that Newton's method finds from many starts, each once; there may be others.

    Only orbits that converge, exist, have no divisor of the period, and no multiplier within `min_distance` of 1 are returned,
    as chatter at speeds below the tolerance may have, and any orbit of a family, such as motions that keep their energy.

    Args:
        system: with derivatives.
        starts: shape (N, n), the first state of each guess.
        period: q, in returns.
        words: those of the q returns, from any state of the cycle on; None for all.
        tolerance: largest residual, as in `periodic_orbit`.
        min_distance: of two orbits, in radians for an angle, else a share of the larger `scale` of both.

    Raises:
        StateError, NsmapsError: as `periodic_orbit`.
    """
    found: list[PeriodicOrbit] = []
    rotations = None if words is None else {(*words[k:], *words[:k]) for k in range(len(words))}
    for start in as_states(starts, ReturnMap.require(system, "periodic orbits").coordinates):
        orbit = periodic_orbit(system, start, period, tolerance=tolerance)
        if not (orbit.converged and orbit.exists) or (rotations is not None and orbit.words not in rotations):
            continue
        turned = [np.roll(orbit.states, k, axis=0) for k in range(period)]
        known = [(orbit, other) for other in turned[1:]] + [(each, other) for each in found for other in turned]
        if np.abs(orbit.multipliers - 1).min() > min_distance and not any(
            _same(one, other, min_distance * np.maximum(one.scale, orbit.scale)) for one, other in known
        ):
            found.append(orbit)
    return tuple(found)


@checked
def periodic_orbits_by_word(system: PiecewiseMap, max_period: int, tolerance: float = 1e-10) -> tuple[PeriodicOrbit, ...]:
    """All periodic orbits up to a period of a map with affine pieces, in the order of periods and words.

    Of each word the one cycle of its formulas is kept if its states lie in the pieces of the word, up to rounding. Words of which
    1 is a multiplier are left out: they have no cycle, or a line of them.

    Args:
        system: without angles, whose images are affine.
        max_period: in returns.
        tolerance: as in `periodic_orbit`.

    Raises:
        NsmapsError: the image of a piece is not affine, or a coordinate is an angle.
    """
    from nsmaps.exact.piecewise.affine import cycles_of_words

    system = PiecewiseMap.require(system, "cycles by their words")
    return tuple(
        periodic_orbit(system, states, len(states), tolerance=tolerance) for _, states in cycles_of_words(system, max_period)
    )


def _same(one: PeriodicOrbit, states: Floats, near: Floats) -> bool:
    """True if each state of an orbit is near one of others, shape (q, n), within a distance in each coordinate, shape (n,)."""
    return bool(one.returns.coordinates.near(one.states, states, near).all())
