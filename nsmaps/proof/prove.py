"""A certificate of attraction: a trap around a stable cycle, or a closed set, and cells from which all orbits come to it."""

import math
import signal
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from nsmaps.dynamics.periodic import periodic_orbit
from nsmaps.errors import ProofError
from nsmaps.progress import Progress, beat, shows
from nsmaps.proof.cells import FINEST, base_grids, codes_of, search
from nsmaps.proof.closed import Around, closed_around
from nsmaps.proof.cycles import stated
from nsmaps.proof.formula import balls_of, equation_of, flow_of
from nsmaps.proof.trap import found_trap, trapped
from nsmaps.verify.certificate import Certificate
from nsmaps.verify.formula import in_units

if TYPE_CHECKING:
    from nsmaps.coordinates import StateLike
    from nsmaps.exact.systems.system import ImpactSystem

BITS = 10  #: of the speed at the upper edge in its unit, behind the binary point


@shows
def prove(
    system: "ImpactSystem",
    start: "StateLike",
    period: int = 1,
    *,
    top: float,
    side: int = 128,
    depth: int = 4,
    n_cuts: int = 0,
    max_periods: int = 4,
    around: Around | None = None,
    radii: Mapping[str, float] | None = None,
    cycles: Sequence[tuple["StateLike", int]] = (),
    progress: Progress | None = None,
) -> Certificate:
    """Search for a proof that orbits of the exact map converge to a stable cycle, or arrive in a closed set around an attractor.

    The search works in floats, and proves nothing: `nsmaps.verify` does. Ctrl-C ends it after the division that is under way, and
    what was found is kept; pressed twice it ends at once.

    Args:
        system: with flights of a linear equation under a harmonic force, and a constant restitution.
        start: a state near the cycle, as of `periodic_orbit`, or whose orbit comes to the attractor.
        period: of the cycle, in returns.
        top: impact speed up to which states are considered, on each wall.
        side: number of cells along phase and speed before any is divided, a power of two.
        depth: how often cells that are left are divided into four.
        n_cuts: how often those that are still left are then cut into two strips along the stable sets of saddles.
        max_periods: of the forcing, the longest flight that is followed.
        around: the closed set to be found; None for convergence to the cycle.
        radii: of parameters by name on which walls alone depend: the proof is for all their values within.
        cycles: states near cycles, with their periods, that are to be proved to exist.
        progress: called now and then with the fraction of the divisions that is done.

    Raises:
        ProofError: the system is of another kind, the cycle is not stable, no trap or closed set is found, or one of `cycles` is
            not proved.
    """
    _check(side, depth, n_cuts, max_periods, top)
    equation = equation_of(system, radii)
    letters = [wall["letter"] for wall in equation["walls"]]
    balls = balls_of(equation)
    scaled, unit = in_units(balls, top)
    top = math.ceil(top / unit * 2**BITS) / 2**BITS
    known = [stated(system, balls, periodic_orbit(system, near, returns)) for near, returns in cycles]
    finest = max(depth, around.depth if around else 0)
    n = side * FINEST << finest
    flow, cells = flow_of(scaled, n, n // side, max_periods, top), base_grids(len(letters), side, n, top)
    about = {"system": repr(system), "program": f"nsmaps {version('nsmaps')}"} | ({"radii": repr(dict(radii))} if radii else {})
    if around:
        trap, (cells, about["attractor"]) = None, closed_around(system, start, flow, cells, around, unit)
    else:
        trap = found_trap(balls, letters, periodic_orbit(system, start, period))
    with _stop_asked() as asked:

        def inside(wall: Any, phases: Any, speeds: Any) -> Any:
            return trapped(trap, wall, phases, n, unit * speeds) if trap else np.zeros(len(wall), bool)

        def reached(level: int, shares: Any) -> bool:
            beat((level + 1) / (depth + n_cuts + 1), f"{level} divisions, {100 * float(np.mean(shares)):.3g} % found")
            return not asked()

        cells = search(flow, cells, depth, inside, reached, n_cuts)
    grid = {"side": side, "depth": finest, "top": unit * top, "periods": max_periods, "closed": bool(around)}
    codes, slopes = codes_of(cells)
    return Certificate(about, equation, trap._asdict() if trap else {}, grid, codes, known, slopes=slopes)


def _check(side: int, depth: int, n_cuts: int, max_periods: int, top: float) -> None:
    if side < 32 or side & (side - 1) or not 0 <= depth <= 12 or not 0 <= n_cuts <= 12 or max_periods < 1 or not top > 0:
        raise ProofError(
            f"side {side}, depth {depth}, n_cuts {n_cuts}, max_periods {max_periods}, top {top:g}; expected: a power of two "
            "from 32 on, up to 12, up to 12, from 1 on, and above 0"
        )


@contextmanager
def _stop_asked() -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C was pressed; the second time it raises KeyboardInterrupt."""
    pressed = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal pressed
        if pressed:
            signal.default_int_handler(number, frame)
        pressed = True

    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield lambda: pressed
    finally:
        signal.signal(signal.SIGINT, before)
