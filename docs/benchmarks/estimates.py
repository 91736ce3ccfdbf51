"""Coverage of the intervals of `nsmaps.estimate` on synthetic records: `python docs/benchmarks/estimates.py vi_pair 1000`.

Each record has the times of the first impacts of a random motion, with walls, and normal noise of 0.1 to 5 % of the standard
deviation of the intervals between impacts. Printed are the shares of parameters within their intervals of 68.27 and 95.45 %.
"""

import sys

import numpy as np

import nsmaps
from nsmaps.estimation import Record
from nsmaps.estimation.shooting.event_map import EventModel

#: by system: parameters, those that are free, the ranges of a start (without the phase), impacts
CASES = {
    "vi_pair": ({"d": 0.35, "r": 0.5, "g_bar": 0.2113}, ("r", "d"), [(0.3, 1.2)], 30),
    "impact_oscillator": ({"zeta": 0.05, "w": 0.9, "A": 0.8, "wall": 1.0, "r": 0.8}, ("r", "zeta"), [(0.3, 2.0)], 25),
    "recoil_pair": (
        {"eta": 0.05, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113},
        ("r", "d"),
        [(0.5, 1.2), (0.0, 0.2), (-0.8, -0.5)],
        30,
    ),
    "duffing": ({"c": 0.1, "a": -1, "b": 1, "f": 0.7, "w": 1.2, "d": 0.9, "r": 0.8}, ("r", "f"), [(0.5, 2.0)], 20),
}
LEVELS = 0.001, 0.05


def record_of(model, system, ranges, impacts, rng):
    """A record of a random motion, its noise drawn between the levels; None if the motion ends."""
    low, high = np.array(ranges).T
    start = np.append(rng.uniform(low, high), rng.uniform(0, 2))
    found = model.at([]).events(start[None], np.array([rng.uniform(0, 6)]), impacts)
    times, letters = found.time[0], found.letter[0]
    phase = (found.states[0, 0, -1] - model.at([]).rate * times[0]) % (2 * np.pi)
    intervals = np.diff(times)
    if np.isnan(times).any() or (letters < 0).any() or intervals.min() < 0.02 * intervals.mean():
        return None
    noise = intervals.std() * np.exp(rng.uniform(*np.log(LEVELS)))
    measured = times + noise * rng.standard_normal(impacts)
    if (np.diff(measured) <= 0).any():
        return None
    return Record.of(measured, [model.letters[k] for k in letters], noise=noise, phase=phase)


def coverage(name, count, seed=0):
    """The shares within both intervals, shape (2,), of `count` records, and the number of those that were left out."""
    parameters, free, ranges, impacts = CASES[name]
    system, rng = nsmaps.load_system(name, **parameters), np.random.default_rng(seed)
    model, truth = EventModel(system, ()), np.array([parameters[key] for key in free])
    inside, lost = [], 0
    while len(inside) + lost < count:
        record = record_of(model, system, ranges, impacts, rng)
        if record is None:
            continue
        guess = dict(zip(free, truth * (1 + 0.02 * rng.uniform(-1, 1, len(free))), strict=True))
        try:
            found = nsmaps.estimate(system, record, free=free, start=guess, n_starts=1, n_returns=100, rng=rng)
        except nsmaps.NsmapsError:
            lost += 1
            continue
        if not found.describes or found.minima.unpaired[0]:
            lost += 1
            continue
        inside.append((found.intervals[:, :, 0] <= truth[:, None]) & (truth[:, None] <= found.intervals[:, :, 1]))
        if (len(inside) + lost) % 10 == 0:
            shares = np.mean(inside, axis=(0, 1))
            print(f"{name}: {len(inside)} records, {lost} left out, within {shares[0]:.4f} and {shares[1]:.4f}", flush=True)
    return np.mean(inside, axis=(0, 1)), lost


if __name__ == "__main__":
    print(coverage(sys.argv[1], int(sys.argv[2])))
