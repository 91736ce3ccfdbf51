"""The restitution of a ball from the times of its bounces on a floor: `python docs/benchmarks/bounces.py FILE`.

The file has a column `time` in milliseconds, as `data/30 bounces.csv` of https://github.com/eepsmedia/ping-pong-bounce, under the
MIT licence. Printed are the estimate, and least squares of the closed form t_0 + T (1 - r^k) / (1 - r) of the times.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import curve_fit

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.arrays import Floats
from nsmaps.estimation import Record


class Ball(HybridSystem):
    """A ball that falls at 9.81 m/s^2 and leaves the floor with a share of its speed."""

    r: float = 0.9

    states = ("x", "v")

    def modes(self, t: Any, y: Any) -> Any:
        return {"flight": {"x": y.v, "v": -9.81}}

    def guards(self, t: Any, y: Any) -> Any:
        return {"F": Guard("flight", y.x, reset={"v": -self.r * y.v})}

    def section(self, t: Any, y: Any) -> PoincareSection:
        return PoincareSection("F", ("v",))


def closed_form(k: Floats, begin: float, first: float, r: float) -> Floats:
    """The time of bounce k, where the first flight takes the time `first`."""
    return begin + first * (1 - r**k) / (1 - r)


def main(file: str) -> None:
    """Print both."""
    times = np.genfromtxt(Path(file), delimiter=",", names=True)["time"]
    record = Record.of(times, "F" * len(times), time_unit=1000.0)
    speed = -9.81 * (times[1] - times[0]) / 2000
    found = nsmaps.estimate(Ball(), record, free={"r": (0.5, 1.0)}, guess={"v": speed}, n_guesses=1)
    print(found)
    fit, covariance = curve_fit(closed_form, np.arange(float(len(times))), times, p0=(times[0], times[1] - times[0], 0.9))
    print(f"closed form: r = {fit[-1]:.6f} +- {np.sqrt(covariance[-1, -1]):.6f}")
    print("deviations from it, ms:", np.array2string(times - closed_form(np.arange(float(len(times))), *fit), precision=1))


if __name__ == "__main__":
    main(sys.argv[1])
