"""Integrated flights of one system: its table and equation of motion passed to compiled code, and the output as results."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import Floats
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.compiling.compiled import code_of, compilers
from nsmaps.exact.engine.flight import layout as at
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.flows.formulas import S, W, Z
from nsmaps.exact.flows.tables import Formulas
from nsmaps.exact.modes.tables.taylor import ORDER
from nsmaps.exact.ode.held import pressing
from nsmaps.exact.ode.integrator import VALUES, Integrator, integrator_of
from nsmaps.exact.ode.layout import FLOATS, IMPACTS, INTEGERS
from nsmaps.exact.ode.memory import Memory, addresses, room
from nsmaps.exact.ode.returns import advanced, started
from nsmaps.exact.ode.steps.pieces import DOUBTS, Step
from nsmaps.exact.ode.steps.resolution import FIRST, INTERVALS, equation_of
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Impacts, Itineraries, Returns
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.exact.words import CHATTER, REST

MARKS = np.array(["", CHATTER, REST, REST, ""])


@dataclass(frozen=True, slots=True)
class IntegratedKernel:
    """The engine of integrated flights with the table of one system, whose equation of motion is `formulas.acceleration`."""

    system: ImpactFormulas
    formulas: Formulas
    table: Floats  #: see `nsmaps.exact.engine.flight.layout`; without flights
    pressing: tuple[Floats, Floats]  #: phases between which the lower wall and the upper press on a ball at rest, (K, 2) each

    @property
    def name(self) -> str:
        """The class with a digest of its formulas and of the engine: equal names mean equal returns."""
        f = self.formulas
        text = "\0".join([*map(str, (f.acceleration, f.numbers, f.laws, f.sides)), code_of(started, advanced), *compilers()])
        return f"{type(self.system).__qualname__}-{sha256(text.encode()).hexdigest()[:20]}"

    def first_returns(self, start: Floats, derivative: bool, chatter: float) -> Returns:
        """First returns of a batch, shape (N, 2)."""
        return self.orbits(start, 1, derivative, chatter)

    def orbits(self, start: Floats, n: int, derivative: bool, chatter: float) -> Returns:
        """The first n returns of each of M states, shape (M, 2): n M rows, the first return of every state first."""
        w = self._run(start, n, chatter, derivative=derivative)
        starts = np.concatenate([start[None], w.states[:-1]])[: len(w.states)].reshape(-1, 2)
        image, turns, codes, outcome, time = (
            rows.reshape(-1, *rows.shape[2:]) for rows in (w.states, w.turns, w.codes, w.outcome, w.time)
        )
        slopes = w.tangents[..., :2].reshape(-1, 2, 2) if derivative else None
        system = self.system
        return Returns(system.coordinates, system.letters, starts, image, turns, codes, outcome, time, slopes, integrated=True)

    def itineraries(self, start: Floats, chatter: float) -> Itineraries:
        """The itineraries of the first returns of a batch, shape (N, 2)."""
        w = self._run(start, 1, chatter, turning=True)
        clearance, slowest, turns = w.margins.T
        return Itineraries(self.system.letters, w.codes[0], turns.astype(np.int32), clearance, slowest, w.outcome[0])

    def sensitivities(self, start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of the images of a batch, shape (N, 2), by the parameters along a direction."""
        return self._run(start, 1, chatter, rates=rates).tangents[0, :, :, 2] if rates.any() else np.zeros((len(start), 2))

    def impacts(self, state: Floats, n: int, chatter: float) -> Impacts:
        """The first n impacts on all walls from one state, shape (2,)."""
        return self.flights(state, n, chatter)[0]

    def flights(self, state: Floats, n: int, chatter: float) -> tuple[Impacts, list[list[Step]]]:
        """The first n impacts on all walls from one state, shape (2,), and the steps of the flight after each of them."""
        pieces: list[Floats] = []
        w = self._run(state[None], 1, chatter, pieces, hits=n)
        on_base, time, phase, speed, mark = w.hits[: int(w.counts[0, IMPACTS]) + 1].T
        steps: list[list[Step]] = [[] for _ in time]
        for (_, number, begin, length, *_), place, velocity in pieces:
            steps[int(number)].append(Step(begin, length, place, velocity))
        return Impacts(self.system.letters, (1 - on_base).astype(np.int8), time, phase, speed, MARKS[mark.astype(int)]), steps

    def trajectory(self, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""
        top, bottom = float(self.table[at.TOP]), float(self.table[at.BOTTOM])
        _, flights = self.flights(np.array([impacts.speed[0], impacts.phase[0]]), len(impacts.time), SUMMED_SPEED)
        times = np.linspace(impacts.time[:-1], impacts.time[1:], samples, axis=1)
        places, rates = np.zeros((2, *times.shape))
        for i, time in enumerate(times):
            up = bool(self.table[at.BASE_UP]) == (impacts.wall[i] == 0)
            places[i] = top if up else bottom
            if not impacts.mark[i + 1]:  # otherwise it chatters or rests here, and there is no flight
                since, steps = time - time[0], flights[i]
                which = np.searchsorted([step.begin for step in steps[1:]], since, "right")
                for k, step in enumerate(steps):
                    flown = step.at(since[which == k])
                    places[i, which == k] += flown[0]
                    rates[i, which == k] = flown[1]
        return times, places, rates

    def reasons(self, start: Floats, chatter: float) -> tuple[str, ...]:
        """Why each first return of a batch, shape (N, 2), ended."""
        w = self._run(start, 1, chatter)
        return tuple(DOUBTS[doubt] or Outcome(end).advice for doubt, end in zip(w.doubts[0], w.outcome[0], strict=True))

    def _run(
        self,
        start: Floats,
        n: int,
        chatter: float,
        pieces: list[Floats] | None = None,
        rates: Floats | None = None,
        **what: Any,
    ) -> Memory:
        """The memory of the engine when the first n returns of all states have been made; `pieces` gets the steps of impacts."""
        values = list(self.system.parameters.values())
        integrator = integrator_of(self.formulas.acceleration, self.formulas.symbols, rates is not None)
        with integrator.lock:
            w = self._memory(integrator, start, n, chatter, rates, **what)
            w.pars[VALUES:] = np.array([*values, *(values if rates is None else rates), 0.0])[:, None]
            busy, found = started(w), addresses(w)
            while busy:
                integrator.expand(w.pars)
                busy = advanced(found, w.chatter, w.turning, w.equation)
                if pieces is not None and w.piece[0, 0]:
                    pieces.append(w.piece.copy())
                    w.piece[0, 0] = 0.0
        return w

    def _memory(
        self,
        integrator: Integrator,
        start: Floats,
        n: int,
        chatter: float,
        rates: Floats | None,
        derivative: bool = False,
        turning: bool = False,
        hits: int = 0,
    ) -> Memory:
        """The arrays of the engine for n returns of states (M, 2)."""
        assert self.formulas.acceleration is not None, "of a system that is given by it"
        equation, kinds = equation_of(self.formulas.acceleration, self.formulas.symbols)
        m, lanes, program = len(start), len(integrator.nowhere), integrator.program
        pars = np.zeros((VALUES + 2 * len(self.formulas.symbols) + 1, lanes))
        integrator.expand(pars)  # the first coefficients
        return Memory(
            p=Flow(self.table, np.zeros(1)),
            moved=Flow(self._moved(rates), np.zeros(1)),
            tc=program.tc,
            state=program.state,
            pars=pars,
            lanes=np.zeros((lanes, FLOATS)),
            counts=np.zeros((lanes, INTEGERS), np.int64),
            pressing=self.pressing,
            series=np.zeros((3, ORDER + 1)),
            ends=np.zeros(len(program.state)),
            chatter=float(chatter),
            turning=turning,
            next=np.zeros(1, np.int64),
            start=start,
            **room(n, m, derivative or rates is not None),
            margins=np.empty((m if turning else 0, 3)),
            hits=np.zeros((hits, 5)),
            inside=np.zeros((INTERVALS + 1, FIRST + 2 * len(kinds))),
            kinds=np.array(kinds, np.int64),
            piece=np.zeros((3, program.tc.shape[1])),
            equation=equation,
        )

    def _moved(self, rates: Floats | None) -> Floats:
        """The derivatives of the table along a direction of the parameters."""
        if rates is None:
            return np.zeros_like(self.table)
        values = [*self.system.parameters.values(), *rates.tolist()]
        return self.formulas.along(self.system.parameter_names()).table(values)


def integrated_kernel(system: ImpactFormulas, formulas: Formulas, table: Floats) -> IntegratedKernel:
    """The kernel of a system that is given by its acceleration, with the phases at which its walls press on a ball at rest."""
    force = _force(formulas)
    values, rate = tuple(system.parameters.values()), float(table[at.PHASE_RATE])

    def pressed(place: float, into: float) -> Floats:
        return pressing(lambda phi: np.broadcast_to(into * force(phi / rate, place, *values), phi.shape).astype(float))

    return IntegratedKernel(system, formulas, table, (pressed(float(table[at.BOTTOM]), -1.0), pressed(float(table[at.TOP]), 1.0)))


@lru_cache(maxsize=64)
def _force(formulas: Formulas) -> Callable[..., Any]:
    """The acceleration of a ball at rest, by the time, its place and the parameters."""
    assert formulas.acceleration is not None, "of a system that is given by it"
    return sp.lambdify((S, Z, *formulas.symbols), formulas.acceleration.subs(W, 0))
