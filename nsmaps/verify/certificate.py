"""A certificate as a file, and its verification: a system, a trap, cells with orders, and what follows from them.

A file is a zip archive of `certificate.json`, with the numbers as text or doubles, `codes`, the codes of the cells as
little-endian numbers of 16 bits, and `slopes`, those of strips as numbers of 8 bits; format 1 is without strips. Nothing in it
is believed but the formula of the system, which `nsmaps verify` prints.
"""

import json
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.verify.cells import Grid, Refused, check_cells
from nsmaps.verify.cycles import Cycle, all_verified
from nsmaps.verify.flights import Doubtful
from nsmaps.verify.formula import system_of
from nsmaps.verify.horseshoe import Chaos, chaos_of, horseshoe_of, in_words
from nsmaps.verify.trap import Trap, contraction, holds, trap_of

TEXT, CODES, SLOPES, FORMAT = "certificate.json", "codes", "slopes", 2
MOST = 12  #: cycles that are listed
KEYS = {"format", "about", "system", "trap", "grid", "codes", "cycles", "horseshoe"}


@dataclass(frozen=True)
class Certificate:
    """What is claimed: cycles; orbits from all cells with an order come to the trap, and orbits from the trap to one cycle.

    A grid that is `closed` has no trap: orbits come to its cells of order zero, and stay in them.
    """

    about: Mapping[str, str]  #: of whom and of what: not verified
    system: Mapping[str, Any]  #: see `formula.system_of`
    trap: Mapping[str, Any] = field(default_factory=dict)  #: see `trap.Trap`; empty for a closed set, or for cycles alone
    grid: Mapping[str, Any] = field(default_factory=dict)  #: see `cells.Grid`
    codes: NDArray[np.uint16] = field(default_factory=lambda: np.zeros(0, np.uint16))  #: see `cells`
    cycles: Sequence[Any] = ()  #: see `cycles.Stated`
    horseshoe: Mapping[str, Any] = field(default_factory=dict)  #: see `horseshoe.Horseshoe`; empty where none is claimed
    slopes: NDArray[np.int8] = field(default_factory=lambda: np.zeros(0, np.int8))  #: see `cells`


@dataclass(frozen=True)
class Verified:
    """What was proved of a certificate."""

    letters: tuple[str, ...]  #: of the walls
    cycles: tuple[Cycle, ...]  #: all different
    seconds: tuple[float, float, float]  #: for cycles and horseshoe, trap and cells
    shares: tuple[float, ...] = ()  #: of the states of each wall below `top` from which orbits come to the cycle or closed set
    closed: tuple[float, ...] = ()  #: those of the closed set
    top: float = 0.0
    factor: float = 1.0  #: by which the iterate contracts the trap
    impacts: int = 0  #: of that iterate
    chaos: Chaos | None = None  #: of the horseshoe


def write(path: Path, certificate: Certificate) -> None:
    """Write a certificate."""
    codes, slopes = certificate.codes.astype("<u2").tobytes(), certificate.slopes.astype("i1").tobytes()
    parts: dict[str, Any] = {
        "about": certificate.about,
        "system": certificate.system,
        "trap": certificate.trap,
        "grid": certificate.grid,
    }
    parts |= {"cycles": list(certificate.cycles), "horseshoe": certificate.horseshoe}
    text = json.dumps({"format": FORMAT, **parts, "codes": sha256(codes + slopes).hexdigest()}, indent=1)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(TEXT), text, zipfile.ZIP_DEFLATED)
        archive.writestr(zipfile.ZipInfo(CODES), codes, zipfile.ZIP_DEFLATED)
        archive.writestr(zipfile.ZipInfo(SLOPES), slopes, zipfile.ZIP_DEFLATED)


def read(path: Path) -> Certificate:
    """The certificate of a file; `Refused` where it is not as `write` makes it."""
    try:
        with zipfile.ZipFile(path) as archive:
            data, codes = json.loads(archive.read(TEXT)), archive.read(CODES)
            slopes = archive.read(SLOPES) if SLOPES in archive.namelist() else b""
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise Refused(f"{path} is not a whole certificate: {error}") from error
    if not isinstance(data, dict) or set(data) != KEYS or data["format"] not in (1, FORMAT):
        raise Refused(f"{path} is not a certificate of format 1 or {FORMAT} with {', '.join(sorted(KEYS))}")
    if sha256(codes + slopes).hexdigest() != data["codes"] or len(codes) % 2:
        raise Refused(f"the codes of {path} are not those that it was written with")
    orders = np.frombuffer(codes, "<u2").astype(np.uint16)
    about, system, trap, grid = (data[name] for name in ("about", "system", "trap", "grid"))
    strips = np.frombuffer(slopes, "i1")
    return Certificate(about, system, trap, grid, orders, data["cycles"], data["horseshoe"], strips)


def verify(
    certificate: Certificate, progress: Callable[[int, int], Any] = lambda done, total: None, workers: int = 2
) -> Verified:
    """Prove what a certificate claims; `Refused`, with the reason, where that fails.

    Args:
        progress: called with the number of cycles, then of cells, that are verified, and that of all.
        workers: threads.
    """
    begun = perf_counter()
    try:
        system = system_of(dict(certificate.system))
        letters = tuple(str(wall["letter"]) for wall in certificate.system["walls"])
        cycles = all_verified(system, certificate.cycles, progress)
        stated = horseshoe_of(certificate.horseshoe, len(letters)) if certificate.horseshoe else None
        chaos = chaos_of(system, stated, progress) if stated else None
        known = perf_counter()
        if not (certificate.trap or certificate.grid or len(certificate.codes)) and (cycles or chaos):
            return Verified(letters, cycles, (known - begun, 0.0, 0.0), chaos=chaos)
        grid = Grid(**certificate.grid)
        if grid.closed and certificate.trap:
            raise ValueError("a trap beside a closed set")
        trap = None if grid.closed else trap_of(certificate.trap)
        factor = contraction(system, trap) if trap else 1.0
    except Doubtful as error:
        raise Refused(str(error)) from error
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError) as error:
        raise Refused(f"the certificate is not readable: {type(error).__name__}: {error}") from error
    proved = perf_counter()

    def trapped(wall: int, phases: NDArray[np.int64], n: int, speeds: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.zeros(len(phases), bool) if trap is None else holds(trap, wall, phases, n, speeds)

    shares = check_cells(system, grid, certificate.codes, trapped, progress, workers, certificate.slopes)
    times = known - begun, proved - known, perf_counter() - proved
    found = Verified(letters, cycles, times, tuple(map(float, shares.proved)), top=grid.top, chaos=chaos)
    if trap is None:
        return replace(found, closed=tuple(map(float, shares.zero)))
    return replace(found, factor=factor, impacts=trap.impacts)


def statement(found: Verified, certificate: Certificate) -> str:
    """The theorem in words."""
    parts = [_arrival(found)] if found.closed else [_attraction(found, trap_of(certificate.trap))] if found.shares else []
    return "\n".join(parts + _of_cycles(found) + ([in_words(found.chaos, found.letters)] if found.chaos else []))


def _of_cycles(found: Verified) -> list[str]:
    """Cycles, the first of them one by one."""
    if not found.cycles:
        return []
    kinds = ", ".join(f"{[x.kind for x in found.cycles].count(kind)} {kind}" for kind in ("stable", "saddle", "open"))
    lines = [
        f"Proved: {len(found.cycles)} different cycles exist, each the only one with its walls within the stated radii: {kinds}."
    ]
    for cycle in found.cycles[:MOST]:
        word, (phase, speed) = "".join(found.letters[wall] for wall in cycle.walls), cycle.states[0]
        numbers = (
            f"trace {cycle.trace}" if cycle.multipliers is None else f"multipliers {cycle.multipliers[0]}, {cycle.multipliers[1]}"
        )
        lines.append(f"  {word}, phase {phase}, speed {speed}, {cycle.turns} periods, {cycle.kind}: {numbers}")
    return lines + ([f"  and {len(found.cycles) - MOST} more"] if len(found.cycles) > MOST else [])


def _attraction(found: Verified, trap: Trap) -> str:
    """What follows from trap and cells."""
    point = f"(phase {trap.centre[0]:.9g}, speed {trap.centre[1]:.9g})"
    return (
        f"Proved: all orbits {_starts(found)}, converge to one cycle of {found.impacts} impacts or of a divisor of them, next to "
        f"{point} on wall {found.letters[trap.wall]}. {_remainder(found)}"
    )


def _arrival(found: Verified) -> str:
    """What follows from a closed set and cells."""
    return (
        f"Proved: all orbits {_starts(found)}, arrive in the closed set of the cells of order zero, "
        f"{_areas(found, found.closed)}, and stay there. {_remainder(found)}"
    )


def _starts(found: Verified) -> str:
    """The starts that a theorem is about."""
    return (
        f"that start in the cells with an order, {_areas(found, found.shares)} (phases on the whole circle, impact speeds below "
        f"{found.top:g})"
    )


def _remainder(found: Verified) -> str:
    """Whether states are left; shares are exact sums of powers of two."""
    return "The rest is left open." if min(found.shares) < 1 else "These are all states below that speed; none is left open."


def _areas(found: Verified, shares: Sequence[float]) -> str:
    """Shares of each wall in words."""
    return " and ".join(f"{100 * share:.4g} % of wall {letter}" for letter, share in zip(found.letters, shares, strict=True))
