"""The free parameters of an estimate: bounds, guesses, and the range that is searched."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import ParameterError, near_match
from nsmaps.estimation.shooting.event_map import EventModel
from nsmaps.estimation.shooting.problem import Shooting
from nsmaps.exact.systems.parameters import System


@dataclass(frozen=True)
class Space:
    """The free parameters: bounds, the range of the search, and the guess; guesses of coordinates by name."""

    names: tuple[str, ...]
    low: Floats
    high: Floats
    first: Floats
    states: Mapping[str, float]

    @property
    def searched(self) -> tuple[Floats, Floats]:
        """The range of the search: the bounds, where infinite half and twice the guess."""
        wide = np.where(self.first == 0, 1.0, np.abs(self.first))
        low = np.where(np.isfinite(self.low), self.low, self.first - 0.5 * wide)
        return low, np.where(np.isfinite(self.high), self.high, self.first + wide)

    def guess(self) -> str:
        """The guess in words."""
        return ", ".join(f"{name} = {value:g}" for name, value in zip(self.names, self.first, strict=True))

    def near(self, model: EventModel) -> Floats | None:
        """The guess of the coordinates, None where one is missing."""
        return np.array([self.states[name] for name in model.names]) if set(model.names) <= set(self.states) else None

    def points(self, starts: int, random: np.random.Generator) -> list[Floats]:
        """Values of the parameters: the guess, then a Sobol sequence over the range of the search."""
        from scipy.stats import qmc

        low, high = self.searched
        power = int(np.ceil(np.log2(max(starts - 1, 1))))
        shares = qmc.Sobol(len(self.names), rng=random).random_base2(power)[: starts - 1]
        return [self.first, *(low + shares * (high - low))]

    def of_unknowns(self, shooting: Shooting) -> tuple[tuple[Floats, Floats], Floats]:
        """The limits of all unknowns, and their scale."""
        low, high = self.searched
        positive = [name == "v" and shooting.model.is_impact for name in shooting.model.names]
        least, scales = [], []
        for record, offset in zip(shooting.records, shooting.offsets_free, strict=True):
            count = len(record.segments) - 1
            least += [np.tile(np.append(np.where(positive, 0.0, -np.inf), -np.inf), count), np.full(int(offset), -np.inf)]
            scales += [np.tile(shooting.units.coordinates, count), np.ones(int(offset))]
        others = np.full(shooting.size - len(self.names), np.inf)
        limits = np.concatenate([self.low, *least]), np.concatenate([self.high, others])
        return limits, np.concatenate([high - low, *scales])


def space_of(system: System, free: Sequence[str] | Mapping[str, tuple[float, float]], guess: dict[str, float]) -> Space:
    """The free parameters of a system. ParameterError for unknown names and guesses out of bounds."""
    names = (free,) if isinstance(free, str) else tuple(free)
    system.direction(dict.fromkeys(names, 1.0))
    if not names:
        raise ParameterError(f"no parameter is free; expected: some of {', '.join(system.parameter_names())}")
    others = set(guess) - set(names) - set(system.coordinates)
    for name in others:
        known = (*names, *system.coordinates)
        raise ParameterError(
            f"guess has {name!r}{near_match(name, known)}; expected: free parameters or coordinates, {', '.join(known)}"
        )
    low, high, first = [], [], []
    for name in names:
        lowest, highest = declared_bounds(system, name)
        given = free[name] if isinstance(free, Mapping) and free[name] is not None else (lowest, highest)
        begin = guess.get(name, getattr(system, name))
        try:
            a, b = map(float, given)
            a, b, begin = max(a, lowest), min(b, highest), float(begin)  # in this order NaN remains
        except (TypeError, ValueError):
            a = b = np.nan
        begin = begin if name in guess or not a < b else float(np.clip(begin, a, b))
        if not (a < b and a <= begin <= b):
            raise ParameterError(
                f"{name} has the bounds {given!r} and starts at {begin!r}; expected: (low, high) with low < high within "
                f"{lowest:g} to {highest:g}, and a guess between them"
            )
        low.append(a)
        high.append(b)
        first.append(begin)
    return Space(names, np.array(low), np.array(high), np.array(first), {key: guess[key] for key in guess if key not in names})


def declared_bounds(system: System, name: str) -> tuple[float, float]:
    """The bounds that the class of a system declares for a parameter."""
    low, high = -np.inf, np.inf
    for each in type(system).model_fields[name].metadata:
        low = max(low, *(float(x) for kind in ("ge", "gt") if (x := getattr(each, kind, None)) is not None), -np.inf)
        high = min(high, *(float(x) for kind in ("le", "lt") if (x := getattr(each, kind, None)) is not None), np.inf)
    return low, high
