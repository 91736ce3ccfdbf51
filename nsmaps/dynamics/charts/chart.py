"""The attractors of a system over the plane of two of its parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, StateLike, WithCoordinates, as_starts
from nsmaps.dynamics.attractors.quantifiers import Function, Quantifier, check_shapes, quantifier_array, quantifiers_of
from nsmaps.dynamics.charts.arguments import check_length, check_plane, check_refine, observables_of, values_of
from nsmaps.dynamics.charts.motions import Motion, Motions
from nsmaps.dynamics.charts.pixels import QUANTIFIER, WAYS, Way, motions_of, pixels
from nsmaps.dynamics.charts.quadtree import Refinement, refined
from nsmaps.dynamics.charts.tails import Length
from nsmaps.dynamics.motion import ESCAPE
from nsmaps.errors import NsmapsError
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.outcome import OUTCOMES, Outcome
from nsmaps.exact.surfaces.along import Along
from nsmaps.exact.surfaces.surface import Axis
from nsmaps.exact.systems.parameters import System
from nsmaps.parallel import SERIAL, Arrays, Jobs, divides
from nsmaps.results import NONE, RETURNS, Result, array, array_property, units_of

PART = 2_000_000  #: returns of a part by default: about a second
MISSING = {"motion": -1, "attractor": -1, "outcome": Outcome.invalid, "refused": False}  #: of pixels that are not computed
REFUSED = -1000  #: in place of a period, where there is no map
ORBITS = "across along start"  #: axes of an array of orbits
TABLES = ("motion", "attractor", "exponent", "outcome", "state", "means", "refused")  #: arrays of a pixel


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ParameterPlane(WithCoordinates, Result):
    """The attractors over W values of one parameter by V of another, each reached by S orbits of n coordinates."""

    picture: ClassVar[str] = "nsmaps.figures.parameters.chart"

    coordinates: Coordinates
    parameters: tuple[str, str]  #: names of the one along and of the one across
    along: Floats = field(metadata=array("along", "values of the first parameter", name="first"))
    across: Floats = field(metadata=array("across", "values of the second parameter", name="second"))
    motions: tuple[Motion, ...]  #: every motion that occurs, once
    motion: NDArray[np.int32] = field(metadata=array(ORBITS, "number of the motion of each orbit; -1 where it ended", NONE))
    attractor: NDArray[np.int8] = field(metadata=array(ORBITS, "number of the attractor at its pixel; -1 where it ended", NONE))
    exponent: Floats = field(metadata=array(ORBITS, "largest Lyapunov exponent; NaN where unknown", "per return"))
    outcome: NDArray[np.int8] = field(metadata=array(ORBITS, f"of the last return: {OUTCOMES}", NONE))
    state: Floats = field(metadata=array(f"{ORBITS} coordinate", "last state of each orbit; NaN where it ended"))
    observables: tuple[str, ...]  #: names of K observables
    means: Floats = field(metadata=array(f"{ORBITS} observable", "means per period of the forcing, without forcing per return"))
    refused: Bools = field(metadata=array("across along", "where there is no map", NONE))
    computed: Bools = field(metadata=array("across along", "where numbers are not those of a neighbouring pixel", NONE))
    reason: str  #: the first reason why there is no map; "" if there is one everywhere
    n_returns: int  #: number of returns computed; others are repetitions
    probes: int = 0  #: number of pixels that were to be filled, drawn at random and computed as well; 0 without any to fill
    differing: int = 0  #: number of these that had another motion than the one to be filled in
    units: Mapping[str, str] = field(default_factory=dict)  #: of coordinates and parameters, by name
    quantifiers: Mapping[str, Floats] = field(default_factory=dict, metadata=quantifier_array(ORBITS))

    @property
    def first(self) -> str:
        """The name of the parameter along."""
        return self.parameters[0]

    @property
    def second(self) -> str:
        """The name of the parameter across."""
        return self.parameters[1]

    @array_property(ORBITS, "period; 0: none found, -1: the orbit ended", RETURNS)
    def period(self) -> Ints:
        """The period of each orbit in returns, shape (W, V, S); 0: none found, -1: it ended."""
        return np.array([*(motion.period for motion in self.motions), -1])[self.motion]

    @array_property(ORBITS, "periods of the forcing in one period; 0: none found, -1: the orbit ended", NONE)
    def turns(self) -> Ints:
        """The period of each orbit in periods of the forcing, shape (W, V, S); 0: none found, -1: it ended."""
        return np.array([*(motion.turns for motion in self.motions), -1])[self.motion]

    @array_property(ORBITS, "name of the motion, such as 1:1/2T; empty where the orbit ended", NONE)
    def labels(self) -> NDArray[np.str_]:
        """The motion of each orbit, shape (W, V, S), such as 1:1/2T; "" where it ended, `escapes` where it leaves every bound."""
        names = np.array([*(motion.label for motion in self.motions), "", ESCAPE])
        return names[np.where((self.motion < 0) & (self.outcome != Outcome.escaped), -2, self.motion)]

    @array_property(ORBITS, "impact words of one period, or all words without one", NONE)
    def words(self) -> NDArray[np.str_]:
        """The words of each orbit, shape (W, V, S), with blanks between; see `Motion.words`."""
        return np.array([*(" ".join(motion.words) for motion in self.motions), ""])[self.motion]

    @property
    def counts(self) -> Ints:
        """The number of attractors at each pixel, shape (W, V)."""
        return self.attractor.max(axis=2).astype(np.int64) + 1

    @property
    def most_differing(self) -> float:
        """The largest share of the filled pixels that may have another motion, at 95 % confidence, by `probes`; 0 without any."""
        if self.computed.all() or self.differing == self.probes:
            return 0.0 if self.computed.all() else 1.0
        from scipy.stats import beta

        return float(beta.ppf(0.95, self.differing + 1, self.probes - self.differing))

    def shares(self) -> dict[str, float]:
        """The fraction of the pixels at which each motion attracts an orbit, the most frequent first; pixels may count twice.

        Filled pixels count as they are filled: see `computed` and `most_differing`.
        """
        kinds = list(dict.fromkeys(motion.label for motion in self.motions))
        found = np.sort(np.array([*(kinds.index(motion.label) for motion in self.motions), -1])[self.motion], axis=2)
        first = found >= 0
        first[..., 1:] &= found[..., 1:] != found[..., :-1]
        counts = np.bincount(found[first], minlength=len(kinds)) / self.refused.size
        return dict(sorted(zip(kinds, counts.tolist(), strict=True), key=lambda pair: -pair[1]))


@divides
def parameter_plane(
    system: System,
    plane: Mapping[str, "Axis | ArrayLike"],
    starts: StateLike,
    *,
    n_returns: int = 1000,
    transient: int = 1000,
    max_period: int = 32,
    direction: Way | None = None,
    tolerance: float = 1e-6,
    refine: int | None = None,
    observables: Sequence[ObservableLike] = (),
    quantifiers: Mapping[str, Function] | None = None,
    jobs: Jobs = SERIAL,
) -> ParameterPlane:
    """The attractors over the plane of two parameters: at each pixel those that the orbits of some starts reach.

    Where the class refuses the parameters there is no map, and the pixel is counted as refused. An orbit that comes back to a
    state to the last bit is not computed any further, since it repeats; all numbers are those of the whole orbit.

    Args:
        system: whose other parameters are kept.
        plane: the values of two parameters by name, ascending, shapes (V,) and (W,), or an `Axis`; the first is drawn along.
        starts: one state, shape (n,) or by name, or some, shape (S, n), phases in radians.
        n_returns: number after the transient, of which the exponent of an orbit without a period is the mean; at least
            `2 max_period`, in the last of which a period is sought.
        transient: number computed before these and discarded as the transient.
        max_period: longest period that is sought in the last returns alone; longer ones are sought in all `n_returns`.
        direction: with "up" or "down" orbits start where those of the neighbour along the first parameter ended; "both" has 2 S
            orbits, the ascending ones first. With None the orbits of every pixel begin at the given starts.
        tolerance: largest difference of a coordinate after a period, of an angle in radians, of others relative to the largest
            magnitude on the orbit.
        refine: distance of the pixels computed first, a power of two, such as 16. Others are computed beside those where the
            motions of neighbours differ, or none has a period, since windows of periodic motion lie everywhere among such ones;
            the rest is filled with the motion of a neighbour, without exponents, means and states. Filled pixels are drawn at
            random and computed as well, which bounds the share of those that differ. None computes every pixel.
        observables: quantities of impacts and flights, as of `observe`, whose means are taken from the last state on: over a
            period, or over `n_returns` returns.
        quantifiers: as for `basins`, of the states from the last one on: of one period, or of `n_returns` returns. Functions of
            modules, if there are other processes.
        jobs: see `nsmaps.Jobs`. Parts are pixels, with a direction rows, that make 2,000,000 returns together.

    Raises:
        StateError: the starts do not have the system's coordinates.
        NsmapsError: another argument is not valid, there is no map at any pixel, a quantifier raises or returns something else,
            or cannot be sent to another process.
        Interrupted: on Ctrl-C, with the plane of the finished parts, whose other pixels are not `computed`.
    """
    axes = {str(name): values_of(name, values) for name, values in plane.items()}
    check_plane(system, axes)
    check_length(n_returns, transient, max_period, tolerance)
    check_refine(refine, direction)
    now = as_starts(starts, system.coordinates).reshape(-1, len(system.coordinates))
    if not len(now):
        raise NsmapsError("there are no starts; expected: one state or more")
    quantities = observables_of(system, observables), quantifiers_of(quantifiers, ParameterPlane, *axes)
    how = now, Length(transient, n_returns, 2 * max_period), tolerance, direction, *quantities
    (first, columns), (second, rows) = axes.items()
    known = np.zeros(rows.size * columns.size, bool)
    work = _Work(Along(system, first, second), columns, rows, how, known)
    if refine is None or 1 in work.shape:
        work.compute(np.arange(work.known.size), jobs)
        refinement = work.without_filled()
    else:
        refinement = refined(work.shape, refine, _Levels(work, jobs, 2 * refine.bit_length()).kinds)
    if work.tables["refused"][work.known].all():
        raise NsmapsError(f"there is no map at any of {work.known.sum()} pixels: {work.reason}")
    return work.plane(refinement)


@dataclass(slots=True, eq=False)
class _Work:
    """The pixels of a plane that are computed, each a row of the tables."""

    map_of: Along[System]
    along: Floats
    across: Floats
    #: starts, returns, tolerance, direction, observables, quantifiers
    how: tuple[Floats, Length, float, Way | None, tuple[Observable, ...], tuple[Quantifier, ...]]
    known: Bools  #: of all pixels, by their numbers: which are computed
    tables: Arrays = field(default_factory=dict)
    motions: Motions = field(default_factory=Motions)
    reason: str = ""
    returns: int = 0

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.across), len(self.along)

    def compute(self, numbers: Ints, jobs: Jobs) -> None:
        """Compute some pixels, by their numbers; with a direction all of them."""
        starts, length, _, direction = self.how[:4]
        places = np.column_stack([self.along[numbers % len(self.along)], self.across[numbers // len(self.along)]])
        each = places.reshape(*self.shape, 2) if direction else places[:, None]
        size = -(-PART // ((length.discard + length.returns) * len(starts) * each.shape[1] * len(WAYS[direction])))
        cuts = jobs.cuts(len(each), size)
        rows = [each[cut] if direction else each[cut].reshape(1, -1, 2) for cut in cuts]
        ends = np.cumsum([0, *(row.shape[0] * row.shape[1] for row in rows)])

        def write(parts: dict[int, Arrays]) -> None:
            for k, part in parts.items():
                self._write(part, numbers[ends[k] : ends[k + 1]])

        def unfinished(parts: dict[int, Arrays]) -> ParameterPlane:
            write(parts)
            return self.plane(self.without_filled())

        write(dict(enumerate(jobs.run(pixels, [(self.map_of, row, *self.how) for row in rows], unfinished))))

    def _write(self, part: Arrays, numbers: Ints) -> None:
        """Write the result of a part."""
        own = np.array([*map(self.motions.number, motions_of(part)), -1], np.int32)
        found = {name: part[name] for name in TABLES} | {"motion": own[part["motion"]]}
        found |= {name: rows for name, rows in part.items() if name.startswith(QUANTIFIER)}
        for name, rows in found.items():
            if name not in self.tables:
                self.tables[name] = np.full((self.known.size, *rows.shape[1:]), MISSING.get(name, np.nan), rows.dtype)
            check_shapes(name.removeprefix(QUANTIFIER), list(dict.fromkeys(x.shape[2:] for x in (self.tables[name], rows))))
            self.tables[name][numbers] = rows
        self.known[numbers] = True
        self.reason, self.returns = self.reason or str(part["reason"]), self.returns + int(part["computed"])

    def without_filled(self) -> Refinement:
        """The pixels that are computed; no other has a motion."""
        return Refinement(np.arange(self.known.size), self.known.reshape(self.shape), 0, 0)

    def plane(self, refinement: Refinement) -> ParameterPlane:
        """The plane, some of whose pixels have the motions of others; what was not computed has no numbers."""
        known = refinement.computed.ravel()
        filled: dict[str, Any] = {name: rows[refinement.source.ravel()] for name, rows in self.tables.items()}
        own = {each.name: f"{QUANTIFIER}{each.name}" for each in self.how[-1]}
        for name in ("exponent", "means", "state", *own.values()):
            if name in filled:
                filled[name][~known] = np.nan
        filled = {name: rows.reshape(*self.shape, *rows.shape[1:]) for name, rows in filled.items()}
        names, observables = (self.map_of.parameter, str(self.map_of.second)), tuple(one.name for one in self.how[4])
        about = Coordinates(self.map_of.system.coordinates), names, self.along, self.across, tuple(self.motions.known)
        filled |= {"n_returns": self.returns, "probes": refinement.probes, "differing": refinement.differing}
        filled |= {"observables": observables, "computed": refinement.computed, "reason": self.reason}
        none = np.full(filled["motion"].shape, np.nan)
        filled["quantifiers"] = {name: filled.pop(stored, none) for name, stored in own.items()}
        return ParameterPlane(*about, **filled, units=units_of(self.map_of.system))


@dataclass(slots=True, eq=False)
class _Levels:
    """The kinds of pixels for refinement, each round of pixels computed in parts of its own."""

    work: _Work
    jobs: Jobs
    rounds: int  #: number of rounds that is expected, for the progress
    done: int = 0
    kinds_known: dict[tuple[tuple[str, int], ...], int] = field(default_factory=dict)

    def kinds(self, numbers: Ints) -> Ints:
        """The kinds of pixels, by their numbers, which are computed: the names and periods of their attractors."""
        self.work.compute(numbers, self.jobs.share(self._share(self.done), self._share(self.done + 1), f"round-{self.done:04d}"))
        self.done += 1
        motions = [(motion.label, motion.period) for motion in self.work.motions.known]
        columns = (self.work.tables[name][numbers].tolist() for name in ("motion", "outcome", "refused"))
        rows = zip(numbers.tolist(), *columns, strict=True)
        return np.array([self._kind(motions, *row) for row in rows], np.int64)

    def _kind(self, motions: list[tuple[str, int]], number: int, motion: list[int], outcome: list[int], refused: bool) -> int:
        """The number of the kind of one pixel; without a period one of its own."""
        if any(k >= 0 and not motions[k][1] for k in motion):
            return -1 - number
        found = [motions[k] if k >= 0 else ("", -1 - end) for k, end in zip(motion, outcome, strict=True)]
        kind = (("", REFUSED),) if refused else tuple(found)
        return self.kinds_known.setdefault(kind, len(self.kinds_known))

    def _share(self, number: int) -> float:
        """The fraction of the work before a round."""
        return min(number / self.rounds, 1 - 2.0 ** -(number + 1)) if number else 0.0
