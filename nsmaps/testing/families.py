"""check_family: whether a family judges each return by itself."""

import numpy as np

from nsmaps.arrays import ArrayLike, Bools
from nsmaps.coordinates import as_states
from nsmaps.errors import CheckError, NsmapsError
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.family import ReturnFamily, members, membership
from nsmaps.exact.systems.parameters import System
from nsmaps.testing.maps import trial_states

ALONE = 20  #: returns of the family, and others, that are asked about one by one


def check_family(family: ReturnFamily, system: System, states: ArrayLike | None = None) -> None:
    """Check that a family says of each return of a batch, by itself, whether it belongs to it.

    Args:
        system: whose returns are tried.
        states: trial states, shape (N, n), some of them with a return in the family; else random ones of all sizes.

    Raises:
        CheckError: says what is wrong, at which return, and what is expected.
    """
    if not isinstance(family, ReturnFamily):
        raise CheckError(f"{family!r} is not a family; expected: an object of a class that inherits from nsmaps.ReturnFamily")
    name = type(family).__name__
    trials = trial_states(system) if states is None else as_states(states, system.coordinates)
    returns = system.first_return(trials)
    before = returns.start.copy(), returns.image.copy(), returns.codes.copy()
    inside = _mask(family, returns)
    if not all(np.array_equal(*pair, equal_nan=True) for pair in zip(before, _arrays(returns), strict=True)):
        raise CheckError(f"{name}.contains changes the returns that it is given; expected: an array of its own")
    _check_one_by_one(family, returns, inside)
    if not members(system, returns, family)[0].any():
        raise CheckError(f"none of {len(returns)} trial states has a return in {name}; expected: `states` of which some have")


def _arrays(returns: Returns) -> tuple[np.ndarray, ...]:
    return returns.start, returns.image, returns.codes


def _mask(family: ReturnFamily, returns: Returns) -> Bools:
    """Which returns the family contains; a CheckError where it gives no mask."""
    try:
        return membership(family, returns)
    except NsmapsError as error:
        raise CheckError(str(error)) from error


def _check_one_by_one(family: ReturnFamily, returns: Returns, inside: Bools) -> None:
    """Each return is judged by itself, whatever else is in the batch."""
    name = type(family).__name__
    for k in [*np.flatnonzero(inside)[:ALONE], *np.flatnonzero(~inside)[:ALONE]]:
        if _mask(family, returns.select([k]))[0] != inside[k]:
            raise CheckError(
                f"{name}.contains says {inside[k]} of the return from {returns.start[k].tolist()} among {len(returns)} returns "
                f"and {not inside[k]} of it alone; expected: each return judged by itself"
            )
    _mask(family, returns.select(np.zeros(len(returns), bool)))
