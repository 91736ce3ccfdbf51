"""Boxes under impacts of the bouncing ball against Ariadne: `python docs/benchmarks/boxes.py FOLDER [TURNS]`.

FOLDER has Ariadne's `source` and `submodules`, and its library in `build`. Boxes about states of an orbit are enclosed after one
impact and more: by Ariadne as sets of Taylor models, errors of at most 1e-4 half^2 a step; by `image_boxes` return by return, a
box as one or in CELLS x CELLS cells. Widths are relative to those of the images of a grid of states, which are at most the true
ones. Random states, followed in 30 digits, must lie in all enclosures. Times are processor time a box of the shortest of some
turns, of nsmaps in one batch of all boxes.
"""

import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import mpmath as mp
import numpy as np

import nsmaps

GAMMA, R = 1.75, 0.5
COUNT, IMPACTS, CELLS = 3, 3, 32
POINTS, GRID = 3, 33  #: random states of a box, and states of a grid along a side
HALVES = (2.0**-7, 2.0**-9, 2.0**-11)  #: half a side of a box, in speed and phase


def boxes(system, half):
    """Boxes (COUNT, 2, 2) about states of an orbit, centres rounded so that all ends are exact."""
    centre = np.round(nsmaps.orbit(system, [4.25, 0.5], 20 * COUNT).states[20::20] * 2**10) / 2**10
    return np.stack([centre - half, centre + half], axis=2)


def divided(given, parts):
    """All cells of boxes, (N parts^2, 2, 2)."""
    low, side = given[..., 0], np.ptp(given, axis=2) / parts
    at = np.stack(np.meshgrid(*[np.arange(parts)] * 2, indexing="ij"), axis=-1).reshape(1, -1, 2)
    return np.stack([low[:, None] + at * side[:, None], low[:, None] + (at + 1) * side[:, None]], axis=3).reshape(-1, 2, 2)


def hulls(found, count):
    """The hulls (count, 2, 2) of as many equal runs of boxes."""
    found = found.reshape(count, -1, 2, 2)
    return np.stack([found[..., 0].min(axis=1), found[..., 1].max(axis=1)], axis=2)


def ours(system, given, parts):
    """The hulls (IMPACTS, N, 2, 2) of boxes after each impact, and seconds a box up to each."""
    cells, ends, times, spent = divided(given, parts), [], [], 0.0
    for _ in range(IMPACTS):
        begin = process_time()
        cells = system.image_boxes(cells).hulls()
        spent += process_time() - begin
        ends.append(hulls(cells, len(given)))
        times.append(spent / len(given))
    return np.array(ends), np.array(times)


def ariadne(folder, accuracy, turns, given):
    """The hulls (2, IMPACTS, N, 2, 2) of boxes after each impact, of whole sets and of parts, and seconds a box."""
    with tempfile.TemporaryDirectory() as place:
        paths = [f"-I{folder}/source", f"-I{folder}/submodules/.symbolic", f"-L{folder}/build", f"-Wl,-rpath,{folder}/build"]
        flags = ["-std=c++20", "-O2", "-w", "-frounding-math"]
        made = [str(Path(__file__).with_suffix(".cpp")), "-lariadne", "-lmpfr", "-lgmp", "-o", f"{place}/boxes"]
        subprocess.run(["g++", *flags, *paths, *made], check=True)
        lines = "\n".join(" ".join(map(repr, box.ravel().tolist())) for box in given)
        told = [f"{place}/boxes", repr(accuracy), str(IMPACTS), str(turns)]
        out = subprocess.run(told, input=lines, text=True, check=True, stdout=subprocess.PIPE).stdout
    table = np.array([line.split()[-9:] for line in out.splitlines() if line[:1].isdigit()], float).reshape(-1, IMPACTS, 9)
    return np.moveaxis(table[..., :8].reshape(-1, IMPACTS, 2, 2, 2), (2, 1), (0, 1)), table[..., 8].mean(axis=0)


def exact(v, phi):
    """The next impact in 30 digits: the first change of sign of the gap on a fine grid of times, then Newton's method."""
    w, lift = mp.mpf(R) * v, mp.mpf(GAMMA)
    gap = lambda t: t * (w + lift * mp.cos(phi)) - t**2 / 2 - lift * (mp.sin(phi + t) - mp.sin(phi))  # noqa: E731
    rate = lambda t: w + lift * mp.cos(phi) - t - lift * mp.cos(phi + t)  # noqa: E731
    times = np.arange(1, 100_000) * 1e-4
    slope, p = float(w + lift * mp.cos(phi)), float(phi)
    first = times[np.argmax(times * slope - times**2 / 2 - GAMMA * (np.sin(p + times) - np.sin(p)) < 0)]
    t = mp.findroot(gap, first, df=rate, solver="newton")
    return -rate(t), phi + t


def checked(given, found):
    """Whether random states of the boxes lie in all enclosures, each (IMPACTS, N, 2, 2), after every impact."""
    random = np.random.default_rng(0)
    for n, box in enumerate(given):
        for _ in range(POINTS):
            state = [mp.mpf(x) for x in random.uniform(*box.T)]
            for k in range(IMPACTS):
                state = exact(*state)
                for ends in found:
                    inside = [low <= x <= high for x, (low, high) in zip(state, ends[k, n].tolist(), strict=True)]
                    assert all(inside), (given, k, state, ends[k, n])


def sampled(system, given):
    """The sides (IMPACTS, N, 2) of the hulls of images of a grid of states."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, GRID)] * 2), axis=-1).reshape(1, -1, 2)
    states, sides = (given[:, None, :, 0] + grid * np.ptp(given, axis=2)[:, None]).reshape(-1, 2), []
    for _ in range(IMPACTS):
        states = system.first_return(states).lifted
        sides.append(np.ptp(states.reshape(len(given), -1, 2), axis=1))
    return np.array(sides)


def main(folder, turns=2):
    """Print the table."""
    mp.mp.dps = 30
    system = nsmaps.load_system("bouncing_ball", Gamma=GAMMA, r=R)
    print("| half a side | impacts | Ariadne: width | of parts | s | nsmaps: width | time | in cells: width | time |")
    print("|---|---|---:|---:|---:|---:|---:|---:|---:|")
    for half in HALVES:
        given = boxes(system, half)
        theirs, seconds = ariadne(folder, 1e-4 * half**2, turns, given)
        runs = [[ours(system, given, parts) for _ in range(1 + 3 * turns)] for parts in (1, CELLS)]
        checked(given, [*theirs, *(found[0][0] for found in runs)])
        true = sampled(system, given)
        for k in range(IMPACTS):
            line = [f"{half:.2g}", str(k + 1), *(width(ends[k], true[k]) for ends in theirs), f"{seconds[k]:.3g}"]
            for found in runs:
                line += [width(found[0][0][k], true[k]), f"1/{seconds[k] / min(times[k] for _, times in found):.2g}"]
            print("|", " | ".join(line), "|", flush=True)


def width(ends, true):
    """The median over boxes of the larger ratio of a side to the true one."""
    return f"{np.median((np.ptp(ends, axis=2) / true).max(axis=1)):.3f}"


if __name__ == "__main__":
    main(sys.argv[1], *map(int, sys.argv[2:]))
