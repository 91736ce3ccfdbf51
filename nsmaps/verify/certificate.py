"""A certificate as a file, and its verification: a system, a trap, cells with orders, and what follows from them.

A file is a zip archive of `certificate.json`, with the numbers as text or doubles, and `codes`, the codes of the cells as
little-endian numbers of 16 bits. Nothing in it is believed but the formula of the system, which `nsmaps verify` prints.
"""

import json
import zipfile
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nsmaps.verify.cells import Grid, Refused, check_cells
from nsmaps.verify.flights import Doubtful
from nsmaps.verify.formula import system_of
from nsmaps.verify.trap import Trap, contraction, holds, trap_of

TEXT, CODES, FORMAT = "certificate.json", "codes", 1
KEYS = {"format", "about", "system", "trap", "grid", "codes"}


@dataclass(frozen=True)
class Certificate:
    """What is claimed: orbits from all cells with an order come to the trap, and orbits from the trap to one cycle."""

    about: Mapping[str, str]  #: of whom and of what: not verified
    system: Mapping[str, Any]  #: see `formula.system_of`
    trap: Mapping[str, Any]  #: see `trap.Trap`
    grid: Mapping[str, Any]  #: see `cells.Grid`
    codes: NDArray[np.uint16]  #: see `cells`


@dataclass(frozen=True)
class Verified:
    """What was proved of a certificate."""

    letters: tuple[str, ...]  #: of the walls
    shares: tuple[float, ...]  #: of the states of each wall with a speed below `top`, from which orbits come to the cycle
    top: float
    factor: float  #: by which the iterate contracts the trap
    impacts: int  #: of that iterate
    seconds: tuple[float, float]  #: for the trap and for the cells


def write(path: Path, certificate: Certificate) -> None:
    """Write a certificate."""
    codes = certificate.codes.astype("<u2").tobytes()
    parts = {"about": certificate.about, "system": certificate.system, "trap": certificate.trap, "grid": certificate.grid}
    text = json.dumps({"format": FORMAT, **parts, "codes": sha256(codes).hexdigest()}, indent=1)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo(TEXT), text)
        archive.writestr(zipfile.ZipInfo(CODES), codes, zipfile.ZIP_DEFLATED)


def read(path: Path) -> Certificate:
    """The certificate of a file; `Refused` where it is not as `write` makes it."""
    try:
        with zipfile.ZipFile(path) as archive:
            data, codes = json.loads(archive.read(TEXT)), archive.read(CODES)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise Refused(f"{path} is not a whole certificate: {error}") from error
    if not isinstance(data, dict) or set(data) != KEYS or data["format"] != FORMAT:
        raise Refused(f"{path} is not a certificate of format {FORMAT} with {', '.join(sorted(KEYS))}")
    if sha256(codes).hexdigest() != data["codes"] or len(codes) % 2:
        raise Refused(f"the codes of {path} are not those that it was written with")
    return Certificate(data["about"], data["system"], data["trap"], data["grid"], np.frombuffer(codes, "<u2").astype(np.uint16))


def verify(
    certificate: Certificate, progress: Callable[[int, int], Any] = lambda done, total: None, workers: int = 2
) -> Verified:
    """Prove what a certificate claims; `Refused`, with the reason, where that fails.

    Args:
        progress: called with the number of cells that are verified, and that of all.
        workers: threads.
    """
    try:
        system, trap, grid = system_of(dict(certificate.system)), trap_of(certificate.trap), Grid(**certificate.grid)
        letters = tuple(str(wall["letter"]) for wall in certificate.system["walls"])
        begun = perf_counter()
        factor = contraction(system, trap)
    except Doubtful as error:
        raise Refused(str(error)) from error
    except (KeyError, TypeError, ValueError, IndexError, ZeroDivisionError) as error:
        raise Refused(f"the certificate is not readable: {type(error).__name__}: {error}") from error
    proved = perf_counter()

    def trapped(wall: int, phases: NDArray[np.int64], n: int, speeds: NDArray[np.float64]) -> NDArray[np.bool_]:
        return holds(trap, wall, phases, n, speeds)

    shares = check_cells(system, grid, certificate.codes, trapped, progress, workers)
    times = proved - begun, perf_counter() - proved
    return Verified(letters, tuple(map(float, shares)), grid.top, factor, trap.impacts, times)


def statement(found: Verified, trap: Trap) -> str:
    """The theorem in words."""
    areas = " and ".join(
        f"{100 * share:.4g} % of wall {letter}" for letter, share in zip(found.letters, found.shares, strict=True)
    )
    point = f"(phase {trap.centre[0]:.9g}, speed {trap.centre[1]:.9g})"
    return (
        f"Proved: all orbits that start in the cells with an order, {areas} (phases on the whole circle, impact speeds below "
        f"{found.top:g}), converge to one cycle of {found.impacts} impacts or of a divisor of them, next to {point} on wall "
        f"{found.letters[trap.wall]}. The rest is left open."
    )
