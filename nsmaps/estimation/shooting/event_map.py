"""The motion of a system from event to event as a map of full states, with derivatives by starts, times and parameters.

Of a class of systems another one is derived, whose section is at every event that has a letter, and which has a timer as a
further state: an event takes place when it has run down. First returns of the derived system lead to events or to instants.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Bools, Floats, Ints
from nsmaps.coordinates import wrap
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.guards import Guard, PoincareSection, SlidingSurface
from nsmaps.exact.systems.walls import ImpactFormulas

if TYPE_CHECKING:
    from nsmaps.exact.modes.definitions.definition import Definition

TIMER, ALARM, INSTANT = "timer_", "alarm_", "!"  #: the further state, its event, and the letter of this
RUN_DOWN = 1e9  #: units of time: a timer that does not run down
PHASE = "phase_"  #: the name of the phase where the section has none


@lru_cache(maxsize=64)
def timed_class(cls: type[FlowSystem]) -> type[FlowSystem]:
    """The class derived from one of systems, whose section is just before every event with a letter."""

    def modes(self: Any, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {mode: {**rates, TIMER: -1} for mode, rates in cls.modes(self, t, y).items()}

    def guards(self: Any, t: Any, y: SimpleNamespace) -> Mapping[str, Any]:
        alarm = Guard(watched_modes(cls, self, t, y), getattr(y, TIMER), letter=INSTANT, crossing=True)
        return {**cls.guards(self, t, y), ALARM: alarm}

    def section(self: Any, t: Any, y: SimpleNamespace) -> PoincareSection:
        own = cls.section(self, t, y)
        events = [name for name, one in cls.guards(self, t, y).items() if _is_seen(name, one)]
        phases = [name for name in own.coordinates if name not in cls.states] or [PHASE] * (self.period() is not None)
        return PoincareSection((*events, ALARM), (*cls.states, TIMER, *phases))

    body = {"modes": modes, "guards": guards, "section": section, "states": (*cls.states, TIMER), "__module__": __name__}
    return type(f"Timed{cls.__name__}", (cls,), {**body, "__qualname__": f"Timed{cls.__name__}"})


def watched_modes(cls: type[FlowSystem], system: Any, t: Any, y: SimpleNamespace) -> tuple[str, ...]:
    """All modes of a class, those of sliding and lasting contact included."""
    derived = [name if isinstance(one, SlidingSurface) else one.rests for name, one in cls.guards(system, t, y).items()]
    return (*cls.modes(system, t, y), *(mode for mode in derived if mode))


@lru_cache(maxsize=64)
def before_class(cls: type[FlowSystem]) -> type[FlowSystem]:
    """The class of the same systems, whose section is just before its events."""

    def section(self: Any, t: Any, y: SimpleNamespace) -> PoincareSection:
        return replace(cls.section(self, t, y), side="before")

    return type(cls.__name__, (cls,), {"section": section, "__module__": __name__, "__qualname__": cls.__name__})


def before_system(system: FlowSystem) -> FlowSystem:
    """The same system, whose section is just before its events."""
    return _of_class(before_class(type(system)), system)


def _is_seen(name: str, guard: Any) -> bool:
    """Whether an event has a letter and does not end the motion."""
    return isinstance(guard, Guard) and bool(name[:1] if guard.letter is None else guard.letter) and not guard.ends


def _of_class(cls: type[FlowSystem], system: FlowSystem) -> FlowSystem:
    return cls.model_construct(**{name: getattr(system, name) for name in cls.model_fields})


@dataclass(frozen=True)
class Formulas:
    """The compiled formulas of a class: the states at a start, the speed at an event, and their derivatives."""

    starts: tuple[Any, ...]  #: of each kind of start: functions of (coordinates, phase, parameters)
    speeds: Mapping[str, Any]  #: by letter: functions of (states, phase, parameters)
    rate: Any  #: the rate of the phase, of the parameters, with its derivatives


@lru_cache(maxsize=64)
def formulas_of(definition: "Definition", timed: "Definition") -> Formulas:
    """The formulas of a class from its definition, whose coordinates give the starts, and from that of the timed class."""
    import sympy as sp

    from nsmaps.exact.flows.formulas import PHI

    symbols = definition.symbols

    def compiled(formulas: Sequence[Any], variables: Sequence[Any]) -> Any:
        """A function with the values of formulas and their derivatives by all arguments, shape (F, 1 + arguments)."""
        known = [*variables, PHI, *symbols]
        rows = [[formula, *(sp.diff(formula, x) for x in known)] for formula in map(sp.sympify, formulas)]
        return sp.lambdify(known, rows, "numpy", cse=True)

    starts = []
    for start in definition.starts:
        rows = [dict(start.curved).get(k, row.of(definition.columns)) for k, row in enumerate(start.states)]
        rows = rows[: len(definition.variables)]  # others are derived from these
        if rows not in starts:
            starts.append(rows)
    speeds: dict[str, Any] = {}
    for one in timed.transitions:
        if one.letter and not one.releases and timed.moves(one.function):
            rates = timed.smooth[one.mode] if timed.smooth else [row.of(timed.columns) for row in timed.rates[one.mode]]
            function = one.function.of(timed.columns)
            own = zip(timed.variables, rates, strict=False)  # the first ones, of the system itself
            slope = sum(sp.diff(function, y) * rate for y, rate in own)
            speeds.setdefault(one.letter, -slope - timed.phase_rate * sp.diff(function, PHI))
    rate = sp.lambdify(symbols, [definition.phase_rate, *(sp.diff(definition.phase_rate, p) for p in symbols)], "numpy")
    kinds = tuple(compiled(rows, definition.variables) for rows in starts)
    return Formulas(kinds, {letter: compiled([speed], timed.variables) for letter, speed in speeds.items()}, rate)


@dataclass(frozen=True)
class Events:
    """The events of S motions, E of each, the start first; D directions are those of `EventMap.events`."""

    letter: Ints  #: shape (S, E), index into the letters; -1 after the end, and of a release
    time: Floats  #: shape (S, E), in the system's time
    time_by: Floats  #: shape (S, E, D)
    states: Floats  #: shape (S, E, m), states, timer and phase just before each event
    states_by: Floats  #: shape (S, E, m, D)


class EventModel:
    """A system as its events, as a function of free parameters.

    A start has the coordinates of the section just before its event, without the phase, and the time of the event.
    """

    def __init__(self, system: FlowSystem, free: Sequence[str]) -> None:
        """The model of a system."""
        from nsmaps.exact.modes.kernel import known_definition

        self.system, self.free = system, tuple(free)
        self.definition = known_definition(before_system(system))
        self.timed = known_definition(_of_class(timed_class(type(system)), system))
        self.names = tuple(name for name in self.definition.coordinates if name in self.definition.states)
        self.forced = bool(self.timed.coordinates.angles.any())
        self.letters = tuple(letter for letter in self.timed.letters if letter != INSTANT)
        self.section = self.definition.alphabet.section or ()
        self.is_impact = isinstance(system, ImpactFormulas)
        self._last: tuple[dict[str, float], EventMap] | None = None

    @cached_property
    def formulas(self) -> Formulas:
        """The compiled formulas of the class."""
        return formulas_of(self.definition, self.timed)

    def at(self, values: Sequence[float] | Floats) -> "EventMap":
        """The map at values of the free parameters. ParameterError for values that the system does not accept."""
        given = dict(zip(self.free, map(float, values), strict=True))
        if self._last is None or self._last[0] != given:
            self._last = given, EventMap(self, self.system.at(**given))
        return self._last[1]


class EventMap:
    """The map from event to event at given parameters."""

    def __init__(self, model: EventModel, system: FlowSystem) -> None:
        """The map of a model at the parameters of a system."""
        from nsmaps.exact.modes.kernel import ModeKernel

        self.model, self.system = model, system
        self.kernel = ModeKernel.of(_of_class(timed_class(type(system)), system))
        self.values = list(system.parameters.values())
        self.places = np.array([system.parameter_names().index(name) for name in model.free], int)
        self.rate, *by = map(float, model.formulas.rate(*self.values))
        self.rate_by = np.array(by)[self.places]

    def events(self, starts: Floats, offsets: Floats, n: int, derivative: bool = True) -> Events:
        """The first n events of motions from starts, shape (S, c + 1), with the phases `offsets`, shape (S,), at time zero.

        Directions are the c coordinates, the time of the start, the free parameters and the offset; none without `derivative`.
        """
        state, by = self._full(starts, offsets)
        found = self.kernel.orbits(state, n - 1, derivative, SUMMED_SPEED)
        count, m = state.shape
        images, times = found.image.reshape(n - 1, count, m), found.time.reshape(n - 1, count)
        tangents, first = [by], by.shape[-1] - 1 - len(self.model.free)
        if derivative:
            moved = self._moved(found.start).reshape(n - 1, count, m, -1)
            for slope, move in zip(found.slopes.reshape(n - 1, count, m, m), moved, strict=True):
                after = slope @ tangents[-1]
                after[..., first:-1] += move
                tangents.append(after)
        states, states_by = np.concatenate([state[None], images]).swapaxes(0, 1), np.stack(tangents, axis=1)
        states_by = states_by if derivative else np.zeros((count, n, m, by.shape[-1]))
        time = starts[:, -1:] + np.concatenate([np.zeros((1, count)), times.cumsum(axis=0)]).T
        time_by = -states_by[:, :, self.timer]
        time_by[:, :, starts.shape[1] - 1] += 1.0
        known = np.isfinite(states).all(axis=-1)
        return Events(self._letters(found.words, count, known), np.where(known, time, np.nan), time_by, states, states_by)

    def times(self, starts: Floats, offsets: Floats, n: int) -> tuple[Ints, Floats]:
        """Letters and times of the first n events of motions, each of shape (S, n), without derivatives."""
        state = self._full(starts, offsets)[0]
        found = self.kernel.orbits(state, n - 1, False, SUMMED_SPEED)
        times = starts[:, -1:] + np.concatenate([np.zeros((1, len(state))), found.time.reshape(n - 1, -1).cumsum(axis=0)]).T
        known = np.isfinite(times)
        return self._letters(found.words, len(state), known), times

    @property
    def timer(self) -> int:
        """The place of the timer among full states."""
        return len(self.model.definition.states)

    def instants(self, events: Events, rows: tuple[Ints, Ints], times: Floats) -> tuple[Floats, Floats]:
        """The states at times (K,) after given events: shape (K, states), and by the directions; NaN after another event."""
        start, by = events.states[rows].copy(), events.states_by[rows].copy()
        start[:, self.timer], by[:, self.timer] = times - events.time[rows], -events.time_by[rows]
        found = self.kernel.first_returns(start, True, SUMMED_SPEED)
        after = found.slopes @ by
        first = by.shape[-1] - 1 - len(self.model.free)
        after[..., first:-1] += self._moved(found.start)
        late = np.array([not word.endswith(INSTANT) for word in found.words], bool)
        found.image[late] = np.nan
        return found.image[:, : self.timer], after[:, : self.timer]

    def speeds(self, letter: Ints, states: Floats, by: Floats) -> tuple[Floats, Floats]:
        """The speeds of events (K,) towards their surfaces, with derivatives (K, D), at full states and their derivatives."""
        speed, speed_by = np.full(len(letter), np.nan), np.zeros((len(letter), by.shape[-1]))
        first = by.shape[-1] - 1 - len(self.model.free)
        for k, name in enumerate(self.model.letters):
            mine = letter == k
            if mine.any() and name in self.model.formulas.speeds:
                (values,) = self._evaluate(self.model.formulas.speeds[name], states[mine], self.timer + 1)
                speed[mine] = values[:, 0]
                speed_by[mine] = np.einsum("ki,kid->kd", values[:, 1 : 1 + states.shape[1]], by[mine])
                speed_by[mine, first:-1] += values[:, 1 + self.timer + 2 :][:, self.places]
        return speed, speed_by

    def _full(self, starts: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Full states of starts, shape (S, m), and their derivatives by the directions, shape (S, m, D)."""
        model, n = self.model, self.timer
        count, width = starts.shape
        phase = wrap(self.rate * starts[:, -1] + offsets)
        known = np.zeros((count, n + 1))
        places = [model.definition.states.index(name) for name in model.names]
        known[:, places], known[:, n] = starts[:, :-1], phase
        states, tables = self._started(known)
        m, free = n + 1 + model.forced, len(model.free)
        full, by = np.zeros((count, m)), np.zeros((count, m, width + free + 1))
        full[:, :n], full[:, n] = states, RUN_DOWN
        phase_by = np.zeros((count, width + free + 1))
        phase_by[:, width - 1], phase_by[:, -1] = self.rate, 1.0
        phase_by[:, width:-1] = starts[:, -1:] * self.rate_by
        by[:, :n, : width - 1] = tables[:, :, [1 + k for k in places]]
        by[:, :n] += tables[:, :, 1 + n, None] * phase_by[:, None, :]
        by[:, :n, width:-1] += tables[:, :, 2 + n :][:, :, self.places]
        if model.forced:
            full[:, -1], by[:, -1] = phase, phase_by
        return full, by

    def _started(self, known: Floats) -> tuple[Floats, Floats]:
        """The states (S, n) of coordinates and phases, with their table of derivatives (S, n, arguments)."""
        tables = [np.moveaxis(self._evaluate(kind, known, self.timer), 0, 1) for kind in self.model.formulas.starts]
        chosen, *others = tables
        if others:
            chosen, there = chosen.copy(), self._is_start(chosen[:, :, 0], known[:, -1])
            for table in others:
                here = ~there & self._is_start(table[:, :, 0], known[:, -1])
                chosen[here], there = table[here], there | here
        return chosen[:, :, 0], chosen

    def _is_start(self, states: Floats, phase: Floats) -> Bools:
        columns = [states, np.full((len(states), 1), RUN_DOWN)] + [phase[:, None]] * self.model.forced
        return np.asarray(self.kernel.first_returns(np.hstack(columns), False, SUMMED_SPEED).valid)

    def _evaluate(self, function: Any, states: Floats, variables: int) -> Floats:
        """The rows of compiled formulas at states with their phase, shape (F, K, 1 + arguments)."""
        phase = states[:, variables] if states.shape[1] > variables else np.zeros(len(states))
        rows = function(*states[:, :variables].T, phase, *self.values)
        return np.array([[np.broadcast_to(x, len(states)) for x in row] for row in rows], float).swapaxes(1, 2)

    def _moved(self, start: Floats) -> Floats:
        """The derivatives of first returns by the free parameters, shape (N, m, P)."""
        rates = np.eye(len(self.values))[self.places]
        moved = [self.kernel.sensitivities(np.ascontiguousarray(start), rate, SUMMED_SPEED) for rate in rates]
        return np.stack(moved, axis=-1) if moved else np.zeros((*start.shape, 0))

    def _letters(self, words: Any, count: int, known: Bools) -> Ints:
        """The numbers of letters of the starts and of the events after them, shape (S, E)."""
        numbers = {letter: k for k, letter in enumerate(self.model.letters)}
        different, which = np.unique(words, return_inverse=True)
        ends = np.array([[numbers.get(word[:1], -1), numbers.get(word[-1:], -1)] for word in different], int)[which]
        first, last = ends[:count, 0], ends[:, 1].reshape(-1, count).T
        return np.where(known, np.hstack([first[:, None], last]), -1)
