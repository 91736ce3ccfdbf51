"""The formulas of a system with modes followed by an integrator, through sliding and lasting contact; no engine is used."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from nsmaps.arrays import Bools, Floats
from nsmaps.exact.systems.guards import Guard, SlidingSurface
from nsmaps.exact.systems.hybrid import HybridSystem

EVENTS = 120  #: of one return, those of chatter included
LOOKS, SHORTEST = 2_000, 1e-7  #: times at which guards are looked at on a path, and the share of it of the first after its start
CONTACT = 1e-6  #: impacts that accumulate within this share of a return are taken as contact
RELATIVE, ABSOLUTE = 1e-11, 1e-13  #: tolerances of the integrator


@dataclass(frozen=True)
class Exit:
    """An event by which a motion leaves a mode, where `zero` falls through zero."""

    name: str
    zero: Any
    to: str  #: the mode that follows
    guard: Guard | None = None  #: whose reset takes place
    where: Sequence[Any] = ()
    release: bool = False  #: of contact that lasts
    held: Sequence[Any] = field(default=())  #: what is zero all along before it


class Formulas:
    """The formulas of a system at its parameters, as functions of the time and of the states."""

    def __init__(self, system: HybridSystem) -> None:
        self.t, self.states = sp.Symbol("t"), [sp.Symbol(name) for name in system.states]
        y = system._arguments(dict(zip(system.states, self.states, strict=True)))
        self.given, self.section = system.guards(self.t, y), system.section(self.t, y)
        self.names, self.modes = system.states, {name: dict(rates) for name, rates in system.modes(self.t, y).items()}
        self.contacts: dict[str, Guard] = {}
        self._compiled: dict[tuple[Any, ...], Callable[..., Any]] = {}
        self._exits: dict[str, list[Exit]] = {}
        for name, guard in self.given.items():
            if isinstance(guard, SlidingSurface):
                self.modes[name] = self._sliding(guard)
            elif guard.rests:
                self.contacts[guard.rests] = guard
                self.modes[guard.rests] = self._resting(guard)

    def of(self, *formulas: Any) -> Callable[..., Any]:
        """Formulas as a function of the time and of the states."""
        if formulas not in self._compiled:
            self._compiled[formulas] = sp.lambdify((self.t, *self.states), list(formulas), "numpy")
        return self._compiled[formulas]

    def rate(self, formula: Any, mode: str) -> Any:
        """The rate of a formula in a mode."""
        formula = sp.sympify(formula)
        return formula.diff(self.t) + sum(formula.diff(s) * self.modes[mode][s.name] for s in self.states)

    def _sliding(self, given: SlidingSurface) -> dict[str, Any]:
        """Filippov's convex combination of the rates above and below a surface."""
        a, b = (self.rate(given.function, mode) for mode in (given.above, given.below))
        above, below = self.modes[given.above], self.modes[given.below]
        return {name: above[name] - a * (above[name] - below[name]) / (a - b) for name in self.names}

    def _resting(self, guard: Guard) -> dict[str, Any]:
        """The rates in contact: the force acts along the jump of an impact, and keeps the second rate of the function at zero."""
        free = guard.watched[0]
        lift = self.rate(self.rate(guard.function, free), free)
        return {name: self.modes[free][name] - lift * q for name, q in zip(self.names, self.jump(guard), strict=True)}

    def jump(self, guard: Guard) -> list[Any]:
        """The direction in which an impact changes the states, in which the rate of the guard's function grows by one."""
        speed = sp.sympify(self.rate(guard.function, guard.watched[0]))
        jumps = [guard.reset.get(s.name, s) - s for s in self.states]
        whole = sum(speed.diff(s) * jump for s, jump in zip(self.states, jumps, strict=True))
        return [sp.simplify(jump / whole) for jump in jumps]

    def exits(self, mode: str) -> list[Exit]:
        """The events of a mode."""
        if mode not in self._exits:
            self._exits[mode] = list(self._found(mode))
        return self._exits[mode]

    def _found(self, mode: str) -> Iterator[Exit]:
        for name, guard in self.given.items():
            if isinstance(guard, SlidingSurface):
                yield from self._surface(name, guard, mode)
            elif mode in guard.watched:
                yield Exit(name, guard.function, guard.to or mode, guard, guard.where)
            elif mode == guard.rests:
                free = guard.watched[0]
                press = -self.rate(self.rate(guard.function, free), free)
                yield Exit(name, press, free, release=True)

    def _surface(self, name: str, given: SlidingSurface, mode: str) -> Iterator[Exit]:
        """The events of a mode at a surface along which motions slide."""
        rise, fall = self.rate(given.function, given.below), -self.rate(given.function, given.above)
        up = sp.sympify(given.function)
        for here, other, zero, into in ((given.above, given.below, up, rise), (given.below, given.above, -up, fall)):
            if mode == here:
                yield Exit(f"{here} to {name}", zero, name, where=(into,))
                yield Exit(f"{here} to {other}", zero, other, where=(-into,))
        if mode == name:
            yield Exit(f"{name} to {given.above}", fall, given.above, held=(given.function,))
            yield Exit(f"{name} to {given.below}", rise, given.below, held=(given.function,))

    def starts(self, coordinates: Sequence[str], row: Floats, t: float) -> Iterator[tuple[str, Floats, Guard | None]]:
        """The modes and states in which a motion may begin at the section, and the guard whose reset is behind it."""
        names = (self.section.guards,) if isinstance(self.section.guards, str) else self.section.guards
        given = {s: x for s in self.states for name, x in zip(coordinates, row.tolist(), strict=True) if s.name == name}
        known = {sp.Symbol(name): sp.sympify(value).subs(self.t, t).subs(given) for name, value in self.section.states.items()}
        left = [s for s in self.states if s not in given and s not in known]
        every = (one for mode in self.modes for one in self.exits(mode))
        for one in (one for one in every if one.name in names and not one.release):
            found = self._left(one, t, {**given, **known}, left) if left else {}
            state = np.array([float({**given, **known, **found}[s]) for s in self.states])
            yield one.to, state if self.section.side == "after" else self.after(one.guard, t, state), one.guard

    def _left(self, one: Exit, t: float, known: dict[Any, Any], left: Sequence[Any]) -> dict[Any, Any]:
        """The states of the section that are left at an event, by its zeros, and just after it by the reset too."""
        zeros = [sp.sympify(zero).subs(self.t, t) for zero in (one.zero, *one.held)]
        if self.section.side == "before" or one.guard is None:
            return sp.solve([zero for each in zeros if (zero := each.subs(known)).free_symbols], left, dict=True)[0]
        reset = {s: sp.sympify(one.guard.reset.get(s.name, s)).subs(self.t, t) for s in self.states}
        (before, *_) = sp.solve([*zeros, *(reset[s] - x for s, x in known.items())], self.states, dict=True)
        return {s: reset[s].subs(before) for s in left}

    def time_of_section(self, period: Any) -> float:
        """The time at which a section at a clock is met, within a period; zero for another section."""
        names = (self.section.guards,) if isinstance(self.section.guards, str) else self.section.guards
        zero = sp.sympify(next((one.zero for mode in self.modes for one in self.exits(mode) if one.name in names), 0))
        if period is None or zero.free_symbols != {self.t}:
            return 0.0
        value = sp.lambdify(self.t, zero, "numpy")
        times = float(period) * (np.arange(LOOKS + 1) - 0.5) / LOOKS
        falls = np.flatnonzero((value(times[:-1]) > 0) & (value(times[1:]) <= 0))
        return float(brentq(value, times[falls[0]], times[falls[0] + 1], xtol=1e-15)) if len(falls) else 0.0

    def after(self, guard: Guard | None, t: float, state: Floats) -> Floats:
        """The states just after an event."""
        if guard is None:
            return state
        return np.array(self.of(*(guard.reset.get(s.name, s) for s in self.states))(t, *state), float)

    def touching(self, guard: Guard, t: float, before: Floats, after: Floats, length: float) -> Floats | None:
        """The states in contact where impacts accumulate from here on within a small share of a return, else None."""
        free = guard.watched[0]
        speed = self.rate(guard.function, free)
        value, lift = self.of(speed, self.rate(speed, free))(t, *after)
        approach = -self.of(speed)(t, *before)[0]
        if not (lift < 0 and value < approach) or 2 * value / (-lift * (1 - value / approach)) > CONTACT * length:
            return None
        return after - value * np.array(self.of(*self.jump(guard))(t, *after), float)


def followed(
    formulas: Formulas, begun: tuple[str, Floats, Guard | None], t: float, length: float, stuck: bool
) -> tuple[float, Floats] | None:
    """How long a return of about this length takes by an integrator, and the states at its end; None where it does not end then.

    Impacts at the section accumulate only where the return is `stuck`; else each is a return.
    """
    names = (formulas.section.guards,) if isinstance(formulas.section.guards, str) else formulas.section.guards
    (mode, state, guard), start, end = begun, t, t + length * (1 + 1e-3)
    if guard is not None and guard.rests and stuck:
        mode = guard.rests
        state = state - _speed(formulas, guard, t, state)
    for _ in range(EVENTS):
        path, met = _flight(formulas, mode, t, state, end)
        if met is None:
            return None
        t, one = met
        before = path(t)
        after = formulas.after(one.guard, t, before)
        if one.name in names and (not stuck or one.release):
            return t - start, after if formulas.section.side == "after" else before
        if one.guard is not None and one.guard.ends:
            return None
        mode, state = one.to, after
        if one.guard is not None and one.guard.rests:
            held = formulas.touching(one.guard, t, before, after, end - start)
            mode, state = (mode, state) if held is None else (one.guard.rests, held)
    return None


def _speed(formulas: Formulas, guard: Guard, t: float, state: Floats) -> Floats:
    """What an impact without speed takes from the states."""
    speed = formulas.of(formulas.rate(guard.function, guard.watched[0]))(t, *state)[0]
    return float(speed) * np.array(formulas.of(*formulas.jump(guard))(t, *state), float)


def _flight(formulas: Formulas, mode: str, t: float, state: Floats, end: float) -> tuple[Any, tuple[float, Exit] | None]:
    """The path of a mode from a state on, and its first event until the end, by signs at many times and their roots."""
    rates, span = formulas.of(*(formulas.modes[mode][name] for name in formulas.names)), max(end - t, 1e-300)
    path = solve_ivp(
        lambda x, z: rates(x, *z), (t, end), state, "DOP853", dense_output=True, rtol=RELATIVE, atol=ABSOLUTE, max_step=span / 50
    ).sol
    times = np.unique(t + span * np.concatenate([np.linspace(0, 1, LOOKS), np.geomspace(SHORTEST, 1, LOOKS // 4)]))
    states, found = path(times), []
    for one in formulas.exits(mode):
        zero, allowed = formulas.of(one.zero), formulas.of(*one.where)
        values = np.broadcast_to(np.asarray(zero(times, *states)[0], float), times.shape)
        falls: Bools = (values[:-1] > 0) & (values[1:] <= 0)
        for k in np.flatnonzero(falls):
            at = brentq(lambda x, zero=zero: zero(x, *path(x))[0], times[k], times[k + 1], xtol=1e-15)
            if at - t > SHORTEST * span and all(x >= 0 for x in allowed(at, *path(at))):
                found.append((at, one))
    return path, min(found, key=lambda pair: pair[0], default=None)
