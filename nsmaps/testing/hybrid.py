"""Whether a system with modes is one: its returns, derivatives and parameters, and its flights by an independent integrator."""

import warnings

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, as_states
from nsmaps.errors import CheckError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.testing.formulas import check_description, check_units, neighbours
from nsmaps.testing.mode_formulas import Formulas, followed

TRIALS, SIZES = 200, (-2.0, 1.0)  #: random states without `states`, powers of ten of their sizes
FOLLOWED, EVENTS = 6, 12  #: returns that are integrated, and the events of the longest of them
CLOSE = 1e-7  #: of an integrated state, relative
STEEP = 1e2  #: the largest derivative of returns that are integrated
STEP = 1e-6  #: of differences, relative


def check_hybrid(system: HybridSystem, states: ArrayLike | None) -> None:
    """As `check_system`."""
    check_description(system)
    check_units(system)
    period = system.period()
    if period is not None and not float(period) > 0:
        raise CheckError(f"the period of {type(system).__name__} is {float(period):.6g}; expected: a positive number, or None")
    starts = _trial_states(system) if states is None else as_states(states, system.coordinates)
    returns = system.first_return(starts, derivative=True)
    if not returns.valid.any():
        raise CheckError(
            f"none of {len(returns)} states of {type(system).__name__} returns to its section ({returns.counts()}); expected: "
            "`states` at the section from which the motion returns"
        )
    unseen = [letter for letter in system.letters if not any(letter in str(word) for word in returns.words)]
    if unseen:
        warnings.warn(
            f"no event {' or '.join(unseen)} of {type(system).__name__} takes place on {len(returns)} returns; is its guard "
            "positive before it, and in the right modes?",
            stacklevel=3,
        )
    _check_derivatives(system, returns.select(returns.outcome == Outcome.returned))
    good = returns.select(returns.certified)
    _check_flights(system, good)
    for name in type(system).parameter_names():
        others = [other.first_return(good.start, derivative=True) for other in neighbours(system, name)]
        if others and all(np.array_equal(other.image, good.image, equal_nan=True) for other in others):
            raise CheckError(
                f"no return of {type(system).__name__} depends on its parameter {name!r}: the same from {len(good)} states with "
                f"{name} a hundredth more or less; expected: an effect, `states` that show it, or no such parameter"
            )


def _trial_states(system: HybridSystem) -> Floats:
    """Random states of all sizes and signs, with phases of a whole turn."""
    rng = np.random.default_rng(1)
    shape = TRIALS, len(system.coordinates)
    states = 10 ** rng.uniform(*SIZES, shape) * rng.choice([-1.0, 1.0], shape)
    return np.where(system.coordinates.angles, rng.uniform(0, TWO_PI, shape), states)


def _check_derivatives(system: HybridSystem, returns: Returns) -> None:
    """The derivatives are those of differences wherever two differences agree."""
    assert returns.derivative is not None
    for k in range(returns.start.shape[1]):
        quotients = []
        for share in (1.0, 0.5):
            h = share * STEP * np.maximum(np.abs(returns.start[:, k]), 1e-3)
            ends = [returns.start + sign * h[:, None] * np.eye(returns.start.shape[1])[k] for sign in (1, -1)]
            up, down = (system.first_return(end) for end in ends)
            same = (up.codes == returns.codes) & (down.codes == returns.codes)
            quotients.append(np.where(same[:, None], (up.lifted - down.lifted) / (2 * h[:, None]), np.nan))
        size = 1e-3 + np.abs(returns.derivative).max(axis=(1, 2))[:, None]
        sure = np.abs(quotients[0] - quotients[1]) <= 0.1 * 1e-3 * size
        off = np.where(sure, np.abs(quotients[1] - returns.derivative[:, :, k]) / size, 0.0)
        if off.max(initial=0.0) > 1e-3:
            row = int(off.max(axis=1).argmax())
            raise CheckError(
                f"the derivative of {type(system).__name__} by {returns.coordinates[k]} at {returns.start[row]} is "
                f"{returns.derivative[row, :, k]}; expected: {quotients[1][row]}, the difference of two returns"
            )


def _check_flights(system: HybridSystem, returns: Returns) -> None:
    """Returns of few events end where an integrator has them, from one of the modes in which they may begin."""
    formulas = Formulas(system)
    assert returns.derivative is not None
    calm = np.abs(returns.derivative).max(axis=(1, 2)) < STEEP
    short = np.flatnonzero((np.char.str_len(returns.words) <= EVENTS) & calm)
    for k in short[:: max(1, len(short) // FOLLOWED)]:
        start, angle = returns.start[k], returns.coordinates.angles
        t = float(start[angle][0]) / system.phase_rate() if angle.any() else 0.0
        stuck = returns.outcome[k] == Outcome.stuck
        begun = formulas.starts(returns.coordinates, start, t)
        found = [followed(formulas, one, t, float(returns.time[k]), bool(stuck)) for one in begun]
        places = [formulas.names.index(name) for name in returns.coordinates if name in formulas.names]
        wanted = returns.image[k][~angle]
        size = 1 + np.abs(start).max() + np.abs(wanted).max()
        if not any(end is not None and np.abs(end[places] - wanted).max() < CLOSE * STEEP * size for end in found):
            raise CheckError(
                f"the return of {type(system).__name__} from {start} is not that of its formulas: it ends at {wanted} after "
                f"{returns.time[k]:.6g}, an integrator at {[end[places].tolist() for end in found if end is not None]}"
            )
