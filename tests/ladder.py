"""Orbits of the exact map from random states of certified cells: each impact is in the same cell or one of a lower order.

`python tests/ladder.py FILE [STATES]` takes 10^6 states unless given, on all walls of the VI pair, and prints how many disagree
with the certificate: a test of honesty, not of proof.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

import nsmaps
from nsmaps.cells.certified import Orders
from nsmaps.exact.engine.observers import Track, trajectory
from nsmaps.exact.engine.returns import Impact
from nsmaps.verify.arrivals import LEFT
from nsmaps.verify.certificate import read

IMPACTS = 80  #: followed of an orbit
CHUNK = 10_000


class Ladder(NamedTuple):
    """What orbits did."""

    states: int
    impacts: int = 0  #: until orbits come to a cell of order zero
    wrong: int = 0  #: impacts in a cell of no order or of a higher one than before, or of the same order in another cell
    lost: int = 0  #: orbits that did not come to a cell of order zero
    longest: int = 0  #: impacts until then, at most
    ends: np.ndarray = np.zeros((0, 2))  #: speeds and phases there


def ladder(system, orders, states, rng):
    """Follow orbits from random states, uniform in the cells of all walls with an order above zero."""
    found = Ladder(0)
    while found.states < states:
        wall = rng.integers(len(orders.letters), size=CHUNK)
        phase, speed = rng.uniform(0, 2 * np.pi, CHUNK), rng.uniform(0, orders.tree.top, CHUNK)
        order = orders.orders(orders.cells(wall, phase, speed))
        some = np.flatnonzero((order > 0) & (order < LEFT))[: states - found.states]
        each = followed(system, orders, wall[some], phase[some], speed[some])
        numbers = [getattr(found, name) + getattr(each, name) for name in ("states", "impacts", "wrong", "lost")]
        found = Ladder(*numbers, max(found.longest, each.longest), np.concatenate([found.ends, each.ends]))
    return found


def followed(system, orders, wall, phase, speed):
    """Follow orbits from states of cells with an order."""
    kernel, base = system._kernel(), orders.letters.index(system.letters[0])
    on_base, marks = np.empty((2, len(wall), IMPACTS), np.int8)
    times, phases, speeds = np.full((3, len(wall), IMPACTS), np.nan)  # an orbit that ends is in no cell then
    for i in range(len(wall)):
        up = kernel.base_up == (wall[i] == base)
        track = Track(on_base[i], times[i], phases[i], speeds[i], marks[i])
        trajectory(kernel.flow, Impact(up, phase[i], speed[i]), 1e-12, track)
    cells = orders.cells(np.where(on_base, base, 1 - base), phases, speeds)
    order = orders.orders(cells)
    length = np.where((order == 0).any(axis=1), (order == 0).argmax(axis=1), IMPACTS - 1)
    falls = (order[:, 1:] < order[:, :-1]) | (cells[:, 1:] == cells[:, :-1])
    wrong = ~falls & (np.arange(IMPACTS - 1) < length[:, None])
    last = np.arange(len(wall)), length
    ends = np.stack([speeds[last], phases[last]], axis=1)
    return Ladder(len(wall), int(length.sum()), int(wrong.sum()), int((order[last] > 0).sum()), int(length.max()), ends)


if __name__ == "__main__":
    certificate = read(Path(sys.argv[1]))
    numbers = certificate.about["system"].partition("(")[2].rstrip(")")
    given = {name: float(value) for name, _, value in (part.strip().partition("=") for part in numbers.split(","))}
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 10**6
    done = ladder(nsmaps.load_system("vi_pair", **given), Orders.of(certificate), count, np.random.default_rng(1))
    print(*(f"{name}: {value:,}" for name, value in done._asdict().items() if name != "ends"), sep="\n")
