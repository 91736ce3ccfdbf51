"""The attractors over the plane of two parameters, computed pixel by pixel, or by refinement."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nsmaps.arrays import ArrayLike, Bools, Floats, Ints
from nsmaps.coordinates import Coordinates, StateLike, as_starts
from nsmaps.dynamics.attractors.quantifiers import Function, Quantifier, check_shapes, quantifiers_of
from nsmaps.dynamics.planes.arguments import check_length, check_refine, maps_over, observables_of, values_of
from nsmaps.dynamics.planes.motions import Motion
from nsmaps.dynamics.planes.pixels import QUANTIFIER, WAYS, Way, motions_of, pixels
from nsmaps.dynamics.planes.plane import ParameterPlane
from nsmaps.dynamics.planes.quadtree import Refinement, refined
from nsmaps.dynamics.planes.tails import Length
from nsmaps.errors import NsmapsError
from nsmaps.exact.observables.spec import Observable, ObservableLike
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.surfaces.surface import Axis
from nsmaps.exact.systems.parameters import System
from nsmaps.parallel import SERIAL, Arrays, Parallel, divides
from nsmaps.results import units_of

PART = 2_000_000  #: returns of a part by default: about a second
MISSING = {"motion": -1, "attractor": -1, "outcome": Outcome.invalid, "refused": False}  #: of pixels that are not computed
REFUSED = -1000  #: in place of a period, where there is no map
TABLES = ("motion", "attractor", "exponent", "outcome", "state", "means", "refused")  #: arrays of a pixel


@divides
def parameter_plane(
    system: System | Callable[[float, float], ReturnMap],
    axes: Mapping[str, "Axis | ArrayLike"],
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
    parallel: Parallel = SERIAL,
) -> ParameterPlane:
    """The attractors over the plane of two parameters: at each pixel those that the orbits of some starts reach.

    Where the class refuses the parameters there is no map, and the pixel is counted as refused. What orbits end on is decided as
    in `bifurcation_diagram`; with a `direction` each row is one along the first parameter. An orbit that comes back to a state to
    the last bit is not computed any further, since it repeats; all numbers are those of the whole orbit.

    Args:
        system: whose other parameters are kept, or a function of both parameters that gives the return map, and raises a
            ValueError where there is none.
        axes: the values of two parameters by name, ascending, shapes (V,) and (W,), or an `Axis`; the first is drawn along.
        starts: one state, shape (n,) or by name, or some, shape (S, n), phases in radians.
        n_returns: number after the transient, of which the exponent of an orbit without a period is the mean; at least
            `2 max_period`, in the last of which a period is sought.
        transient: number computed before these and discarded as the transient.
        max_period: longest period that is sought in the last returns alone; longer ones are sought in all `n_returns`.
        direction: with "up" or "down" orbits start where those of the neighbour along the first parameter ended; "both" has 2 S
            orbits, the ascending ones first. With None the orbits of every pixel begin at the given starts.
        tolerance: largest difference of a coordinate after a period, of an angle in radians, of others relative to the extent
            of the motion, between events too; see `nsmaps.dynamics.scale.scale_of`.
        refine: distance of the pixels computed first, a power of two, such as 16. Others are computed beside those where the
            motions of neighbours differ, or none has a period, since windows of periodic motion lie everywhere among such ones.
            Elsewhere the attractors of a neighbour are continued, by orbits from their states at the parameters of the pixel;
            where these end on another motion the pixel is computed. Some of the others are drawn at random and computed as well,
            which bounds the share at which the starts reach another motion. None computes every pixel.
        observables: quantities of impacts and flights, as of `observe`, whose means are taken over the period of a cycle, or over
            `n_returns` returns from the last state on.
        quantifiers: as for `basins`, of the states of a cycle, or of `n_returns` returns from the last state on. Functions of
            modules, if there are other processes.
        parallel: see `nsmaps.Parallel`. Parts are pixels, with a direction rows, that make 2,000,000 returns together.

    Raises:
        StateError: the starts do not have the system's coordinates.
        NsmapsError: another argument is not valid, there is no map at any pixel, a quantifier raises or returns something else,
            or cannot be sent to another process.
        Interrupted: on Ctrl-C, with the plane of the finished parts, whose other pixels are not `computed`.
    """
    read = {str(name): values_of(name, values) for name, values in axes.items()}
    map_of, some = maps_over(system, read)
    check_length(n_returns, transient, max_period, tolerance)
    check_refine(refine, direction)
    now = as_starts(starts, some.coordinates).reshape(-1, len(some.coordinates))
    if not len(now):
        raise NsmapsError("there are no starts; expected: one state or more")
    quantities = observables_of(some, observables), quantifiers_of(quantifiers, ParameterPlane, *read)
    how = now, Length(transient, n_returns, 2 * max_period), tolerance, direction, *quantities
    known = np.zeros(np.prod([values.size for values in read.values()]), bool)
    work = _Work(map_of, some, read, how, known)
    if refine is None or 1 in work.shape:
        work.compute(np.arange(work.known.size), parallel)
        refinement = None
    else:
        levels = _Levels(work, parallel, 2 * refine.bit_length())
        refinement = refined(work.shape, refine, levels.kinds, levels.continued)
    if work.tables["refused"][work.known].all():
        raise NsmapsError(f"there is no map at any of {work.known.sum()} pixels: {work.reason}")
    return work.plane(refinement)


@dataclass(slots=True, eq=False)
class _Work:
    """The pixels of a plane that are computed, each a row of the tables."""

    map_of: Callable[[float, float], ReturnMap]
    some: ReturnMap  #: the map at one pixel
    axes: dict[str, Floats]  #: the values of both parameters
    #: starts, returns, tolerance, direction, observables, quantifiers
    how: tuple[Floats, Length, float, Way | None, tuple[Observable, ...], tuple[Quantifier, ...]]
    known: Bools  #: of all pixels, by their numbers: which are computed
    tables: Arrays = field(default_factory=dict)
    motions: dict[Motion, int] = field(default_factory=dict)  #: the number of each, in the order in which they are met
    reason: str = ""
    returns: int = 0

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        along, across = map(len, self.axes.values())
        return across, along

    @property
    def coordinates(self) -> Coordinates:
        """The coordinates of the states."""
        return Coordinates(self.some.coordinates)

    def compute(self, numbers: Ints, parallel: Parallel) -> None:
        """Compute some pixels, by their numbers; with a direction all of them."""
        starts, length, _, direction = self.how[:4]
        places = self._places(numbers)
        each = places.reshape(*self.shape, 2) if direction else places[:, None]
        size = -(-PART // ((length.discard + length.returns) * len(starts) * each.shape[1] * len(WAYS[direction])))
        cuts = parallel.cuts(len(each), size)
        rows = [each[cut] if direction else each[cut].reshape(1, -1, 2) for cut in cuts]
        ends = np.cumsum([0, *(row.shape[0] * row.shape[1] for row in rows)])

        def write(parts: dict[int, Arrays]) -> None:
            for k, part in parts.items():
                own = numbers[ends[k] : ends[k + 1]]
                self._write(part, own)
                self.known[own] = True

        def unfinished(parts: dict[int, Arrays]) -> ParameterPlane:
            write(parts)
            return self.plane()

        write(
            dict(enumerate(parallel.run(pixels, [(self.map_of, self.coordinates, row, *self.how) for row in rows], unfinished)))
        )

    def continue_from(self, numbers: Ints, sources: Ints, parallel: Parallel) -> None:
        """The attractors at some pixels of orbits that start on those of others; the numbers of both, of as many."""
        window = self.how[1].window
        starts, length = self.tables["state"][sources], Length(window, window, window)
        cuts = parallel.cuts(len(numbers), -(-PART // (2 * window * starts.shape[1])))
        places = [self._places(numbers[cut])[None] for cut in cuts]
        given = self.map_of, self.coordinates
        parts = [(*given, place, starts[cut], length, *self.how[2:]) for place, cut in zip(places, cuts, strict=True)]
        found = parallel.run(pixels, parts, lambda parts: self.plane())
        for cut, part in zip(cuts, found, strict=True):
            self._write(part, numbers[cut])

    def forget(self, numbers: Ints) -> None:
        """Let some pixels have no numbers."""
        for name, rows in self.tables.items():
            rows[numbers] = MISSING.get(name, np.nan)

    def _places(self, numbers: Ints) -> Floats:
        """The parameters of some pixels, shape (N, 2)."""
        along, across = self.axes.values()
        return np.column_stack([along[numbers % len(along)], across[numbers // len(along)]])

    def _write(self, part: Arrays, numbers: Ints) -> None:
        """Write the result of a part."""
        own = np.array([*(self.motions.setdefault(each, len(self.motions)) for each in motions_of(part)), -1], np.int32)
        found = {name: part[name] for name in TABLES} | {"motion": own[part["motion"]]}
        found |= {name: rows for name, rows in part.items() if name.startswith(QUANTIFIER)}
        for name, rows in found.items():
            if name not in self.tables:
                self.tables[name] = np.full((self.known.size, *rows.shape[1:]), MISSING.get(name, np.nan), rows.dtype)
            check_shapes(name.removeprefix(QUANTIFIER), list(dict.fromkeys(x.shape[2:] for x in (self.tables[name], rows))))
            self.tables[name][numbers] = rows
        self.reason, self.returns = self.reason or str(part["reason"]), self.returns + int(part["computed"])

    def plane(self, refinement: Refinement | None = None) -> ParameterPlane:
        """The plane of what is known."""
        filled: dict[str, Any] = {name: rows.reshape(*self.shape, *rows.shape[1:]) for name, rows in self.tables.items()}
        own = {each.name: f"{QUANTIFIER}{each.name}" for each in self.how[-1]}
        (first, along), (second, across) = self.axes.items()
        about = self.coordinates, (first, second), along, across, tuple(self.motions)
        filled |= {"n_returns": self.returns, "observables": tuple(one.name for one in self.how[4]), "reason": self.reason}
        filled["computed"] = self.known.reshape(self.shape)
        if refinement is not None:
            filled |= {"probes": refinement.probes, "differing": refinement.differing}
        units = {**units_of(self.some), **{one.name: one.unit for one in self.how[4] if one.unit}}
        none = np.full(filled["motion"].shape, np.nan)
        filled["quantifiers"] = {name: filled.pop(stored, none) for name, stored in own.items()}
        return ParameterPlane(*about, **filled, units=units)


@dataclass(slots=True, eq=False)
class _Levels:
    """The kinds of pixels for refinement, each round of pixels computed in parts of its own."""

    work: _Work
    parallel: Parallel
    rounds: int  #: number of rounds that is expected, for the progress
    done: int = 0
    kinds_known: dict[tuple[tuple[str, int], ...], int] = field(default_factory=dict)

    def kinds(self, numbers: Ints) -> Ints:
        """The kinds of pixels, by their numbers, which are computed: the names and periods of their attractors."""
        self.work.compute(numbers, self._jobs())
        return self._known(numbers)

    def continued(self, numbers: Ints, sources: Ints) -> Bools:
        """Whether the attractors of sources, continued to other pixels, are of the same kind there."""
        self.work.continue_from(numbers, sources, self._jobs())
        same = self._known(numbers) == self._known(sources)
        self.work.forget(numbers[~same])
        return np.asarray(same)

    def _jobs(self) -> Parallel:
        """Of the next round."""
        self.done += 1
        return self.parallel.share(self._share(self.done - 1), self._share(self.done), f"round-{self.done - 1:04d}")

    def _known(self, numbers: Ints) -> Ints:
        """The kinds of pixels that have numbers."""
        motions = [(motion.label, motion.period) for motion in self.work.motions]
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
