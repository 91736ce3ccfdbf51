"""Nonlinear modes against heyoka, `python docs/benchmarks/nonlinear.py [TURNS]`: first returns, also with derivatives.

Both take the same first returns from states that motions come to, in turns within one run on one core; the time of each is the
processor time of its shortest turn. heyoka has one integrator to the precision of doubles with events that end a step, whose
callbacks write the states just after an event. Beside derivatives it has those of flights alone: it neither carries them through
events nor multiplies them.
"""

import sys
from pathlib import Path

import numpy as np
from nsmaps_hopper import Hopper
from nsmaps_neuron import Neuron
from nsmaps_relief_valve import ReliefValve

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from modes import peer, turn
from modes_peers import Heyoka, Written

COUNT, SETTLED = 2_000, 20  # returns a turn; returns before states are taken
CASES = {  #: each with two states, between which motions begin
    "hopper": (Hopper(), ([0.93], [1.2])),
    "relief_valve": (ReliefValve(q=4.0), ([-6.0, 10.0], [-1.0, 25.0])),
    "neuron": (Neuron(), ([-12.0], [10.0])),
}


def ours(made, derivative):
    """nsmaps, on one core, as long as the returns are no more than one thread takes at a time."""

    def run(starts):
        return made.first_return(starts, derivative=derivative).image

    return run


def race(made, starts, derivative, turns):
    """Microseconds per return of nsmaps and of heyoka, and the largest difference of their images."""
    entries = {"nsmaps": ours(made, derivative), "heyoka": peer(made, Heyoka(Written(made), 1.0, variations=derivative))}
    off = np.abs(entries["heyoka"](starts)()[0] - entries["nsmaps"](starts)).max()
    best = dict.fromkeys(entries, np.inf)
    for _ in range(turns):
        for who, run in entries.items():
            best[who] = min(best[who], 1e6 * turn(who, run, starts))
    return best["nsmaps"], best["heyoka"], off


def main(turns):
    """Print the table."""
    print("| system | derivative | nsmaps, µs per return | heyoka | ratio | images differ by |\n|---|---|---:|---:|---:|---:|")
    for name, (made, (low, high)) in CASES.items():
        starts = np.random.default_rng(1).uniform(low, high, (COUNT, len(low)))
        for _ in range(SETTLED):
            found = made.first_return(starts)
            starts = found.image[found.valid]
        for derivative in (False, True):
            one, other, off = race(made, starts, derivative, turns)
            print(
                f"| `{name}` | {'yes' if derivative else 'no'} | {one:.3g} | {other:.3g} | {one / other:.2f} | {off:.1e} |",
                flush=True,
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
