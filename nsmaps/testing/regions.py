"""check_region: whether a region is the same set of states in numbers and in symbols."""

import warnings
from typing import Any

import numpy as np
import sympy as sp

from nsmaps.arrays import ArrayLike, Bools, Floats
from nsmaps.coordinates import TWO_PI, as_states, wrap
from nsmaps.errors import CheckError, ConditionError
from nsmaps.exact.systems.files import place_of
from nsmaps.reduced.conditions.region import Region, as_condition

TRIALS, SIZES = 2000, (0.01, 0.1, 1.0, 10.0, 100.0)  #: random states of each size that are tried, of both signs


def check_region(region: Region, states: ArrayLike | None = None) -> None:
    """Check that a region's `contains` and `condition` are one set of states, and that no invalid state lies in it.

    Args:
        states: trial states, shape (N, n), angles in [0, 2 pi), some of them in the region; else random ones of all sizes.

    Raises:
        CheckError: says what is wrong, at which state, and what is expected.
    """
    if not isinstance(region, Region):
        raise CheckError(f"{region!r} is not a region; expected: an object of a class that inherits from nsmaps.Region")
    name = type(region).__name__
    trials = _random_states(region) if states is None else as_states(states, region.coordinates)
    if (trials[:, angles := region.coordinates.angles] != wrap(trials[:, angles])).any():
        raise CheckError(f"`states` of {name} have angles outside [0, 2 pi); expected: angles as regions are given them")
    inside = _mask(region, trials)
    if not inside.any():
        raise CheckError(f"none of {len(trials)} trial states lies in {name}; expected: `states` of which some do")
    _check_one_by_one(region, trials, inside)
    _check_no_states(region, trials[inside][0])
    _check_condition(region, trials, inside)
    _warn_of_turns(region, trials, inside)


def check_one_set(region: Region, states: Floats) -> None:
    """CheckError unless a region contains those of some states (N, n), angles in [0, 2 pi), of which its condition holds."""
    _check_condition(region, states, _mask(region, states))


def _mask(region: Region, states: Floats) -> Bools:
    """The states that a region contains; a CheckError where its class gives no mask."""
    inside, count = _called(region, "contains", states), len(states)
    if not (isinstance(inside, np.ndarray) and inside.dtype == bool and inside.shape == (count,)):
        what = f"{inside.dtype} of shape {inside.shape}" if isinstance(inside, np.ndarray) else type(inside).__name__
        name = type(region).__name__
        raise CheckError(f"{name}.contains gives {what} for {count} states; expected: an array of bool, shape ({count},)")
    return inside


def _called(region: Region, method: str, *given: Floats) -> Any:
    """What a method gives; a CheckError with its place where it raises another error."""
    try:
        with np.errstate(all="ignore"):
            return getattr(region, method)(*given)
    except Exception as error:
        where, hint = place_of(type(region), method), ""
        if method == "condition" and "truth value" in str(error):
            hint = ". Inequalities of symbols are joined by sp.And, sp.Or and sp.Not, or by & | ~ between parentheses"
        text = f"{type(region).__name__}.{method}{where} raises {type(error).__name__}: {error}{hint}"
        raise CheckError(f"{text}; expected: no error for states of shape (N, {len(region.coordinates)})") from error


def _random_states(region: Region) -> Floats:
    rng, angles = np.random.default_rng(1), region.coordinates.angles
    shape = TRIALS, len(angles)
    return np.concatenate([np.where(angles, rng.uniform(0, TWO_PI, shape), rng.uniform(-size, size, shape)) for size in SIZES])


def _check_one_by_one(region: Region, states: Floats, inside: np.ndarray) -> None:
    """Each state is judged by itself, whatever else is in the batch."""
    for k in [*np.flatnonzero(inside)[:10], *np.flatnonzero(~inside)[:10]]:
        if bool(region.contains(states[k : k + 1])[0]) != inside[k]:
            raise CheckError(
                f"{type(region).__name__}.contains says {inside[k]} of {states[k].tolist()} among {len(states)} states and "
                f"{not inside[k]} of it alone; expected: each state judged by itself"
            )
    if len(_called(region, "contains", states[:0])):
        raise CheckError(f"{type(region).__name__}.contains finds states where there are none; expected: an empty array")


def _check_no_states(region: Region, state: Floats) -> None:
    """NaN and infinity lie in no region."""
    for i, name in enumerate(region.coordinates):
        for value in (np.nan, np.inf, -np.inf):
            wrong = np.where(np.arange(len(state)) == i, value, state)
            if region.contains(wrong[None])[0]:
                raise CheckError(
                    f"{type(region).__name__}.contains holds {wrong.tolist()}; expected: no state with {name} = {value}, "
                    "as a state that is NaN or infinite lies in no region"
                )


def _warn_of_turns(region: Region, states: Floats, inside: np.ndarray) -> None:
    """Warn of a region that ends beyond [0, 2 pi) of an angle, and not at the same place of the circle."""
    for i in np.flatnonzero(region.coordinates.angles):
        turn = TWO_PI * (np.arange(states.shape[1]) == i)
        for sign in (-1, 1):
            beyond = ~inside & region.contains(states + sign * turn) & ~region.contains(states + 2 * sign * turn)
            if beyond.any():
                name, state = region.coordinates[int(i)], states[beyond][0]
                warnings.warn(
                    f"{type(region).__name__} contains {(state + sign * turn).tolist()}, and not {state.tolist()}, the same "
                    f"place of the circle. Regions are asked about {name} in [0, 2 pi) alone; one across {name} = 0 compares, "
                    f"for instance, cos({name} - c), or has an interval for each turn",
                    stacklevel=3,
                )
                break


def _check_condition(region: Region, states: Floats, inside: np.ndarray) -> None:
    """The condition in symbols holds of the same states."""
    name, given = type(region).__name__, _called(region, "condition")
    symbols = [sp.Symbol(str(each), real=True) for each in region.coordinates]
    if not isinstance(given, sp.logic.boolalg.Boolean):
        raise CheckError(f"{name}.condition gives {given!r}; expected: a sympy Boolean, such as an inequality")
    if unknown := given.free_symbols - set(symbols):
        raise CheckError(
            f"{name}.condition has the symbols {', '.join(sorted(map(str, unknown)))}; expected: only "
            f"{', '.join(map(str, symbols))}, each as sp.Symbol(name, real=True)"
        )
    try:
        holds = as_condition(region).contains(states)
    except ConditionError as error:
        raise CheckError(str(error)) from error
    if (holds != inside).any():
        k = int(np.flatnonzero(holds != inside)[0])
        raise CheckError(
            f"{name} is two sets of states: of {int((holds != inside).sum())} of {len(states)} trial states `contains` and "
            f"`condition` say different things, such as {bool(inside[k])} and {bool(holds[k])} of {states[k].tolist()}; "
            f"expected: the same of every state with angles in [0, 2 pi). The condition is {sp.sstr(given)}"
        )
