"""The attractors at some pixels of a plane: the work of one part."""

from collections.abc import Callable
from itertools import chain
from typing import Literal

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.quantifiers import Place, Quantifier, quantified
from nsmaps.dynamics.motion import ESCAPE
from nsmaps.dynamics.observables.orbits import orbit_means
from nsmaps.dynamics.orbit import orbit
from nsmaps.dynamics.planes.motions import Motion, attractors, motion_of
from nsmaps.dynamics.planes.tails import Length, Tail, tail
from nsmaps.dynamics.returnmap import followed
from nsmaps.exact.observables.spec import Observable
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.systems.parameters import System
from nsmaps.parallel import Arrays

Way = Literal["up", "down", "both"]
QUANTIFIER = "quantifier-"  #: before the name of a quantifier among the arrays of a part
WAYS: dict[Way | None, tuple[int, ...]] = {None: (1,), "up": (1,), "down": (-1,), "both": (1, -1)}


def pixels(
    map_of: Callable[[float, float], ReturnMap],
    coordinates: Coordinates,
    rows: Floats,
    starts: Floats,
    length: Length,
    tolerance: float,
    direction: Way | None,
    observables: tuple[Observable, ...],
    quantifiers: tuple[Quantifier, ...] = (),
) -> Arrays:
    """The attractors at rows of pixels (R, V, 2), ascending along each row, of starts (S, n): arrays of R V rows.

    Starts (V, S, n) are those of each pixel of a row.
    With a direction every row is followed; with "both" there are 2 S orbits, the ascending ones first.
    """
    tails: list[tuple[Tail | None, ...]] = []
    reasons: list[str] = []
    for row in rows:
        passes = [_pass(map_of, row, starts, length, tolerance, way, direction is not None) for way in WAYS[direction]]
        tails += zip(*(found for found, _ in passes), strict=True)
        reasons += passes[0][1]
    about = {"refused": np.array([bool(reason) for reason in reasons]), "reason": np.array(next(filter(None, reasons), ""))}
    count, dim = starts.shape[-2:]
    found = _beside(tails, count, dim, length)
    table = _summary(found, coordinates, count * len(WAYS[direction]))
    return {**table, **about, **_along_orbits(map_of, rows.reshape(-1, 2), observables, quantifiers, table, length.returns)}


def _pass(
    map_of: Callable[[float, float], ReturnMap],
    row: Floats,
    starts: Floats,
    length: Length,
    tolerance: float,
    way: int,
    directed: bool,
) -> tuple[list[Tail | None], list[str]]:
    """The ends of orbits at the pixels of a row, taken up or down, and the reasons why there are none."""
    runs, reasons, _ = followed(
        lambda pixel: map_of(*pixel),
        row[::way],
        starts,
        lambda return_map, states: tail(return_map, states, length, tolerance),
        directed,
    )
    them = iter(runs)
    return [None if reason else next(them) for reason in reasons][::way], reasons[::way]


def _beside(tails: list[tuple[Tail | None, ...]], count: int, dim: int, length: Length) -> Tail:
    """The ends of all orbits, those of the passes at a pixel one after another; without a map the outcome is `invalid`."""
    found = Tail.empty(len(tails) * len(tails[0]) * count, length.window, dim)
    for k, each in enumerate(chain.from_iterable(tails)):
        if each is not None:
            own = slice(k * count, (k + 1) * count)
            for name in ("states", "outcome", "scale", "growth"):
                getattr(found, name)[own] = getattr(each, name)
            found.limits[own], found.computed = each.limits, found.computed + each.computed
    return found


def _summary(found: Tail, coordinates: Coordinates, orbits: int) -> Arrays:
    """Motions, attractors, exponents, outcomes and last states of the pixels, of `orbits` each, and the motions' names."""
    count, known, exponent = len(found.limits), dict[Motion, int](), found.growth
    motion, span = np.full(count, -1, np.int32), np.zeros(count, np.int64)
    on = found.final.copy()  # not all of the last returns with it
    for k, one in enumerate(found.limits):
        if one is not None and one.held:
            motion[k], span[k] = known.setdefault(motion_of(one), len(known)), one.length
            exponent[k] = one.rate if one.length else exponent[k]
            on[k] = on[k] if one.cycle is None else one.cycle.states[0]
        elif one is not None and one.kind == ESCAPE:
            found.states[k], found.outcome[k] = np.nan, Outcome.escaped
    labels = np.array(["" if one is None else one.label for one in found.limits])
    rows = found.states, span, found.scale, labels
    pixels = zip(*(each.reshape(-1, orbits, *each.shape[1:]) for each in rows), strict=True)
    table: Arrays = {
        "motion": motion,
        "span": span,  # in returns, each impact of a chatter counted
        "attractor": np.concatenate([attractors(coordinates, *pixel) for pixel in pixels]),
        "exponent": exponent,
        "outcome": found.outcome,
        "state": found.final.copy(),
        "on": on,  # the attractor
    }
    shaped = {name: rows.reshape(-1, orbits, *rows.shape[1:]) for name, rows in table.items()}
    return {**shaped, **as_arrays(tuple(known)), "computed": np.array(found.computed)}


def _along_orbits(
    map_of: Callable[[float, float], ReturnMap],
    places: Floats,
    observables: tuple[Observable, ...],
    quantifiers: tuple[Quantifier, ...],
    table: Arrays,
    returns: int,
) -> Arrays:
    """The means of K observables, shape (N, S, K), and quantifiers, of the cycles or from the last states on over all `returns`.

    The means are per period of the forcing, without forcing per return; NaN of orbits that ended. Quantifiers are (N, S, ...),
    under names with `QUANTIFIER` before them, if there is an attractor.
    """
    motion, states = table["motion"], table.pop("on")
    means, sets = np.full((*motion.shape, len(observables)), np.nan), list[tuple[Place, Floats, ReturnMap]]()
    length = np.where(table["span"] > 0, table["span"], returns)
    for k in np.flatnonzero((motion >= 0).any(axis=1)).tolist() if observables or quantifiers else ():
        system = map_of(*places[k].tolist())
        for n in set(length[k][motion[k] >= 0].tolist()):
            own = np.flatnonzero((length[k] == n) & (motion[k] >= 0))
            if observables:
                found = orbit_means(System.require(system, "observables"), states[k, own], n, observables, n_batches=1)
                means[k, own] = (found.per_return if found.period is None else found.per_period).value
            if quantifiers:
                path = orbit(system, states[k, own], n)
                sets += [((k, s), path.coordinates.wrap(path.states[:-1, j]), system) for j, s in enumerate(own.tolist())]
    values = quantified(quantifiers, motion.shape, sets) if sets else {}
    return {"means": means} | {f"{QUANTIFIER}{name}": rows for name, rows in values.items()}


def as_arrays(motions: tuple[Motion, ...]) -> Arrays:
    """Motions as arrays of a part; see `motions_of`."""
    words = [" ".join(motion.words) for motion in motions]
    numbers = np.array([(motion.period, motion.turns) for motion in motions], np.int64).reshape(-1, 2)
    return {"labels": np.array([motion.label for motion in motions], str), "words": np.array(words, str), "numbers": numbers}


def motions_of(arrays: Arrays) -> tuple[Motion, ...]:
    """The motions that `as_arrays` has put there."""
    rows = zip(arrays["labels"].tolist(), arrays["words"].tolist(), arrays["numbers"].tolist(), strict=True)
    return tuple(Motion(label, tuple(words.split()), *numbers) for label, words, numbers in rows)
