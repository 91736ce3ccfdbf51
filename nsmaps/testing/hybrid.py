"""Whether a system with modes is one: its returns, derivatives and parameters, and its flights by an independent integrator."""

import warnings
from collections.abc import Callable, Iterator, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, as_states
from nsmaps.errors import CheckError
from nsmaps.exact.hybrid import Guard, HybridSystem
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.testing.formulas import check_description, neighbours

TRIALS, SIZES = 200, (-2.0, 1.0)  #: random states without `states`, powers of ten of their sizes
FOLLOWED, EVENTS = 6, 12  #: returns that are integrated, and the events of the longest of them
CLOSE = 1e-7  #: of an integrated state, relative
STEEP = 1e2  #: the largest derivative of returns that are integrated
STEP = 1e-6  #: of differences, relative
LOOKS = 2_000  #: times at which guards are looked at on a path


def check_hybrid(system: HybridSystem, states: ArrayLike | None) -> None:
    """As `check_system`."""
    check_description(system)
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
    good = returns.select(returns.outcome == Outcome.returned)
    unseen = [letter for letter in system.letters if not any(letter in str(word) for word in returns.words)]
    if unseen:
        warnings.warn(
            f"no event {' or '.join(unseen)} of {type(system).__name__} takes place on {len(returns)} returns; is its guard "
            "positive before it, and in the right modes?",
            stacklevel=3,
        )
    _check_derivatives(system, good)
    _check_flights(system, good)
    for name in type(system).parameter_names():
        others = [other.first_return(good.start) for other in neighbours(system, name)]
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


class Formulas:
    """The formulas of a system at its parameters, as functions of the time and of the states; nothing of the engine is used."""

    def __init__(self, system: HybridSystem) -> None:
        t, self.states = sp.Symbol("t"), [sp.Symbol(name) for name in system.states]
        y = SimpleNamespace(**dict(zip(system.states, self.states, strict=True)))
        given, self.section, self.modes = system.guards(t, y), system.section(t, y), system.modes(t, y)
        self.guards = {name: guard for name, guard in given.items() if isinstance(guard, Guard)}
        self.complete = len(self.guards) == len(given) and not any(guard.rests for guard in self.guards.values())
        self.t, self.names = t, system.states

    def of(self, *formulas: Any) -> Callable[..., Any]:
        """Formulas as a function of the time and of the states."""
        return sp.lambdify((self.t, *self.states), list(formulas), "numpy")

    def starts(self, coordinates: Sequence[str], row: Floats, t: float) -> Iterator[tuple[str, Floats]]:
        """The modes and states in which a motion may begin at the section."""
        names = (self.section.guards,) if isinstance(self.section.guards, str) else self.section.guards
        given = {s: x for s in self.states for name, x in zip(coordinates, row.tolist(), strict=True) if s.name == name}
        known = {sp.Symbol(name): sp.sympify(value).subs(self.t, t).subs(given) for name, value in self.section.states.items()}
        for guard in (self.guards[name] for name in names):
            zero = sp.sympify(guard.function).subs(self.t, t).subs({**given, **known})
            left = [s for s in self.states if s not in given and s not in known]
            found = {s: sp.solve(zero, s)[0] for s in left}
            state = np.array([float({**given, **known, **found}[s]) for s in self.states])
            for mode in guard.watched:
                yield guard.to or mode, state if self.section.side == "after" else self.after(guard, t, state)

    def after(self, guard: Guard, t: float, state: Floats) -> Floats:
        """The states just after an event."""
        return np.array(self.of(*(guard.reset.get(s.name, s) for s in self.states))(t, *state), float)

    def events(self, mode: str, t: float, path: Any, end: float) -> Iterator[tuple[float, Guard, str]]:
        """The events that the guards of a mode meet on a path from t on, by signs at many times and their roots."""
        times = np.linspace(t, end, LOOKS)
        for name, guard in self.guards.items():
            if mode in guard.watched:
                zero = self.of(guard.function)
                values = np.array([zero(x, *path(x))[0] for x in times])
                for k in np.flatnonzero((values[:-1] > 0) & (values[1:] <= 0)):
                    at = brentq(lambda x, zero=zero: zero(x, *path(x))[0], times[k], times[k + 1], xtol=1e-15)
                    if at - t > CLOSE * (end - t) and all(x >= 0 for x in self.of(*guard.where)(at, *path(at))):
                        yield at, guard, name


def _check_flights(system: HybridSystem, returns: Returns) -> None:
    """Returns of few events end where an integrator has them, from one of the modes in which they may begin."""
    formulas = Formulas(system)
    if not formulas.complete:
        return  # modes that are derived have no formulas of their own
    assert returns.derivative is not None
    calm = np.abs(returns.derivative).max(axis=(1, 2)) < STEEP
    short = np.flatnonzero((np.char.str_len(returns.words) <= EVENTS) & calm)
    for k in short[:: max(1, len(short) // FOLLOWED)]:
        start, angle = returns.start[k], returns.coordinates.angles
        t = float(start[angle][0]) / system.phase_rate() if angle.any() else 0.0
        begun = formulas.starts(returns.coordinates, start, t)
        found = [_followed(formulas, mode, state, t, float(returns.time[k])) for mode, state in begun]
        places = [formulas.names.index(name) for name in returns.coordinates if name in formulas.names]
        wanted = returns.image[k][~angle]
        size = 1 + np.abs(start).max() + np.abs(wanted).max()
        if not any(end is not None and np.abs(end[places] - wanted).max() < CLOSE * STEEP * size for end in found):
            raise CheckError(
                f"the return of {type(system).__name__} from {start} is not that of its formulas: it ends at {wanted} after "
                f"{returns.time[k]:.6g}, an integrator at {[end[places].tolist() for end in found if end is not None]}"
            )


def _followed(formulas: Formulas, mode: str, state: Floats, t: float, length: float) -> Floats | None:
    """The states at the end of a return of this length by an integrator; None where it does not end then."""
    names = (formulas.section.guards,) if isinstance(formulas.section.guards, str) else formulas.section.guards
    end = t + length * (1 + 1e-3)
    for _ in range(10 * EVENTS):
        rates = formulas.of(*(formulas.modes[mode][name] for name in formulas.names))
        span = max(end - t, 1e-300)
        found = solve_ivp(
            lambda x, z, rates=rates: rates(x, *z), (t, end), state, "DOP853", dense_output=True, rtol=1e-11, atol=1e-13,
            max_step=span / 50,
        )  # fmt: skip
        met = min(formulas.events(mode, t, found.sol, end), key=lambda one: one[0], default=None)
        if met is None:
            return None
        t, guard, name = met
        before = found.sol(t)
        if name in names:
            return formulas.after(guard, t, before) if formulas.section.side == "after" else before
        state, mode = formulas.after(guard, t, before), guard.to or mode
        if guard.ends:
            return None
    return None
