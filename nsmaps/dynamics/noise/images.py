"""Orbits of maps to whose images independent normal deviates are added."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI
from nsmaps.exact.returnmap import ReturnMap, repeat_outcomes
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.interrupts import check_stop
from nsmaps.parallel import Arrays

RETURNS = 20_000  #: of a part, unless 8 realisations have more


def kicked_orbits(return_map: ReturnMap, start: Floats, kicks: Floats) -> Returns:
    """The first n returns of M states (M, dim), n M rows, to each of whose images a kick is added, shape (n, M, dim).

    Angles stay on the circle. The loop is compiled where the map is given by formulas.
    """
    if isinstance(return_map, PiecewiseMap):
        return return_map._kernel().kicked_orbits(start, kicks)
    parts = list[Returns]()
    for kick in kicks:
        found = _moved(return_map.first_return(parts[-1].image if parts else start), kick)
        parts.append(repeat_outcomes(found, parts[-1] if parts else None))
        check_stop()
    return Returns.concatenate(parts or [return_map.first_return(start[:0])])


def _moved(returns: Returns, kick: Floats) -> Returns:
    """Returns to whose images kicks are added."""
    moved = returns.image + kick
    image = returns.coordinates.wrap(moved)
    with np.errstate(invalid="ignore"):
        turns = np.where(returns.valid[:, None], np.rint((moved - image) / TWO_PI), 0.0)
    return replace(returns, image=image, turns=returns.turns + turns.astype(np.int32))


def kicked_realisations(how: tuple[Any, ...], starts: Floats, numbers: Sequence[int]) -> Arrays:
    """The tables of the realisations with the given numbers, as of those with a forcing by noise."""
    return_map, sizes, n, seed = how
    r, dim = starts.shape
    kicks = np.empty((n, r, dim))
    for i, number in enumerate(numbers):
        kicks[:, i] = sizes * generator(seed, number).standard_normal((n, dim))
    found = kicked_orbits(return_map, np.ascontiguousarray(starts), kicks)
    rows = {name: getattr(found, name) for name in ("image", "turns", "codes", "outcome", "time")}
    each = {name: np.swapaxes(row.reshape(n, r, *row.shape[1:]), 0, 1) for name, row in rows.items()}
    states = np.concatenate([starts[:, None], each.pop("image")], axis=1)
    eta = np.concatenate([np.zeros((r, 1, dim)), np.swapaxes(kicks, 0, 1)], axis=1)
    return {"states": states, **each, "eta": np.where(np.isfinite(states), eta, np.nan), "impacts": np.empty((r, 0, 3))}


def generator(seed: int | Sequence[int], number: int) -> np.random.Generator:
    """The random numbers of one realisation."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(number,))))
