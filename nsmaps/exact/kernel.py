"""The engine applied to one system: its tables passed to compiled code, and the output as results."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.compiling.compiled import code_of, compilers
from nsmaps.exact.engine.blocks.batch import orbits
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.engine.itinerary import ItineraryRows, all_itineraries
from nsmaps.exact.engine.observers import Rows, Track, sampled, sensitivities, trajectory
from nsmaps.exact.engine.returns import Impact
from nsmaps.exact.flows.tables import Formulas, formulas_of, table_of, written
from nsmaps.exact.noise import orbit as noisy
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Impacts, Itineraries, Returns
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.exact.words import CHATTER, REST
from nsmaps.interrupts import check_stop, threads

STEPS = 2000  # of a realisation under noise, whose random numbers are drawn together
CHUNK = 10_000  # returns that a thread takes at a time: enough to hide its cost, few enough for Ctrl-C


@dataclass(frozen=True, slots=True)
class Kernel:
    """The compiled engine with the tables of one system."""

    system: ImpactFormulas
    formulas: Formulas
    table: Floats  #: see `nsmaps.exact.engine.flight.layout`

    @property
    def name(self) -> str:
        """The class with a digest of its formulas and of the engine: equal names mean equal returns."""
        f = self.formulas
        text = "\0".join([*map(str, (f.displacement, f.numbers, f.laws, f.sides)), code_of(orbits), *compilers()])
        return f"{type(self.system).__qualname__}-{sha256(text.encode()).hexdigest()[:20]}"

    @property
    def base_up(self) -> bool:
        """True if the base wall is the upper one."""
        return bool(self.table[layout.BASE_UP])

    @property
    def places(self) -> tuple[float, float]:
        """The places of the lower and of the upper wall, which are equal where there is one wall."""
        return float(self.table[layout.BOTTOM]), float(self.table[layout.TOP])

    @property
    def flow(self) -> Flow:
        """The table, with its own room for the coefficients of a flight."""
        return flow_of(self.table)

    def first_returns(self, start: Floats, derivative: bool, chatter: float) -> Returns:
        """First returns of a batch, shape (N, 2), on all cores."""
        rows = _room(1, len(start), derivative)

        def run(k: slice) -> None:
            orbits(self.flow, float(chatter), start[k], Rows(*(row[:, k] for row in rows)))

        if 0 < len(start) <= CHUNK:
            orbits(self.flow, float(chatter), start, rows)
        else:
            in_chunks(len(start), run)
        return self._returns(start, rows)

    def orbits(self, start: Floats, n: int, derivative: bool, chatter: float) -> Returns:
        """The first n returns of each of M states, shape (M, 2): n M rows, the first return of every state first."""
        rows = _room(n, len(start), derivative)
        before, outcome, size = start, rows.outcome, max(1, CHUNK // max(len(start), 1))
        for begin in range(0, n, size):  # in chunks, between which Ctrl-C is heard
            k = slice(begin, begin + size)
            orbits(self.flow, float(chatter), before, Rows(*(row[k] for row in rows)))
            if begin:  # the outcome of an orbit that ended is repeated
                ended = np.isnan(before[:, 0])
                outcome[k, ended] = outcome[begin - 1, ended]
            before = rows.states[k][-1]
        return self._returns(np.concatenate([start, rows.states[:-1].reshape(-1, 2)]), rows)

    def _returns(self, start: Floats, rows: Rows) -> Returns:
        """The rows of `_room` one after another."""
        image, turns, codes, outcome, time, tangents = (row.reshape(-1, *row.shape[2:]) for row in rows)
        slopes = tangents if len(rows.tangents) else None
        return Returns(self.system.coordinates, self.system.letters, start, image, turns, codes, outcome, time, slopes)

    def noisy_orbit(self, law: Any, step: Floats, parts: int, chatter: float, rng: np.random.Generator, tables: Any) -> None:
        """One realisation under noise, written into its tables: see `nsmaps.dynamics.noise.orbits`."""
        first = noisy.Step(self.flow, noisy.Law(*map(float, law)), (0.0, 0.0, 0.0, 0.0), float(chatter))
        ball, count, out = np.zeros(noisy.NUMBERS), np.zeros(noisy.COUNTS, np.int64), noisy.Realisation(*tables)
        noisy.ready(first.p, ball, count, first.law.sigma * rng.standard_normal(), out)
        while count[noisy.FATE] == noisy.UNDER_WAY and count[noisy.MADE] < len(out.codes):
            noisy.noisy_orbit(first, step, rng.standard_normal((STEPS, parts, 3)), ball, count, out)
            check_stop()
        noisy.finish(count, out)

    @property
    def law(self) -> tuple[float, float]:
        """The coefficients k and c of flights, z'' = -k z - c z' + f(t): how the acceleration at the start depends on place and
        velocity.
        """
        begin = int(self.table[layout.AT_START])
        return 0.0 - float(self.table[begin + 1]), 0.0 - float(self.table[begin + 2])

    def itineraries(self, start: Floats, chatter: float) -> Itineraries:
        """The itineraries of the first returns of a batch, shape (N, 2)."""
        n = len(start)
        rows = ItineraryRows(np.empty(n, np.int8), np.empty(n, np.int64), np.empty(n, np.int32), np.empty(n), np.empty(n))
        in_chunks(n, lambda k: all_itineraries(self.flow, start[k], chatter, ItineraryRows(*(row[k] for row in rows))))
        return Itineraries(self.system.letters, rows.code, rows.turning_points, rows.gap, rows.slowest, rows.outcome)

    def sensitivities(self, start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of the images of a batch, shape (N, 2), by the parameters along a direction."""
        moves = np.zeros((len(start), 2))
        if rates.any():
            values = [*self.system.parameters.values(), *rates.tolist()]
            moved = self.formulas.along(self.system.parameter_names()).table(values)
            in_chunks(len(start), lambda k: sensitivities(self.flow, flow_of(moved), start[k], float(chatter), moves[k]))
        return moves

    def reasons(self, start: Floats, chatter: float) -> tuple[str, ...]:
        """Why each first return of a batch, shape (N, 2), ended."""
        return tuple(Outcome(end).advice for end in self.first_returns(start, False, chatter).outcome)

    def impacts(self, state: Floats, n: int, chatter: float) -> Impacts:
        """The first n impacts on all walls from one state, shape (2,)."""
        track = Track(np.empty(n, np.int8), np.empty(n), np.empty(n), np.empty(n), np.zeros(n, np.int8))
        start = Impact(self.base_up, float(state[1]) % (2 * np.pi), float(state[0]))
        m = trajectory(self.flow, start, float(chatter), track)
        marks = np.array(["", CHATTER, REST, REST, ""])[track.mark[:m]]
        return Impacts(self.system.letters, 1 - track.on_base[:m], track.time[:m], track.phase[:m], track.speed[:m], marks)

    def trajectory(self, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""
        p, (bottom, top) = self.flow, self.places
        times = np.linspace(impacts.time[:-1], impacts.time[1:], samples, axis=1)
        places, rates = np.zeros((2, *times.shape))
        for i, time in enumerate(times):
            up = self.base_up == (impacts.wall[i] == 0)
            places[i] = top if up else bottom
            if not impacts.mark[i + 1]:  # otherwise it chatters or rests here, and there is no flight
                d = np.empty(samples)
                sampled(p, Impact(up, impacts.phase[i], impacts.speed[i]), time - time[0], d, rates[i])
                places[i] += d
        return times, places, rates


def _room(n: int, m: int, derivative: bool) -> Rows:
    """Arrays for n returns of each of m states, with derivatives or none."""
    codes, outcome, time = np.empty((n, m), np.int64), np.empty((n, m), np.int8), np.empty((n, m))
    tangents = np.empty((n if derivative else 0, m, 2, 2))
    return Rows(np.empty((n, m, 2)), np.empty((n, m, 2), np.int32), codes, outcome, time, tangents)


def in_chunks(n: int, run: Callable[[slice], None], size: int = CHUNK) -> None:
    """Run a task over n states on all cores, in chunks of at most `size`, if that is less than all.

    Every core, this thread on one of them, takes the next chunk when it has finished one; the last chunks are small, so that no
    core waits long for another.
    """
    if n <= size:
        if n:
            run(slice(0, n))
        return
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    chunks = list(chunks_of(n, size, cores))
    waiting = iter(chunks)

    def work() -> None:
        try:
            for k in waiting:
                run(k)
        except BaseException:
            chunks.clear()  # after an error or an interrupt, the threads stop after their chunk
            raise

    with threads(max(cores - 1, 1)) as pool:
        workers = [pool.submit(work) for _ in range(cores - 1)]
        work()
    for worker in workers:
        worker.result()


def chunks_of(n: int, size: int, cores: int) -> Iterator[slice]:
    """Slices of n states: of at most `size` each, at least an eighth of that, and otherwise a share of the remaining states."""
    begin = 0
    while begin < n:
        end = begin + min(size, max(size // 8, (n - begin) // (2 * cores), 1), n - begin)
        yield slice(begin, end)
        begin = end


def kernel_of(system: ImpactFormulas) -> Kernel:
    """The kernel of a system; the kernels used last are cached."""
    return _kernel(written(type(system)), repr(vars(system)), _Quiet(system))


def closed_form_of(system: ImpactFormulas, what: str, refusal: type[NsmapsError] = NsmapsError) -> Kernel:
    """The kernel of a system whose flights are in closed form.

    Raises:
        NsmapsError: of the class `refusal`: the system is given by its acceleration, or motions end at a wall, where `what`, in
            the plural, needs a closed form.
    """
    if obstacle := system.obstacle():
        raise refusal(
            f"{what} need flights in closed form, and {type(system).__name__} {obstacle}; expected: a system with a displacement"
            + ", and no such wall" * (system.flight() == "displacement")
        )
    return kernel_of(system)


class _Quiet:
    """An argument that `lru_cache` ignores: all objects of this class are equal."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Quiet)

    def __hash__(self) -> int:
        return 0


@lru_cache(maxsize=256)
def _kernel(cls: tuple[Any, ...], values: str, system: _Quiet) -> Kernel:
    return Kernel(system.value, formulas_of(system.value), table_of(system.value))


def flow_of(table: Floats) -> Flow:
    """A table with room for the coefficients of a flight."""
    return Flow(table, np.zeros(int(table[layout.FLIGHT_SIZE])))
