"""Whether a system with modes is one: its returns, derivatives and parameters, and its flights by an independent integrator."""

import warnings

import numpy as np

from nsmaps.arrays import ArrayLike
from nsmaps.coordinates import as_states
from nsmaps.errors import CheckError
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.testing.maps import check_derivatives, check_influence, trial_states
from nsmaps.testing.mode_formulas import Formulas, followed

FOLLOWED, EVENTS = 6, 12  #: returns that are integrated, and the events of the longest of them
CLOSE = 1e-7  #: of an integrated state, relative
STEEP = 1e2  #: the largest derivative of returns that are integrated


def check_hybrid(system: HybridSystem, states: ArrayLike | None) -> None:
    """As `check_system`."""
    period = system.period()
    if period is not None and not float(period) > 0:
        raise CheckError(f"the period of {type(system).__name__} is {float(period):.6g}; expected: a positive number, or None")
    starts = trial_states(system) if states is None else as_states(states, system.coordinates)
    returns = system.first_return(starts, derivative=True)
    stopped = np.flatnonzero(returns.outcome == Outcome.blocked)
    if states is not None and stopped.size:
        (why,) = system.reasons(starts[stopped[:1]])
        raise CheckError(f"{type(system).__name__} cannot continue from {starts[stopped[0]]}: {why}")
    if not returns.valid.any():
        raise CheckError(
            f"none of {len(returns)} states of {type(system).__name__} returns to its section ({returns.counts()}); expected: "
            f"`states` at the section from which the motion returns. Of {starts[0]}: {system.reasons(starts[:1])[0]}"
        )
    later = _continued(system, returns.select(returns.outcome == Outcome.returned))
    words = [str(word) for word in (*returns.words, *later.words)]
    unseen = [letter for letter in system.letters if not any(letter in word for word in words)]
    if unseen:
        warnings.warn(
            f"no event {' or '.join(unseen)} of {type(system).__name__} takes place on {len(returns)} returns; is its guard "
            "positive before it, and in the right modes?",
            stacklevel=3,
        )
    tried = later if states is None and later.decided.any() else returns  # no motion may come to a random state
    check_derivatives(system, tried.select(tried.outcome == Outcome.returned), _bound(system))
    _check_flights(system, tried.select(tried.decided))
    both = Returns.concatenate([returns, later])
    good = both.select(both.decided)
    check_influence(system, good)


def _continued(system: HybridSystem, returns: Returns) -> Returns:
    """The returns from the images of others, which must be starts."""
    later = system.first_return(returns.image, derivative=True)
    lost = np.flatnonzero(np.isin(later.outcome, [Outcome.invalid, Outcome.blocked]) & returns.decided)
    if lost.size:
        (why,) = system.reasons(returns.image[lost[:1]])
        raise CheckError(
            f"{type(system).__name__} returns from {returns.start[lost[0]]} to {returns.image[lost[0]]}, from which no "
            f"motion continues: {why} expected: a section whose events are starts again"
        )
    return later


def _bound(system: HybridSystem) -> set[str]:
    """The coordinates by which a state leaves the section, as it has more than are needed."""
    definition = system._definition()
    names = [*definition.states, *(name for name in definition.coordinates if name not in definition.states)]
    rows = [(*zero.coefficients, zero.remainder.diff(PHI)) for start in definition.starts for zero in start.zeros]
    return {name for row in rows for name, c in zip(names, row, strict=False) if c != 0}


def _check_flights(system: HybridSystem, returns: Returns) -> None:
    """Returns of few events end where an integrator has them, from one of the modes in which they may begin."""
    formulas = Formulas(system)
    assert returns.derivative is not None
    calm = np.abs(returns.derivative).max(axis=(1, 2)) < STEEP
    short = np.flatnonzero((np.char.str_len(returns.words) <= EVENTS) & calm)
    for k in short[:: max(1, len(short) // FOLLOWED)]:
        start, angle = returns.start[k], returns.coordinates.angles
        t = float(start[angle][0]) / system.phase_rate() if angle.any() else formulas.time_of_section(system.period())
        stuck = returns.outcome[k] == Outcome.stuck
        begun = formulas.starts(returns.coordinates, start, t)
        found = [followed(formulas, one, t, float(returns.time[k]), bool(stuck)) for one in begun]
        places = [formulas.names.index(name) for name in returns.coordinates if name in formulas.names]
        wanted = returns.image[k][~angle]
        size = 1 + np.abs(start).max() + np.abs(wanted).max(initial=0.0)
        ends = [(time, end[places]) for time, end in filter(None, found)]
        late = CLOSE * STEEP * (1 + float(returns.time[k]))
        near = (abs(time - returns.time[k]) < late and np.abs(end - wanted).max(initial=0.0) < late * size for time, end in ends)
        if not any(near):
            there = " or ".join(f"at {end} after {time:.6g}" for time, end in ends) or "is at no section then"
            raise CheckError(
                f"the return of {type(system).__name__} from {start} is not that of its formulas: it ends at {returns.image[k]} "
                f"after {returns.time[k]:.6g}, with the word {returns.words[k]}, an integrator of its formulas {there}"
            )
