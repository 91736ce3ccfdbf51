"""Coverage of the intervals of `nsmaps.estimate` on synthetic records: `python docs/benchmarks/estimates.py SYSTEM N [FILE]`.

Each record has the times of the first impacts of a random motion, with walls, and normal noise of 0.1 to 5 % of the standard
deviation of the intervals between impacts. Its number is the seed of its random numbers; with a file, results are appended to it,
and records that it has are not computed again. Printed are the shares of parameters within their intervals of 68.27 and 95.45 %,
with their standard errors as if all were independent.
"""

import json
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import lru_cache
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import nsmaps
from nsmaps.estimation import Record
from nsmaps.estimation.shooting.event_map import EventModel

#: by system: parameters, those that are free, the ranges of a start (without the phase), impacts
CASES: dict[str, Any] = {
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
LEVELS = 0.001, 0.05  #: of the noise
APART = 10.0  #: standard deviations of the noise between impacts, at least, so that their order is that of the motion
ATTEMPTS = 2  #: guesses within 2 % of the truth, until the estimate says that it describes all impacts of a record


@lru_cache
def model_of(name: str) -> EventModel:
    """The model of a case."""
    return EventModel(nsmaps.load_system(name, **CASES[name][0]), ())


def record_of(model: EventModel, ranges: Any, impacts: int, rng: np.random.Generator) -> Record:
    """A record of a random motion that does not end, its noise drawn between the levels."""
    low, high = np.array(ranges).T
    while True:
        start = np.append(rng.uniform(low, high), rng.uniform(0, 2))
        found = model.at([]).events(start[None], np.array([rng.uniform(0, 6)]), impacts)
        times, letters = found.time[0], found.letter[0]
        intervals, level = np.diff(times), np.exp(rng.uniform(*np.log(LEVELS)))
        noise = level * intervals.std()
        if np.isfinite(times).all() and (letters >= 0).all() and intervals.min() > APART * noise:
            phase = (found.states[0, 0, -1] - model.at([]).rate * times[0]) % (2 * np.pi)
            measured = times + noise * rng.standard_normal(impacts)
            return Record.of(measured, [model.letters[k] for k in letters], noise=noise, phase=phase)


def result_of(name: str, number: int) -> dict[str, Any]:
    """What became of one record: parameters in their intervals, shape (P, 2), and deviations in standard errors."""
    parameters, free, ranges, impacts = CASES[name]
    model, rng, begin = model_of(name), np.random.default_rng(number), process_time()
    record, truth = record_of(model, ranges, impacts, rng), np.array([parameters[key] for key in free])
    row: dict[str, Any] = {"record": number, "level": float(record.noise[0] / np.diff(record.times).std())}
    for attempt in range(ATTEMPTS):
        guess = dict(zip(free, truth * (1 + 0.02 * rng.uniform(-1, 1, len(free))), strict=True))
        try:
            found = nsmaps.estimate(model.system, record, free=free, guess=guess, n_guesses=1, n_returns=100, rng=rng)
        except nsmaps.NsmapsError:
            continue
        if found.describes and not found.minima.unpaired[0]:
            inside = (found.intervals[:, :, 0] <= truth[:, None]) & (truth[:, None] <= found.intervals[:, :, 1])
            row |= {"inside": inside.tolist(), "errors": ((found.values - truth) / found.errors).tolist()}
            row |= {"profiled": found.profiled.tolist(), "attempt": attempt, "chi2": found.chi2, "dof": found.dof}
            break
    return row | {"seconds": process_time() - begin}


def coverage(rows: Iterable[dict[str, Any]]) -> str:
    """The shares within both intervals, and the records left out, in words."""
    rows = list(rows)
    inside = np.array([row["inside"] for row in rows if "inside" in row]).reshape(-1, 2)
    share = inside.mean(axis=0)
    (one, two), (e, f) = share, np.sqrt(share * (1 - share) / max(len(inside), 1))
    known = sum("inside" in row for row in rows)
    seconds = np.mean([row["seconds"] for row in rows])
    text = f"{known} records, {len(rows) - known} left out, within {one:.4f} +- {e:.4f} and {two:.4f} +- {f:.4f}"
    return f"{text}, {seconds:.2f} s of processor time each"


def main(name: str, count: int, file: str = "") -> None:
    """Compute what is missing, on all cores, and print the coverage from time to time."""
    path = Path(file) if file else None
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path and path.exists() else []
    missing = sorted(set(range(count)) - {row["record"] for row in rows})
    with ProcessPoolExecutor() as pool:
        for done in as_completed([pool.submit(result_of, name, number) for number in missing]):
            row = done.result()
            rows.append(row)
            if path:
                with path.open("a") as lines:
                    lines.write(json.dumps(row) + "\n")
            if len(rows) % 50 == 0:
                print(f"{name}: {coverage(rows)}", flush=True)
    print(f"{name}: {coverage(row for row in rows if row['record'] < count)}")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), *sys.argv[3:])
