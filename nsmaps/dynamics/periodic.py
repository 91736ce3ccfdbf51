"""Periodic orbits of return maps by Newton's method."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import Coordinates, StateLike, as_starts
from nsmaps.dynamics.exponents.growth import product_of
from nsmaps.dynamics.motion import UNRESOLVED, joined, label
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.scale import scale_of
from nsmaps.errors import NsmapsError, StateError
from nsmaps.errors.arguments import checked
from nsmaps.exact.returnmap import ExactMap, ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.results import Result, array, array_property

SAME = 1e-7  #: of the scale: difference of states that are one, far above the residual of Newton's method
MOST_STEPS = 50  #: steps of Newton's method
ROUNDING = 8 * float(np.finfo(float).eps)  #: precision of a state, as a share of its scale: for an angle, that of a whole turn
LEAST_SHARE = 2.0**-20  #: shortest share of a step that is tried
FAMILY = 1e-10  #: least singular value, as a share of the largest, below which equations are not independent
MANY = 32  #: equations that are inverted first, which takes less time than their singular values
PRECISE, MOST = 1e-12, 30  #: error of the states, a share of the scale, with which larger residuals count, in tolerances
INSTANT = 1e-6  #: share of the period of the forcing, and of the time that a guess takes, in which no motion closes


@dataclass(frozen=True, eq=False, repr=False)
class PeriodicOrbit(Result):
    """An orbit of q states of n coordinates that closes, or the last iterate of Newton's method."""

    returns: Returns  #: of its q states, each to the next and the last to the first, with derivatives
    tolerance: float  #: tolerance of the residual; see `converged`
    scale: Floats = field(metadata=array("coordinate", "unit of the residual"))
    least_time: float = 0.0  #: time that a motion must take: in less, states agree with their images without any motion

    def summary(self) -> str:
        """The motion, its stability and its multipliers, on one line; of the last iterate the residual alone."""
        if not self.converged:
            return f"not converged, residual {self.residual:.1g}{'' if self.label else ' of a motion without a return'}"
        kind = {True: "stable", False: "unstable", None: "of unknown stability"}[self.stable]
        factors = ", ".join(f"{value:.6g}" for value in self.multipliers.tolist())
        return f"{self.label}, {kind}, multipliers {factors}, residual {self.residual:.1g}"

    @property
    def coordinates(self) -> Coordinates:
        """Those of its states."""
        return self.returns.coordinates

    @array_property("point coordinate", "states, each the image of the one before; angles in [0, 2 pi)")
    def states(self) -> Floats:
        """Shape (q, n), angles in [0, 2 pi)."""
        return self.returns.start

    @property
    def period(self) -> int:
        """In returns: q, or more where the map's images are those of several returns."""
        return int(self.returns.numbers.sum())

    @property
    def words(self) -> tuple[str, ...]:
        """The word of the return from each state."""
        return tuple(self.returns.words.tolist())

    @property
    def word(self) -> str:
        """The impacts of the whole cycle from the first state on, such as BBTB for a 2:1 motion."""
        return joined(self.words, self.returns.alphabet)

    @property
    def label(self) -> str:
        """The motion, such as 1:1/2T, `unresolved` without convergence; "" if a state has no image. See `motion.label`."""
        if not self.returns.valid.all() or (self.returns.derivative is not None and not self.converged):
            return UNRESOLVED if self.returns.valid.all() else ""
        turns = self.returns.coordinates.turns_of_phase(self.turns)
        return label(self.words, turns.tolist(), self.period, self.returns.alphabet)

    @property
    def turns(self) -> NDArray[np.int64]:
        """The turns of each angle up to the next state, shape (q, n), also where an image lies just across a whole turn from it.

        They are 0 where they are not known.
        """
        found = np.round((self.returns.lifted - np.roll(self.states, -1, axis=0)) / (2 * np.pi))
        known = (
            self.returns.coordinates.angles & np.isfinite(found) & ~(self.returns.fitted & np.isnan(self.returns.time))[:, None]
        )
        return np.where(known, found, 0).astype(np.int64)

    @property
    def residual(self) -> float:
        """The largest difference between the image of a state and the next state, in any coordinate; NaN without images.

        It is a share of the coordinate's `scale`; in radians for an angle.
        """
        return float(np.abs(self.gaps / self.scale).max())

    @cached_property
    def gaps(self) -> Floats:
        """The differences of the image of each state and the next state, shape (q, n), with angles the shorter way round."""
        return _gaps(self.returns)

    @property
    def converged(self) -> bool:
        """True if each gap is within the tolerance, plus the effect of rounding of its state by the derivative.

        Next to a grazing state, where the derivative is unbounded, no state in floating point may have a smaller gap; where
        impacts between returns graze too, rounding of these counts, and the error of the states decides, by Newton's next step.
        """
        steep = np.nan_to_num(np.abs(self._derivatives), nan=0.0, posinf=0.0) @ self.scale
        if (np.abs(self.gaps) <= self.tolerance * self.scale + ROUNDING * steep).all():
            return True
        jacobian = shooting_jacobian(self._derivatives, self.scale)
        if not self.residual <= MOST * self.tolerance or not np.isfinite(jacobian).all() or dependent(jacobian):
            return False
        return bool(np.abs(np.linalg.solve(jacobian, (self.gaps / self.scale).ravel())).max() <= PRECISE)

    @property
    def _derivatives(self) -> Floats:
        """The derivatives of the returns, shape (q, n, n)."""
        return self.returns.slopes

    @property
    def exists(self) -> bool:
        """True if every return on it is certified, with an image and not within rounding of a graze, and it takes time.

        Chatter at speeds below the tolerance returns at once, next to where it started, and would pass for an orbit.
        """
        return bool(self.returns.decided.all()) and not ends_at_once(self.returns, self.least_time)

    @cached_property
    def derivative(self) -> Floats:
        """The derivative of the q-th return at the first state, shape (n, n)."""
        return product_of(self._derivatives)

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """The eigenvalues of the derivative, shape (n,), the largest first; NaN where it is not known."""
        derivative = self.derivative
        if not np.isfinite(derivative).all():
            return np.full(len(derivative), complex(np.nan, np.nan))
        values = np.linalg.eigvals(derivative).astype(complex)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def stable(self) -> bool | None:
        """True if every multiplier lies within the unit circle; None where the multipliers are unknown."""
        return stability(self.multipliers)


def least_period(states: Floats, coordinates: Coordinates, scale: Floats, share: float = SAME) -> int:
    """The least number of returns, a divisor of q, after which states (q, n) of a cycle agree, to a share of a scale."""
    q = len(states)
    divisors = (p for p in range(1, q + 1) if q % p == 0)
    return next((p for p in divisors if coordinates.near(states, np.roll(states, -p, axis=0), share, scale).all()), q)


def stability(multipliers: ArrayLike) -> bool | None:
    """True if all of some multipliers lie within the unit circle; None if one is not a number, or there is none."""
    size = np.abs(multipliers)
    return None if np.isnan(size).any() or not size.size else bool((size < 1).all())


@checked
def periodic_orbit(
    system: ReturnMap, start: StateLike, period: int = 1, *, tolerance: float = 1e-10, scale: ArrayLike | None = None
) -> PeriodicOrbit:
    """The periodic orbit near a guess, by Newton's method in all its states at once, with the map's derivative.

    Steps are halved until they reduce the residual. The orbit found may have a divisor of the period.

    Args:
        system: with derivatives, such as an exact system, a composite map or one of strips.
        start: the first state, shape (n,) or a mapping by name, whose images are the others; or all states, shape (period, n).
        period: q, in returns.
        tolerance: largest residual of a converged orbit, as a share of the scale; see `PeriodicOrbit.converged`.
        scale: shape (n,), unit of each coordinate; if omitted the extent of the motion, a radian for an angle, of a map that
            states neither flights nor `extents` the largest magnitude on the orbit and its guess.

    Raises:
        StateError: a guess of another shape.
        NsmapsError: a period below one, or a map without a derivative.
    """
    if period < 1:
        raise NsmapsError(f"the period is {period}; expected: at least one return")
    states = np.atleast_2d(as_starts(start, ReturnMap.require(system, "a periodic orbit").coordinates))
    dim = len(system.coordinates)
    if states.shape not in ((1, dim), (period, dim)):
        raise StateError(f"the guess has shape {states.shape}; expected: ({dim},) or ({period}, {dim})")
    states = system.on_section(states)
    if len(states) < period:
        states = orbit(system, states[0], period - 1).states
    size = None if scale is None else np.asarray(scale, float)
    return refined(system, system.first_return(states, derivative=True), tolerance, size)


def refined(return_map: ReturnMap, now: Returns, tolerance: float = 1e-10, scale: Floats | None = None) -> PeriodicOrbit:
    """As `periodic_orbit`, from the returns of the states of a guess, with derivatives."""
    coordinates, states, least = Coordinates(return_map.coordinates), now.start, least_time(return_map, now)
    size = scale_of(return_map, states) if scale is None else scale
    for _ in range(MOST_STEPS):
        nearer = _nearer(return_map, now, newton_step(now, size), size)
        now = now if nearer is None else nearer
        if nearer is None or ends_at_once(now, least):  # in no time states agree with their images, but no motion closes
            break
    start = coordinates.wrap(now.start)
    returns = now if np.array_equal(start, now.start) else return_map.first_return(start, derivative=True)
    return PeriodicOrbit(returns, tolerance, scale_of(return_map, returns.start, beside=states) if scale is None else size, least)


def least_time(return_map: ReturnMap, guess: Returns) -> float:
    """The time that an orbit must take, from the period of a map's forcing and the times of a guess; 0 where they are unknown."""
    rate = return_map.phase_rate() if isinstance(return_map, ExactMap) else 0.0
    times = np.append(guess.time[np.isfinite(guess.time)].sum(), 2 * np.pi / rate if rate else 0.0)
    return INSTANT * float(times.max())


def ends_at_once(returns: Returns, least: float) -> bool:
    """True if returns together take no more than the least time; False if it is 0, that of maps whose times are unknown."""
    return least > 0 and float(returns.time.sum()) <= least


def _gaps(returns: Returns) -> Floats:
    """The differences of the image of each state and the next state, shape (q, n)."""
    return returns.coordinates.difference(returns.image, np.concatenate([returns.start[1:], returns.start[:1]]))


def shooting_jacobian(derivative: Floats, scale: Floats) -> Floats:
    """The derivatives of the gaps of q states by these, shape (q n, q n), both in units of a scale (n,) of the coordinates.

    Args:
        derivative: of the returns, shape (q, n, n).
    """
    q, n, _ = derivative.shape
    scaled = derivative * scale / scale[:, None]
    if q == 1:
        return np.asarray(scaled[0] - np.eye(n))
    jacobian, k = np.zeros((q, n, q, n)), np.arange(q)
    jacobian[k, :, k] += scaled
    jacobian[k, :, (k + 1) % q] -= np.eye(n)
    return jacobian.reshape(q * n, q * n)


def newton_step(returns: Returns, scale: Floats) -> Floats:
    """Newton's step of all states, shape (q, n); NaN where there is none.

    Where an orbit is one of a family, as of motions that keep their energy, it is the shortest of those that lead to the family.
    """
    jacobian, right = shooting_jacobian(returns.slopes, scale), -(_gaps(returns) / scale).ravel()
    try:
        if np.isfinite(jacobian).all() and dependent(jacobian):
            step = np.linalg.lstsq(jacobian, right, rcond=FAMILY)[0]
        else:
            step = np.linalg.solve(jacobian, right)
    except np.linalg.LinAlgError:
        return np.full_like(returns.start, np.nan)
    return np.asarray(step.reshape(returns.start.shape) * scale, np.float64)


def dependent(jacobian: Floats) -> bool:
    """True if equations with this derivative, each by the length of its gradient, are not independent up to rounding.

    The derivative has a row an equation, shape (N, N), or (N, N + 1) with a column of a parameter.
    """
    lengths = np.linalg.norm(jacobian, axis=1)
    if not lengths.min() > FAMILY * min(lengths.max(), 1.0):
        return True
    scaled = jacobian / lengths[:, None]
    rows, columns = scaled.shape
    if rows == columns > MANY and np.linalg.cond(scaled, 1) * rows * FAMILY < 1:  # bounds that of singular values
        return False
    sizes = np.linalg.svd(scaled, compute_uv=False)
    return bool(sizes[-1] <= FAMILY * sizes[0])


def _nearer(return_map: ReturnMap, now: Returns, step: Floats, scale: Floats) -> Returns | None:
    """The returns from states that a step, or a part of it, brings nearer to an orbit in this scale; None where none does.

    Parts within the precision of a state are not tried.
    """
    if not np.isfinite(step).all():
        return None
    before, share, length = np.linalg.norm(_gaps(now) / scale), 1.0, np.abs(step / scale).max()
    while share == 1 or (share >= LEAST_SHARE and share * length > ROUNDING):
        start = return_map.on_section(now.start + share * step)
        if np.array_equal(start, now.start):  # below rounding: no shorter part moves a state either
            return None
        there = return_map.first_return(start, derivative=True)
        if np.linalg.norm(_gaps(there) / scale) < before:
            return there
        share /= 2
    return None
