"""How long orbits under noise stay in which motion, and how often they change over."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nsmaps.arrays import ArrayLike, Floats
from nsmaps.errors import NsmapsError


@dataclass(frozen=True, slots=True, eq=False)
class Residence:
    """Residence in M motions, over all realisations, in the system's time."""

    modes: tuple[str, ...]
    hold: int  #: successive returns with the words of a motion that bring an orbit into it
    time: Floats  #: shape (M,), spent in each motion
    unknown: float  #: time spent before the first motion was there
    switches: NDArray[np.int64]  #: shape (M, M), changes from one motion (row) to another (column)

    @property
    def share(self) -> Floats:
        """Of the time in any of the motions, shape (M,); NaN without any."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.time / self.time.sum())

    @property
    def rates(self) -> Floats:
        """Changes a unit of time spent in the first motion, shape (M, M); NaN of a motion that was never there."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.switches / self.time[:, None])

    @property
    def rates_error(self) -> Floats:
        """Their standard errors, shape (M, M), as if changes were independent: rate/sqrt(changes); of none one change's rate."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.sqrt(np.maximum(self.switches, 1)) / self.time[:, None])

    @property
    def mean(self) -> Floats:
        """Mean residence, shape (M,): time spent over changes away, which counts stays that were cut off rightly; inf of none."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.time / self.switches.sum(axis=1))


def residence(words: ArrayLike, time: ArrayLike, modes: Mapping[str, Sequence[str]], hold: int = 12) -> Residence:
    """The residence of orbits in motions that are told by their words.

    An orbit enters a motion with the first of `hold` successive returns whose words go round those of the motion, wherever they
    begin, and stays until it enters another: what does not last that long belongs to the motion before. A `hold` that is short
    takes chance runs for a motion, a long one passes over short stays: rates that change with it say so.

    Args:
        words: of n successive returns of R orbits, shape (n, R); "" after an orbit's end.
        time: of each return, shape (n, R).
        modes: the words of one period of each motion, such as {"1:1": ["BTB"], "2:1": ["BB", "BTB"]}.

    Raises:
        NsmapsError: a motion without words, or a hold shorter than the longest.
    """
    spelt, spent = np.asarray(words, str), np.asarray(time, float)
    longest = max((len(cycle) for cycle in modes.values()), default=0)
    if not all(modes.values()) or hold < max(longest, 1) or spelt.shape != spent.shape or spelt.ndim != 2:
        raise NsmapsError(
            f"motions {dict(modes)}, hold {hold}, words {spelt.shape} with times {spent.shape}; expected: one or more words "
            "each, held for at least as many returns, and both tables of shape (n, R)"
        )
    now = np.full(spelt.shape, -1)
    for mode, cycle in enumerate(modes.values()):
        for turn in range(len(cycle)):
            expected = np.resize(np.roll(cycle, turn), len(spelt))
            _mark(now, spelt == expected[:, None], mode, hold)
    for k in range(1, len(now)):
        now[k] = np.where(now[k] < 0, now[k - 1], now[k])
    alive = np.isfinite(spent)
    total = np.array([spent[alive & (now == mode)].sum() for mode in range(len(modes))])
    switches = np.zeros((len(modes), len(modes)), np.int64)
    changed = (now[1:] != now[:-1]) & (now[:-1] >= 0) & alive[1:]
    np.add.at(switches, (now[:-1][changed], now[1:][changed]), 1)
    return Residence(tuple(modes), hold, total, float(spent[alive & (now < 0)].sum()), switches)


def _mark(now: NDArray[np.int64], fits: NDArray[np.bool_], mode: int, hold: int) -> None:
    """Write the mode wherever at least `hold` successive returns fit, in place."""
    run = np.zeros(now.shape[1], np.int64)
    for k in range(len(now)):
        run = np.where(fits[k], run + 1, 0)
        now[k][run > hold] = mode
        for column in np.flatnonzero(run == hold).tolist():
            now[k - hold + 1 : k + 1, column] = mode
