"""Whether a map of a user-defined class is one: its returns, batches, derivatives and parameters."""

import warnings
from collections.abc import Collection

import numpy as np

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.coordinates import TWO_PI, BoxLike, as_box, as_states
from nsmaps.errors import CheckError
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.testing.formulas import neighbours

TRIALS, SIZES = 200, (-2.0, 1.0)  #: random states without `states`, powers of ten of their sizes
STEP = 1e-6  #: of differences, relative
ALONE = 7  #: states whose returns are computed one by one
SAME = 1e-9  #: of what is the same, relative


def check_map(system: System, states: ArrayLike | None, box: BoxLike | None = None) -> None:
    """As `check_system`."""
    name = type(system).__name__
    starts = trial_states(system, box) if states is None else as_states(states, system.coordinates)
    given = starts.copy()
    returns = system.first_return(starts, derivative=True)
    if not np.array_equal(starts, given, equal_nan=True):
        raise CheckError(f"`first_return` of {name} changes the states that it is given; expected: an array of its own")
    if not returns.valid.any():
        raise CheckError(
            f"none of {len(returns)} states of {name} has an image ({returns.counts()}); expected: `states` with one"
        )
    if isinstance(system, PiecewiseMap):
        from nsmaps.testing.pieces import check_pieces

        check_pieces(system, returns, states is not None or box is not None)
    _check_rows(system, returns)
    _check_batches(system, returns)
    found = returns.select(returns.valid)
    if returns.derivative is None:
        warnings.warn(f"{name} has no derivatives, which periodic orbits, branches and exponents need", stacklevel=3)
    else:
        check_derivatives(system, found)
    if not isinstance(system, PiecewiseMap):  # whose formulas say on what they depend
        check_influence(system, found)


def trial_states(system: System, box: BoxLike | None = None) -> Floats:
    """Random states of a box, or of all sizes and signs with angles of a whole turn, on the section."""
    rng = np.random.default_rng(1)
    shape = TRIALS, len(system.coordinates)
    if box is not None:
        low, high = as_box(box, system.coordinates).T
        return system.on_section(rng.uniform(low, high, shape))
    states = 10 ** rng.uniform(*SIZES, shape) * rng.choice([-1.0, 1.0], shape)
    return system.on_section(np.where(system.coordinates.angles, rng.uniform(0, TWO_PI, shape), states))


def _check_rows(system: System, returns: Returns) -> None:
    """Returns say of each state what `Returns` promise: angles in a turn, an outcome with an image where there is one."""
    name, angles = type(system).__name__, system.coordinates.angles
    images = returns.image[returns.valid][:, angles]
    if not ((images >= 0) & (images < TWO_PI)).all():
        raise CheckError(f"an angle of an image of {name} is not in [0, 2 pi); expected: as of `Returns.of_map`")
    odd = np.flatnonzero(returns.valid != returns.decided)
    if odd.size:
        start, image = returns.start[odd[0]], returns.image[odd[0]]
        outcome = next(iter(returns.select(odd[:1]).counts()))
        raise CheckError(f"the state {start} of {name} has the image {image} and is {outcome!r}; expected: only one of the two")


def _check_batches(system: System, returns: Returns) -> None:
    """The return of a state does not depend on the others of a batch, nor on whether derivatives are asked for."""
    some = returns.select(np.unique(np.linspace(0, len(returns) - 1, ALONE).astype(int)))
    alone = Returns.concatenate([system.first_return(state[None]) for state in some.start])
    none = system.first_return(some.start[:0], derivative=True)
    if len(none) or none.image.shape[1:] != returns.image.shape[1:]:
        raise CheckError(f"{type(system).__name__} has {len(none)} returns of no states; expected: none, of shape (0, n)")
    if not (np.allclose(alone.lifted, some.lifted, SAME, SAME, equal_nan=True) and np.array_equal(alone.codes, some.codes)):
        row = int(np.argmax(~np.isclose(alone.lifted, some.lifted, SAME, SAME, equal_nan=True).all(axis=1)))
        raise CheckError(
            f"the state {some.start[row]} of {type(system).__name__} has the image {alone.image[row]} alone and "
            f"{some.image[row]} among others, with derivatives; expected: the same"
        )


def check_influence(system: System, returns: Returns) -> None:
    """Every parameter changes some return."""
    for name in type(system).parameter_names():
        others = [other.first_return(other.on_section(returns.start), derivative=True) for other in neighbours(system, name)]
        if others and all(np.array_equal(other.image, returns.image, equal_nan=True) for other in others):
            raise CheckError(
                f"no return of {type(system).__name__} depends on its parameter {name!r}: the same from {len(returns)} states "
                f"with {name} a hundredth more or less; expected: an effect, `states` that show it, or no such parameter"
            )


def check_derivatives(system: System, returns: Returns, bound: Collection[str] = ()) -> None:
    """The derivatives, but by `bound` coordinates, are those of differences wherever two differences agree."""
    assert returns.derivative is not None
    for k in (k for k, name in enumerate(returns.coordinates) if name not in bound):
        quotients = []
        for share in (1.0, 0.5):
            h = share * STEP * np.maximum(np.abs(returns.start[:, k]), 1e-3)
            ends = [returns.start + sign * h[:, None] * np.eye(returns.start.shape[1])[k] for sign in (1, -1)]
            up, down = (system.first_return(end) for end in ends)
            same = (up.codes == returns.codes) & (down.codes == returns.codes)
            quotients.append(np.where(same[:, None], (up.lifted - down.lifted) / (2 * h[:, None]), np.nan))
        size = 1e-3 + np.abs(returns.derivative).max(axis=(1, 2))[:, None]
        sure = np.abs(quotients[0] - quotients[1]) <= 0.1 * 1e-3 * size
        off = np.where(sure, np.abs(quotients[1] - returns.derivative[:, :, k]) / size, 0.0)
        if off.max(initial=0.0) > 1e-3:
            row = int(off.max(axis=1).argmax())
            raise CheckError(
                f"the derivative of {type(system).__name__} by {returns.coordinates[k]} at {returns.start[row]} is "
                f"{returns.derivative[row, :, k]}; expected: {quotients[1][row]}, the difference of two returns"
            )
