"""The engine of flights in closed form applied to one system: its tables passed to compiled code."""

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import NsmapsError
from nsmaps.exact.compiling.compiled import compilers
from nsmaps.exact.compiling.digest import code_of
from nsmaps.exact.engine.blocks.batch import orbits
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.flight.flow import Flow
from nsmaps.exact.engine.itinerary import ItineraryRows, all_itineraries
from nsmaps.exact.engine.observers import Rows, Track, sample_flight, sensitivities, trajectory
from nsmaps.exact.engine.returns import PHASE, SPEED, Impact
from nsmaps.exact.flows.tables import Formulas, along, formulas_of, table_of
from nsmaps.exact.kernel import CHUNK, STEPS, MotionKernel, ReturnRows, in_chunks
from nsmaps.exact.noise import orbit as noisy
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Impacts, Itineraries
from nsmaps.exact.systems.walls import ImpactFormulas
from nsmaps.exact.words import CHATTER, REST
from nsmaps.interrupts import check_stop

if TYPE_CHECKING:
    from nsmaps.exact.modes.kernel import ModeKernel

BY_PLACE, BY_VELOCITY = 1, 2  #: of the derivatives of the acceleration at the start of a flight, behind its table's AT_START


@dataclass(frozen=True, eq=False)
class SpectralKernel(MotionKernel):
    """The compiled engine with the tables of one system."""

    system: ImpactFormulas
    formulas: Formulas
    table: Floats  #: see `nsmaps.exact.engine.flight.layout`

    def __post_init__(self) -> None:
        object.__setattr__(self, "coordinates", self.system.coordinates)
        object.__setattr__(self, "letters", self.system.letters)

    @classmethod
    def of(cls, system: ImpactFormulas) -> "SpectralKernel":
        """The kernel of a system whose flights are in closed form."""
        return cls(system, formulas_of(system), table_of(system))

    @property
    def name(self) -> str:
        """The class with a digest of its formulas and of the engine: equal names mean equal returns."""
        f = self.formulas
        text = "\0".join([*map(str, (f.displacement, f.numbers, f.laws, f.sides)), code_of(orbits), *compilers()])
        return f"{type(self.system).__qualname__}-{sha256(text.encode()).hexdigest()[:20]}"

    @cached_property
    def modes(self) -> "ModeKernel":
        """The kernel of the definition with modes, in which motions start anywhere."""
        from nsmaps.exact.modes.kernel import ModeKernel

        return ModeKernel.of(self.system)

    def closed_form(self, what: str, refusal: type[NsmapsError] = NsmapsError) -> "SpectralKernel":
        """This kernel."""
        return self

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
        """The table, with its own memory for the coefficients of a flight."""
        return flow_of(self.table)

    @property
    def law(self) -> tuple[float, float]:
        """The coefficients k and c of flights, z'' = -k z - c z' + f(t): the acceleration by place and velocity."""
        start = int(self.table[layout.AT_START])
        return 0.0 - float(self.table[start + BY_PLACE]), 0.0 - float(self.table[start + BY_VELOCITY])

    def compute(self, rows: ReturnRows, chatter: float) -> None:
        """Compute returns from the starts in `rows`, in chunks, between which Ctrl-C is heard."""
        states, turns, codes, outcome, time, tangents = rows
        n, count = outcome.shape
        derivatives = tangents[: n if tangents.shape[3] else 0]
        size = max(1, CHUNK // max(count, 1))
        for begin in range(0, n, size):
            k = slice(begin, begin + size)
            before, earlier = states[begin], outcome[begin - (begin > 0)]
            written = Rows(rows.images[k], turns[k], codes[k], outcome[k], time[k], derivatives[k])
            orbits(self.flow, chatter, before, written)
            if begin:  # the outcome of an orbit that ended is repeated
                ended = np.isnan(before).any(axis=1)
                outcome[k, ended] = earlier[ended]

    def noisy_orbit(self, law: Any, step: Floats, parts: int, chatter: float, rng: np.random.Generator, tables: Any) -> None:
        """One realisation under noise, written into its tables: see `nsmaps.dynamics.noise.orbits`."""
        first = noisy.Step(self.flow, noisy.Law(*map(float, law)), (0.0, 0.0, 0.0, 0.0), float(chatter))
        ball, count, out = np.zeros(noisy.NUMBERS), np.zeros(noisy.COUNTS, np.int64), noisy.Realisation(*tables)
        noisy.prepare(first.p, ball, count, first.law.sigma * rng.standard_normal(), out)
        while count[noisy.FATE] == noisy.UNDER_WAY and count[noisy.MADE] < len(out.codes):
            noisy.noisy_orbit(first, step, rng.standard_normal((STEPS, parts, 3)), ball, count, out)
            check_stop()
        out.outcome[count[noisy.MADE] :] = count[noisy.FATE]

    def itineraries(self, start: Floats, chatter: float, speeds: Floats | None = None) -> Itineraries:
        """The itineraries of first returns; margins are in the units of places and speeds."""
        n = len(start)
        rows = ItineraryRows(np.empty(n, np.int8), np.empty(n, np.int64), np.empty(n, np.int32), np.empty(n), np.empty(n))
        in_chunks(n, lambda k: all_itineraries(self.flow, start[k], chatter, ItineraryRows(*(row[k] for row in rows))))
        return Itineraries(self.letters, rows.code, rows.turning_points, rows.gap, rows.slowest, rows.outcome)

    def sensitivities(self, start: Floats, rates: Floats, chatter: float) -> Floats:
        """The derivatives of first images by the parameters, which change at the rates (P,), shape (N, 2)."""
        moves = np.zeros((len(start), 2))
        if rates.any():
            values = [*self.system.parameters.values(), *rates.tolist()]
            moved = along(self.formulas, self.system.parameter_names()).table(values)
            in_chunks(len(start), lambda k: sensitivities(self.flow, flow_of(moved), start[k], chatter, moves[k]))
        return moves

    def reasons(self, start: Floats, chatter: float) -> tuple[str, ...]:
        """Why each first return ended: of those without an image which wall, when and where."""
        found = self.first_returns(start, False, chatter)
        sentences = iter(self.modes.reasons(start[~found.decided], chatter))
        pairs = zip(found.outcome, found.decided, strict=True)
        return tuple(Outcome(outcome).advice if decided else next(sentences) for outcome, decided in pairs)

    def impacts(self, start: Floats, n: int, chatter: float) -> Impacts:
        """The first n impacts on all walls from one state, shape (2,)."""
        track = Track(np.empty(n, np.int8), np.empty(n), np.empty(n), np.empty(n), np.zeros(n, np.int8))
        impact = Impact(self.base_up, float(start[PHASE]) % TWO_PI, float(start[SPEED]))
        m = trajectory(self.flow, impact, chatter, track)
        marks = np.array(["", CHATTER, REST, REST, ""])[track.mark[:m]]
        return Impacts(self.letters, 1 - track.on_base[:m], track.time[:m], track.phase[:m], track.speed[:m], marks)

    def trajectory(self, impacts: Impacts, samples: int) -> tuple[Floats, Floats, Floats]:
        """Times, displacements and velocities along the M - 1 flights between impacts, each of shape (M - 1, samples)."""
        p, (bottom, top) = self.flow, self.places
        times = np.linspace(impacts.time[:-1], impacts.time[1:], samples).T
        places, rates = np.zeros((2, *times.shape))
        flights = impacts.mark[1:] == ""  # otherwise it chatters or rests there
        for i, (time, place) in enumerate(zip(times, places, strict=True)):
            up = self.base_up == (impacts.wall[i] == 0)
            place[:] = top if up else bottom
            if flights[i]:
                d = np.empty(samples)
                sample_flight(p, Impact(bool(up), impacts.phase[i], impacts.speed[i]), time - impacts.time[i], d, rates[i])
                place += d
        return times, places, rates


def flow_of(table: Floats) -> Flow:
    """A table with memory for the coefficients of a flight."""
    return Flow(table, np.zeros(int(table[layout.FLIGHT_SIZE])))
