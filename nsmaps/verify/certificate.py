"""A certificate as a file, and its verification: a system, a trap, cells with orders, and what follows from them.

A file is a zip archive of `certificate.json`, with the numbers as text or doubles, `codes`, the codes of the cells as
little-endian numbers of 16 bits, and `slopes`, those of strips as numbers of 8 bits; format 1 is without strips. Nothing in it
is believed: the theorem is one about the system whose numbers it states, and which `nsmaps verify` prints.
"""

import json
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.verify.cells import CertificateError, Grid, check_cells
from nsmaps.verify.cycles import Cycle, all_verified
from nsmaps.verify.formula import UnprovedError, system_of
from nsmaps.verify.formula import in_words as equation_in_words
from nsmaps.verify.horseshoe import Chaos, chaos_of, horseshoe_of, in_words
from nsmaps.verify.maps.proved import VerifiedMap, statement_of_map, verified_map
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
    whole: bool = False  #: no state below `top` is left open

    @property
    def is_empty(self) -> bool:
        """Whether nothing is proved of any cell, although there are cells."""
        return bool(self.shares) and not any(self.shares)


def write_certificate(path: Path, certificate: Certificate) -> None:
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
    """The certificate of a file; `CertificateError` where it is not as `write` makes it, `OSError` where it cannot be opened."""
    try:
        with zipfile.ZipFile(path) as archive:
            data, codes = json.loads(archive.read(TEXT)), archive.read(CODES)
            slopes = archive.read(SLOPES) if SLOPES in archive.namelist() else b""
    except zipfile.BadZipFile as error:
        raise CertificateError(
            f"{path} is not a certificate, or not a whole one; expected: a file that `nsmaps prove` wrote"
        ) from error
    except (FileNotFoundError, PermissionError):
        raise
    except Exception as error:  # zipfile, zlib and json raise a dozen kinds where bytes are changed
        raise CertificateError(f"{path} is not a whole certificate: {_in_a_line(error)}") from error
    if not isinstance(data, dict) or set(data) != KEYS or data["format"] not in (1, FORMAT):
        raise CertificateError(f"{path} is not a certificate of format 1 or {FORMAT} with {', '.join(sorted(KEYS))}")
    if sha256(codes + slopes).hexdigest() != data["codes"] or len(codes) % 2:
        raise CertificateError(f"the codes of {path} are not those that it was written with")
    about, system, trap, grid, horseshoe = (data[name] for name in ("about", "system", "trap", "grid", "horseshoe"))
    if not all(isinstance(each, dict) for each in (about, system, trap, grid, horseshoe)) or not isinstance(data["cycles"], list):
        raise CertificateError(f"{path} is not a certificate: a part of it is of another kind than `nsmaps prove` writes")
    orders, strips = np.frombuffer(codes, "<u2").astype(np.uint16), np.frombuffer(slopes, "i1")
    return Certificate(about, system, trap, grid, orders, data["cycles"], horseshoe, strips)


def verify(
    certificate: Certificate, progress: Callable[[int, int], Any] = lambda done, total: None, workers: int = 2
) -> Verified | VerifiedMap:
    """Prove what a certificate claims; `CertificateError`, with the reason, where that fails.

    Args:
        progress: called with the number of cycles, then of cells, that are verified, and that of all.
        workers: threads.
    """
    try:
        return _verified(certificate, progress, workers)
    except CertificateError:
        raise
    except UnprovedError as error:
        raise CertificateError(str(error)) from error
    except Exception as error:  # whatever a statement that makes no sense leads to, nothing is proved
        raise CertificateError(f"the certificate is not readable: {_in_a_line(error)}") from error


def _in_a_line(error: Exception) -> str:
    """What failed, in one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _verified(certificate: Certificate, progress: Callable[[int, int], Any], workers: int) -> Verified | VerifiedMap:
    """What a certificate claims, proved; any exception where that fails."""
    if "pieces" in certificate.system:
        if certificate.trap:
            raise ValueError("a trap of a map by formulas")
        parts = certificate.cycles, certificate.horseshoe, certificate.grid, certificate.codes
        return verified_map(certificate.system, *parts, progress)
    begun = perf_counter()
    system = system_of(certificate.system)
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
    proved = perf_counter()

    def trapped(wall: int, phases: NDArray[np.int64], n: int, speeds: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.zeros(len(phases), bool) if trap is None else holds(trap, wall, phases, n, speeds)

    shares = check_cells(system, grid, certificate.codes, trapped, progress, workers, certificate.slopes)
    times = known - begun, proved - known, perf_counter() - proved
    found = Verified(letters, cycles, times, tuple(map(float, shares.proved)), top=grid.top, chaos=chaos, whole=shares.whole)
    if trap is None:
        return replace(found, closed=tuple(map(float, shares.zero)))
    return replace(found, factor=factor, impacts=trap.impacts)


def statement(found: Verified | VerifiedMap, certificate: Certificate) -> str:
    """The theorem in words, with the system that it is about."""
    if isinstance(found, VerifiedMap):
        return statement_of_map(found, certificate.system)
    parts = [_arrival(found)] if found.closed else [_attraction(found, trap_of(certificate.trap))] if found.shares else []
    if found.is_empty:
        parts = [f"Not proved: where orbits from any cell come to; all cells of impact speeds below {found.top} are left open."]
    chaos = [in_words(found.chaos, found.letters)] if found.chaos else []
    return "\n".join([equation_in_words(certificate.system), *parts, *_of_cycles(found), *chaos])


def _of_cycles(found: Verified) -> list[str]:
    """Cycles, the first of them one by one."""
    if not found.cycles:
        return []
    kinds = ", ".join(f"{[x.kind for x in found.cycles].count(kind)} {kind}" for kind in ("stable", "saddle", "open"))
    number = f"{len(found.cycles)} different cycles exist, each" if len(found.cycles) > 1 else "a cycle exists,"
    lines = [f"Proved: {number} the only one with its walls within the stated radii: {kinds}."]
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
        f"{_areas(found, found.closed, ROUND_CEILING)}, and stay there. {_remainder(found)}"
    )


def _starts(found: Verified) -> str:
    """The starts that a theorem is about."""
    return (
        f"that start in the cells with an order, {_areas(found, found.shares, ROUND_FLOOR)} (phases on the whole circle, impact "
        f"speeds below {found.top})"
    )


def _remainder(found: Verified) -> str:
    """Whether states are left."""
    return "These are all states below that speed; none is left open." if found.whole else "The rest is left open."


def _areas(found: Verified, shares: Sequence[float], rounding: str) -> str:
    """Shares of each wall in words, to four digits on the safe side; that of all states is one."""
    four, whole = Context(prec=4, rounding=rounding), found.whole and shares == found.shares
    numbers = ["100" if whole else f"{float(four.create_decimal_from_float(100 * share)):g}" for share in shares]
    return " and ".join(f"{number} % of wall {letter}" for letter, number in zip(found.letters, numbers, strict=True))
