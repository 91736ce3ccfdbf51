"""Systems with modes against others, `python docs/benchmarks/modes.py [TURNS]`: heyoka, SciPy, a C loop of the recoil pair.

All take the same first returns from random states, in turns within one run on one core; the time of each is the processor time of
its shortest turn. Errors are the largest of any coordinate at the random starts of the references of 40 digits, where words are
compared too. Install heyoka beside nsmaps first; gcc compiles the loops of `recoil.c`.
"""

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from hybrid import SYSTEMS, numbers, reference, system, word
from modes_peers import LANES, Heyoka, SciPy, Written
from words import Plain, begun

COUNT, FEW = 5_000, 20  # returns a turn; of slow programs
CASES = (("S1_recoil", "p2"), ("S2_bilinear", "w085"), ("S3_stickslip", "A025"), ("S5_buck", "E26"))
FLIGHTS = {"S3_stickslip": ([0.2, -0.3, 0.0], [1.0, 0.3, 6.28])}  #: between which motions begin where no box fits in a section
SOURCE, FLAGS = Path(__file__).with_name("recoil.c"), ("-O3", "-march=native")


def loop(made, *more):
    """The C loop with these definitions, compiled for the recoil pair."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        out = str(Path(folder, "recoil.so"))
        subprocess.run(["gcc", *FLAGS, *more, "-shared", "-fPIC", "-o", out, str(SOURCE), "-lm"], check=True)
        library = ctypes.CDLL(out)
    doubles, tops = (np.ctypeslib.ndpointer(kind, flags="C") for kind in (np.float64, np.int8))
    library.first_returns.argtypes = [*[ctypes.c_double] * 6, ctypes.c_long, doubles, doubles, tops]
    given = [getattr(made, name) for name in ("kappa", "Lambda", "d", "r", "g_bar", "eta")]

    def run(starts):
        image, count = np.empty_like(starts), np.empty(len(starts), np.int8)
        library.first_returns(*given, len(starts), np.ascontiguousarray(starts), image, count)
        return lambda: (image, [f"B{'T' * k}B" for k in count.tolist()])

    return run


def ours(made):
    """nsmaps, on one core, as long as the returns are no more than one thread takes at a time."""

    def run(starts):
        returns = made.first_return(starts)
        return lambda: (returns.image, returns.words.tolist())

    return run


def peer(made, solver):
    """Another program, from just after the section's event."""
    plain = Plain(made)

    def ready(starts):
        t, y, mode, letters = begun(plain, made, starts)

        def run():
            found, words = solver(t, y, mode)
            places = [
                found[1 + made.states.index(c)] if c in made.states else found[0] * made.phase_rate() for c in made.coordinates
            ]
            return np.transpose(places), [a + b for a, b in zip(letters, words, strict=True)]

        return run

    return ready


def programs(name, made):
    """The programs by their names, each with the number of returns that it takes in a turn."""
    written = Written(made)
    unit = 1 / made.phase_rate() if made.phase_rate() else float(made._kernel().table.steps.min())
    given = {"nsmaps": (COUNT, ours(made))}
    if name == "S1_recoil":
        given |= {"C loop plain": (COUNT, loop(made, "-DPLAIN")), "C loop tuned": (COUNT, loop(made))}
    return given | {
        "heyoka": (COUNT // 5, peer(made, Heyoka(written, unit))),
        f"heyoka, {LANES} side by side": (COUNT // 5, peer(made, Heyoka(written, unit, LANES))),
        "SciPy DOP853 1e-12": (FEW, peer(made, SciPy(written))),
    }


def turn(name, run, starts):
    """The processor time of one turn, a return."""
    if name.startswith(("heyoka", "SciPy")):
        run = run(starts)
        begin = process_time()
        run()
    else:
        begin = process_time()
        run(starts)
    return (process_time() - begin) / len(starts)


def errors(name, key, made, run):
    """The largest difference from the references, and the number of words that differ."""
    rows = [row for row in reference(name)["returns"] if row["params"] == key and row["kind"] == "random" and row["image"]]
    image, words = run(np.array([numbers(row["start"]) for row in rows]))()
    off = np.abs(made.coordinates.difference(image, np.array([numbers(row["image"]) for row in rows])))
    return off.max(), sum(word(name, a) != row["word"] for a, row in zip(words, rows, strict=True))


def race(name, key, turns):
    """One system: its lines of the table."""
    given = reference(name)
    made = system(name, given["parameters"][key])
    rows = np.array([numbers(row["start"]) for row in given["returns"] if row["params"] == key])
    low, high = FLIGHTS.get(name, (rows.min(axis=0), rows.max(axis=0)))
    states = np.random.default_rng(1).uniform(low, high, (2 * COUNT, len(low)))
    images = (made.arrivals if name in FLIGHTS else made.first_return)(states).image
    starts = made.first_return(images)
    starts = starts.start[starts.valid & (starts.time < np.quantile(starts.time[starts.valid], 0.999))][:COUNT]
    entries = programs(name, made)
    found = {who: errors(name, key, made, run) for who, (_, run) in entries.items()}
    best = dict.fromkeys(entries, np.inf)
    for k in range(turns):
        for who, (count, run) in entries.items():
            if k < 3 or not who.startswith("SciPy"):
                best[who] = min(best[who], turn(who, run, starts[:count]))
    for who, (worst, wrong) in found.items():
        ratio = best[who] / best["nsmaps"]
        label = SYSTEMS[name].__module__.split(".")[0][7:]
        yield f"| `{label}` | {who} | {1e6 * best[who]:.3g} | {ratio:.3g} | {worst:.1e} | {wrong} |"


def main(turns):
    print("| system | program | µs per return | time / nsmaps | worst error | wrong words |\n|---|---|---:|---:|---:|---:|")
    for name, key in CASES:
        for line in race(name, key, turns):
            print(line, flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
