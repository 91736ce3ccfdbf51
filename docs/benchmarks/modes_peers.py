"""Other programs on first returns of systems with modes: heyoka and SciPy, set up from the formulas of the class alone.

Each has a callable that takes motions from just after the section's event, time (N,), states (n, N) and modes (N,), and writes
time and states where they next meet the section, and the letters on the way. Resets and the choice among guards of one function
are functions of floats, made once.
"""

from dataclasses import dataclass
from functools import cached_property

import heyoka as hy
import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from words import Plain, T

LANES = hy.recommended_simd_size()
LONGEST = 1e5  # units of time that a batch may take
OFF = 1e-9  # of a unit of time by which motions start off the section: the curvature of the flight is then less than rounding
TURNS = 64  # chunks of starts after which the time of a batch begins anew, so that phases keep their digits


@dataclass(frozen=True)
class Branch:
    """What happens at an event if its conditions hold."""

    conditions: object  # of time and states: whether they hold
    reset: object  # of time and states: the states just after, None where nothing jumps
    target: str  # "" for the same mode
    letter: str
    section: bool
    ends: bool
    back: bool  # whether the function of the event, or its opposite, is watched in the mode that follows


@dataclass(frozen=True)
class Event:
    """One function that falls through zero in some modes."""

    modes: tuple
    function: sp.Expr
    branches: tuple

    def happen(self, t, y):
        """The branch that takes place."""
        return next(one for one in self.branches if one.conditions is None or one.conditions(t, *y))


@dataclass(frozen=True)
class Written:
    """The formulas of a system."""

    system: object

    @cached_property
    def states(self):
        return Plain(self.system).symbols

    @cached_property
    def rates(self):
        given = self.system.modes(T, Plain(self.system).states)
        return {mode: [sp.sympify(rates[name]) for name in self.system.states] for mode, rates in given.items()}

    @cached_property
    def after(self):
        return self.section.side == "after"

    @cached_property
    def section(self):
        return self.system.section(T, Plain(self.system).states)

    @cached_property
    def events(self):
        names = self.section.guards
        sections = (names,) if isinstance(names, str) else tuple(names)
        found = {}
        given = self.system.guards(T, Plain(self.system).states)
        for name, guard in given.items():
            letter = name[0] if guard.letter is None else guard.letter
            reset = [sp.sympify(guard.reset.get(str(state), state)) for state in self.states] if guard.reset else None
            branch = Branch(
                self.holding(guard.where), reset and self.function(*reset), guard.to, letter, name in sections, guard.ends,
                any(guard.to in other.watched and sp.expand(other.function + guard.function) == 0 for other in given.values()),
            )  # fmt: skip
            found.setdefault((guard.watched, sp.sympify(guard.function)), []).append(branch)
        return [Event(*key, tuple(branches)) for key, branches in found.items()]

    def function(self, *exprs):
        return sp.lambdify((T, *self.states), list(exprs) if len(exprs) > 1 else exprs[0], "math", cse=True)

    def holding(self, where):
        return sp.lambdify((T, *self.states), sp.And(*(sp.sympify(one) >= 0 for one in where)), "math") if where else None


class Heyoka:
    """heyoka's Taylor integrator to the precision of doubles: one integrator for all modes, and events that go on by themselves.

    Which mode a motion is in is a parameter of each mode; a guard of another mode is the constant 1. At an event a callback
    writes the states just after; at the section it stores the return and loads the next start, so that neither the
    integrator nor a loop in Python begins anew. With `lanes` that many motions are side by side in vector instructions. With
    `variations` the derivatives of each flight by its states are integrated beside it, and left as they are at its end.
    """

    def __init__(self, written, unit, lanes=0, variations=False):
        self.w, self.unit, self.lanes, self.modes = written, unit, lanes, list(written.rates)
        several = len(self.modes) if len(self.modes) > 1 else 0
        self.unit_slopes = np.eye(len(written.states)).ravel()
        self.flags = dict(zip(self.modes, np.eye(len(self.modes))[:, :several], strict=True))
        self.rates = {mode: written.function(*rates) for mode, rates in written.rates.items()}
        system, events = self.translated(several)
        size, more, self.variations = len(system), 1 + several, variations
        if lanes:
            zeros, pars = np.zeros((size, lanes)).tolist(), np.zeros((more, lanes)).tolist()
            self.ta = hy.taylor_adaptive_batch(system, zeros, pars=pars, t_events=events)
            self.states, self.pars = list(self.ta.state.T), list(self.ta.pars.T)
        else:
            system = hy.var_ode_sys(system, hy.var_args.vars, order=1) if variations else system
            self.ta = hy.taylor_adaptive(system, [0.0] * size, t_events=events)
            self.states, self.pars = [self.ta.state[:size]], [self.ta.pars if len(self.ta.pars) else np.zeros(more)]
            self.slopes = self.ta.state[size:]

    def translated(self, several):
        """The rates and events in heyoka's expressions."""
        written = self.w
        flags = {mode: hy.par[1 + k] for k, mode in enumerate(self.modes[:several])}
        names = [hy.make_vars(str(state)) for state in written.states]
        clock, shift = sp.symbols("clock shift")
        given = {clock: hy.time, shift: hy.par[0], **dict(zip(written.states, names, strict=True))}
        read = lambda expr: hy.from_sympy(sp.sympify(expr).subs(T, clock + shift).evalf(17), given)  # noqa: E731
        first, *others = self.modes
        system = []
        for k, name in enumerate(names):
            rate = read(written.rates[first][k])
            for mode in others:
                more = sp.expand(written.rates[mode][k] - written.rates[first][k])
                rate = rate if more == 0 else rate + flags[mode] * read(more)
            system.append((name, rate))
        return system, [self.event(one, read, flags) for one in written.events]

    def event(self, one, read, flags):
        function = read(one.function)
        if set(one.modes) != set(self.modes):
            on = sum((flags[mode] for mode in one.modes[1:]), start=flags[one.modes[0]])
            function = on * function + (1.0 - on)

        def met(ta, sign, lane=0):
            return self.happen(one, lane)

        make = hy.t_event_batch if self.lanes else hy.t_event
        return make(function, callback=met, direction=hy.event_direction.negative)

    def now(self, lane):
        return self.ta.time[lane] if self.lanes else self.ta.time

    def happen(self, one, lane):
        """Take the motion of a lane through an event; False when all starts have been taken."""
        state, pars, number = self.states[lane], self.pars[lane], self.number[lane]
        t, y = self.now(lane) + pars.item(0), state.tolist()
        branch = one.happen(t, y)
        self.letters[number].append(branch.letter)
        if branch.section or branch.ends:
            self.found[number] = [t, *(branch.reset(t, *y) if self.w.after and branch.reset else y)]
            return self.load(lane)
        after = branch.reset(t, *y) if branch.reset else y
        if branch.target:
            pars[1:] = self.flags[branch.target]
            if branch.back:
                t, after = self.off(t, after, branch.target)
                pars[0] = t - self.now(lane)
        if after is not y:
            state[:] = after
        if self.variations:
            self.slopes[:] = self.unit_slopes
        return True

    def off(self, t, y, mode):
        """A motion a little later: one that begins on the zero of an event may lose the next zero."""
        h = OFF * self.unit
        return t + h, [x + h * rate for x, rate in zip(y, self.rates[mode](t, *y), strict=True)]

    def load(self, lane):
        """Write the next start to a lane; False when there is none. A lane without a start repeats the last."""
        number = next(self.left, self.last)
        if number == self.last:
            self.under_way -= self.number[lane] != self.last
            if self.under_way == 0:
                return False
        self.number[lane] = number
        t, self.states[lane][:] = self.off(*self.starts[number])
        self.pars[lane][0] = t - self.now(lane)
        self.pars[lane][1:] = self.flags[self.starts[number][2]]
        if self.variations:
            self.slopes[:] = self.unit_slopes
        return True

    def __call__(self, t, y, mode):
        self.starts = list(zip(t.tolist(), y.T.tolist(), mode.tolist(), strict=True))
        self.starts.append(self.starts[-1])
        n, lanes = len(t), max(self.lanes, 1)
        self.last, self.found, self.letters = n, [None] * (n + 1), [[] for _ in range(n + 1)]
        for begin in range(0, n, TURNS * lanes):
            part = range(begin, min(begin + TURNS * lanes, n))
            if self.lanes:
                self.ta.set_time([0.0] * lanes)
            else:
                self.ta.time = 0.0
            self.left, self.under_way, self.number = iter(part), lanes + 1, [-1] * lanes
            for lane in range(lanes):
                self.load(lane)
            self.under_way = min(lanes, len(part))
            self.ta.reset_cooldowns()
            end = LONGEST * self.unit
            self.ta.propagate_until([end] * lanes if self.lanes else end)
        return np.array(self.found[:n]).T, ["".join(one) for one in self.letters[:n]]


class SciPy:
    """`solve_ivp` with DOP853 and terminal events, a call a flight."""

    def __init__(self, written, rtol=1e-12):
        self.w, self.rtol = written, rtol
        self.rates = {mode: written.function(*rates) for mode, rates in written.rates.items()}
        self.watched = {mode: [one for one in written.events if mode in one.modes] for mode in written.rates}
        self.functions = {mode: [self.falling(one) for one in events] for mode, events in self.watched.items()}

    def falling(self, one):
        made = self.w.function(one.function)
        zero = lambda t, y: made(t, *y)  # noqa: E731
        zero.terminal, zero.direction = True, -1
        return zero

    def one(self, t, y, mode):
        letters = ""
        while True:
            rates = self.rates[mode]
            flight = solve_ivp(
                lambda t, y, rates=rates: rates(t, *y), (t, np.inf), y, "DOP853",
                events=self.functions[mode], rtol=self.rtol, atol=1e-14,
            )  # fmt: skip
            which = next(k for k, times in enumerate(flight.t_events) if len(times))
            t, y = float(flight.t_events[which][0]), flight.y_events[which][0]
            branch = self.watched[mode][which].happen(t, y)
            letters += branch.letter
            after = branch.reset(t, *y) if branch.reset else y
            if branch.section or branch.ends:
                return np.array([t, *(after if self.w.after else y)]), letters
            y, mode = np.array(after), branch.target or mode

    def __call__(self, t, y, mode):
        found = [self.one(*start) for start in zip(t.tolist(), y.T, mode.tolist(), strict=True)]
        return np.array([one for one, _ in found]).T, [letters for _, letters in found]
