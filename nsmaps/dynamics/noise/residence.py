"""Residence times of orbits under noise in motions, and the rates of changes between motions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.dynamics.noise.law import Noise
from nsmaps.errors import NsmapsError
from nsmaps.results import NONE, TIME, Result, array, array_property, shares_text

if TYPE_CHECKING:
    from nsmaps.dynamics.noise.impacts import ImpactDiagram


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Residence(Result):
    """Residence in M motions, over all realisations, in the system's time."""

    modes: tuple[str, ...]
    min_returns: int  #: successive returns with the words of a motion after which an orbit is in it
    time: Floats = field(metadata=array("mode", "spent in each motion", TIME))
    unknown: float  #: time before the first motion was reached
    switches: NDArray[np.int64] = field(metadata=array("mode next_mode", "changes from one motion to another", NONE))

    def summary(self) -> str:
        """The numbers that matter."""
        total = self.time.sum() or 1.0
        return f"{shares_text(self.modes, self.time / total)}; {int(self.switches.sum())} transitions"

    @property
    def share(self) -> Floats:
        """The share of each motion in the time spent in any of them, shape (M,); NaN if there is none."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.time / self.time.sum())

    @property
    def rates(self) -> Floats:
        """Changes per unit of time spent in the first motion, shape (M, M); NaN for a motion that never occurred."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.switches / self.time[:, None])

    @property
    def rates_error(self) -> Floats:
        """Standard errors of the rates, shape (M, M), as if changes were independent: sqrt(max(changes, 1))/time."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.sqrt(np.maximum(self.switches, 1)) / self.time[:, None])

    @property
    def mean(self) -> Floats:
        """Mean residence, shape (M,), inf without changes: time spent over changes away, which accounts for stays cut off."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.time / self.switches.sum(axis=1))


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class NoiseResult(Result):
    """Residence and impacts under noise of each amplitude."""

    picture: ClassVar[str] = "nsmaps.figures.longrun.noise"

    noise: tuple[Noise, ...]  #: one per amplitude, otherwise alike
    stays: tuple[Residence, ...]  #: one per amplitude
    ended: tuple[dict[str, int], ...]  #: per amplitude: number of realisations that ended, by outcome
    impacts: "tuple[ImpactDiagram, ...]" = ()  #: descending without and with noise, ascending without and with noise
    counted: tuple[Residence, ...] = ()  #: as `stays`, with the return as the unit of time, where it is compared with
    reduced: tuple[Residence, ...] = ()  #: that of the composite map under kicks, see `KickedMap`; none if not in the study
    units: Mapping[str, str] = field(default_factory=dict)  #: of the coordinates and the parameter, by name

    def summary(self) -> str:
        """The numbers that matter."""
        rows = zip(self.noise, self.stays, strict=True)
        return "; ".join(f"sigma = {noise.sigma:g}: {stay}" for noise, stay in rows)

    @array_property("amplitude", "standard deviations of the noise")
    def sigma(self) -> Floats:
        """The amplitudes, in the order of `noise`."""
        return np.array([each.sigma for each in self.noise])

    @property
    def in_returns(self) -> bool:
        """Whether residence that is shown is in returns: of two maps, and of noise on images."""
        return bool(self.reduced) or self.noise[0].tau is None


def residence(words: ArrayLike, time: ArrayLike, modes: Mapping[str, Sequence[str]], min_returns: int = 12) -> Residence:
    """The residence of orbits in motions that are identified by their words.

    An orbit enters a motion with the first of `min_returns` successive returns whose words are a cyclic permutation of those
    of the motion, and stays until it enters another: a shorter episode belongs to the previous motion. A small `min_returns`
    counts chance sequences as a motion, a large one misses short stays; rates should not depend on it.

    Args:
        words: of n successive returns of R orbits, shape (n, R); "" after an orbit's end.
        time: of each return, shape (n, R).
        modes: the words of one period of each motion, such as {"1:1": ["BTB"], "2:1": ["BB", "BTB"]}.

    Raises:
        NsmapsError: a motion without words, or `min_returns` less than the longest period.
    """
    spelt, spent = np.asarray(words, str), np.asarray(time, float)
    max_period = max((len(cycle) for cycle in modes.values()), default=0)
    if not all(modes.values()) or min_returns < max(max_period, 1) or spelt.shape != spent.shape or spelt.ndim != 2:
        raise NsmapsError(
            f"motions {dict(modes)}, min_returns {min_returns}, words {spelt.shape}, times {spent.shape}; expected: one or more "
            "words each, as many returns, and tables of shape (n, R)"
        )
    now = np.full(spelt.shape, -1)
    for mode, cycle in enumerate(modes.values()):
        for turn in range(len(cycle)):
            expected = np.resize(np.roll(cycle, turn), len(spelt))
            _mark(now, spelt == expected[:, None], mode, min_returns)
    for k in range(1, len(now)):
        now[k] = np.where(now[k] < 0, now[k - 1], now[k])
    alive = np.isfinite(spent)
    total = np.array([spent[alive & (now == mode)].sum() for mode in range(len(modes))])
    switches = np.zeros((len(modes), len(modes)), np.int64)
    changed = (now[1:] != now[:-1]) & (now[:-1] >= 0) & alive[1:]
    np.add.at(switches, (now[:-1][changed], now[1:][changed]), 1)
    return Residence(tuple(modes), min_returns, total, float(spent[alive & (now < 0)].sum()), switches)


def _mark(now: NDArray[np.int64], fits: NDArray[np.bool_], mode: int, min_returns: int) -> None:
    """Write the mode wherever at least `min_returns` successive returns fit, in place."""
    run = np.zeros(now.shape[1], np.int64)
    for k in range(len(now)):
        run = np.where(fits[k], run + 1, 0)
        now[k][run > min_returns] = mode
        for column in np.flatnonzero(run == min_returns).tolist():
            now[k - min_returns + 1 : k + 1, column] = mode
