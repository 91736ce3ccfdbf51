"""The arguments of a search, read and refused."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import StateLike
from nsmaps.dynamics.design.conditions import margins
from nsmaps.dynamics.design.problem import Point, Problem
from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.errors import NsmapsError, check_choice
from nsmaps.exact.systems.parameters import System

if TYPE_CHECKING:
    from nsmaps.exact.observables.spec import Observable, ObservableLike

Range = tuple[float, float]


def family_of(
    system: System | Callable[..., System], bounds: Mapping[str, Range], guess: Mapping[str, float] | None
) -> tuple[Callable[..., System], Mapping[str, float]]:
    """The systems as a function of parameters, and the first ones: of a system its own where none are given."""
    if isinstance(system, System):
        own = system.parameters
        return system.at, {name: own[name] for name in bounds if name in own} if guess is None else guess
    if not callable(system) or guess is None:
        raise NsmapsError(f"a {type(system).__name__}, guess {guess}; expected: a system, or a function and `guess`")
    return system, guess


def box(bounds: Mapping[str, Range], guess: Mapping[str, float]) -> tuple[tuple[str, ...], Floats, Floats, Floats]:
    """The names of the parameters, their least and greatest values, and the first ones as shares of their ranges."""
    names = tuple(bounds)
    if not names or set(names) != set(guess):
        given = f"bounds are of {', '.join(names) or 'nothing'}, guess of {', '.join(guess) or 'nothing'}"
        raise NsmapsError(f"{given}; expected: both of the same parameters, at least one")
    try:
        low, high = np.array([[float(low), float(high)] for low, high in map(bounds.__getitem__, names)]).T
        values = np.array([float(guess[name]) for name in names])
    except (TypeError, ValueError):
        raise NsmapsError(
            f"bounds are {dict(bounds)!r:.200}, guess {dict(guess)!r:.200}; expected: pairs of numbers, and numbers"
        ) from None
    for name, lowest, value, highest in zip(names, low, values, high, strict=True):
        if not (np.isfinite([lowest, highest]).all() and lowest < highest and lowest <= value <= highest):
            text = f"{name} begins at {value:g} with bounds {lowest:g} and {highest:g}"
            raise NsmapsError(f"{text}; expected: finite bounds in ascending order, and a value within them")
    return names, low, high, (values - low) / (high - low)


def offsets_of(tolerances: Mapping[str, float], bounds: Mapping[str, Range]) -> Floats:
    """None and every parameter more and less by its tolerance, as shares of their ranges, shape (m, k)."""
    if not set(tolerances) <= set(bounds) or not all(0 < value < np.inf for value in tolerances.values()):
        given = ", ".join(f"{name} = {value:g}" for name, value in tolerances.items())
        raise NsmapsError(f"the tolerances are {given}; expected: numbers above zero, of {', '.join(bounds)}")
    sizes = np.diag([tolerances.get(name, 0.0) / (high - low) for name, (low, high) in bounds.items()])
    sizes = sizes[sizes.any(axis=1)]
    return np.vstack([np.zeros((1, len(bounds))), sizes, -sizes])


def check_limits(
    sense: str, multiplier: float | None, graze: float, share: float, counts: Mapping[str, int], sampled: bool
) -> None:
    """Refuse limits that mean nothing."""
    check_choice("sense", sense, ("max", "min"))
    for name, count in counts.items():
        if count < 1:
            raise NsmapsError(f"{name} is {count!r}; expected: a whole number of at least 1")
    if not (multiplier is None or 0 < multiplier <= 1) or not 0 <= graze < 1 or not 0 <= share <= 1:
        text = f"multiplier is {multiplier}, graze {graze:g}, share {share:g}"
        raise NsmapsError(f"{text}; expected: a multiplier up to 1 or None, a margin from 0 up to below 1, a share from 0 to 1")
    if share and not sampled:
        raise NsmapsError(f"share is {share:g} of no states; expected: 'states', of which that share is to come to the motion")


def observed(system: System, observable: "ObservableLike", per: str | None) -> "tuple[Observable, str]":
    """The observable of an exact system, and what its mean is per."""
    from nsmaps.exact.observables.formulas import resolve_observables

    forced = System.require(system, "observables").period() is not None
    known = ("period", "return", "time") if forced else ("return", "time")
    if per is not None and per not in known:
        raise NsmapsError(f"per is {per!r}; expected: {' or '.join(map(repr, known))}{'' if forced else ', without forcing'}")
    return resolve_observables(system, [observable])[0], per or known[0]


def first_point(problem: Problem, at: Floats, start: StateLike, period: int, motion: str) -> Point:
    """The motion at the first parameters."""
    system, where = problem.system(at), text(problem.parameters(at))
    orbit = periodic_orbit(system, start, period)
    if not (orbit.converged and orbit.exists):
        raise NsmapsError(f"no periodic orbit was found at {where} from the start; expected: a start near the motion there")
    if motion not in ("", orbit.word, orbit.label):
        raise NsmapsError(f"the motion at {where} is {orbit.label} with the word {orbit.word}; expected: {motion}")
    if problem.grazes(system, orbit):
        margin = margins(system, orbit).min()
        raise NsmapsError(f"the motion at {where} has a margin of {margin:.3g} from a graze; expected: {problem.graze:g} or more")
    found = problem.measured(at, system, orbit)
    if found is None:
        name, kinds = (
            problem.observable.name,
            "as those of largest values, and motion with rest or chatter",
        )
        raise NsmapsError(f"{name!r} has no derivative at {where}, {kinds}; expected: a mean of a motion without them")
    return found


def text(parameters: Mapping[str, float]) -> str:
    """Parameters in words."""
    return ", ".join(f"{name} = {value:.6g}" for name, value in parameters.items())
