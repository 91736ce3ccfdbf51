"""Step vi: states outside of the grid's box are reset to the place at which the exact map returns to it."""

from collections.abc import Iterator

import numpy as np

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import TWO_PI, Coordinates, is_angle
from nsmaps.dynamics.orbit import orbit
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.reduced.composite.composite import Piece
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.reduced.partition.candidates import box_of, inside
from nsmaps.reduced.partition.cell import rounded

STARTS, RETURNS = 400, 100  #: number of states that are followed back into the box, and of returns


def resets(return_map: ReturnMap, returns: Returns, grid: Grid) -> Iterator[Piece]:
    """Pieces that set states below, above and beside the grid's box to one state each, that to which most of them return.

    The paper resets phi > pi to phi = 1.2 (appendix algo_code); here the constants are those of the exact map: of the states
    where orbits enter the box to stay, or for the first time if none stays, the one nearest to their median. There is no
    reset where no orbit returns.

    Args:
        returns: of the whole grid; those that leave its box are the states that are followed.
    """
    names, box = returns.coordinates, box_of(grid)
    left = returns.image[returns.valid & ~inside(returns.image, box)]
    signed: Bools = np.any(returns.image[returns.valid] < 0, axis=0)
    for i, name in enumerate(names):
        for side, text in _outside(name, float(box[i, 0]), float(box[i, 1]), bool(signed[i])):
            region = ConditionRegion(text=text, coordinates=names)
            states = left[region.contains(left)] if len(left) else left
            if not len(states):
                states = _beyond(box, i, side, bool(names.angles[i]))
            state = _entrance(return_map, states[:: -(-len(states) // STARTS)], box)
            if state is not None:
                values = {each: rounded(x, width) for each, x, width in zip(names, state, np.ptp(box, axis=1), strict=True)}
                yield Piece(f"reset {name} {side}", region, PolyMap.reset(names, values))


def _outside(name: str, low: float, high: float, signed: bool) -> Iterator[tuple[str, str]]:
    """The sides on which a coordinate may leave its interval, as conditions; others than `signed` ones are never negative."""
    if not is_angle(name):
        yield from [("below", f"{name} < {low!r}")] if low > 0 or signed else []
        yield "above", f"{name} > {high!r}"
    elif high - low < TWO_PI:
        low, high = low % TWO_PI, high % TWO_PI
        yield "beside", f"{name} < {low!r} or {name} > {high!r}" if low < high else f"{high!r} < {name} < {low!r}"


def _beyond(box: Floats, i: int, side: str, around: bool) -> Floats:
    """Random states outside of the box in coordinate i, shape (STARTS, n)."""
    bounds = box.copy()
    low, high = box[i]
    below = (0 if low > 0 else low - (high - low) / 4, low)
    bounds[i] = (high, low + TWO_PI) if around else below if side == "below" else (high, high + (high - low) / 4)
    return np.random.default_rng(5).uniform(bounds[:, 0], bounds[:, 1], (STARTS, len(box)))


def _entrance(return_map: ReturnMap, states: Floats, box: Floats) -> Floats | None:
    """The place where most orbits from states (N, n) enter the box to stay, or first if none stays; None if none enters."""
    path = orbit(return_map, states, RETURNS).states[1:]
    shifted = Coordinates(return_map.coordinates).lift(path, box.mean(axis=1))
    enclosed = inside(shifted.reshape(-1, len(box)), box).reshape(path.shape[:2])
    if enclosed[-1].any():
        rows = np.flatnonzero(enclosed[-1])
        last_outside = len(enclosed) - 1 - (~enclosed[::-1]).argmax(axis=0)
        begin = np.where(enclosed.all(axis=0), 0, last_outside + 1)[rows]
    else:
        rows = np.flatnonzero(enclosed.any(axis=0))
        begin = enclosed.argmax(axis=0)[rows]
    if not len(rows):
        return None
    first = path[begin, rows]
    away = np.abs(first - np.median(first, axis=0)) / (box[:, 1] - box[:, 0])
    return np.asarray(first[np.argmin(away.sum(axis=1))])
