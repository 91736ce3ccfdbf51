"""Any result as files of another language: `nsmaps.export(result, "c")`."""

import json
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from nsmaps.auxiliary.iterate import HELD, ClosedEnvelope, envelope_curves
from nsmaps.errors import NsmapsError, near_match
from nsmaps.exact.system import ImpactSystem
from nsmaps.export.c import c_files
from nsmaps.export.document import KINDS, AnyMap, document, kind_of
from nsmaps.export.julia import julia_files
from nsmaps.export.latex import latex_files
from nsmaps.export.matlab import matlab_files
from nsmaps.export.numpy_module import python_files
from nsmaps.export.program import identifiers, program_of
from nsmaps.export.system import system_files
from nsmaps.reduced.composite import Piece

ACCEPTED = f"{', '.join(cls.__name__ for cls, _, _ in KINDS.values())}, ImpactSystem, the result of a study"


@runtime_checkable
class Finished(Protocol):
    """What of a study's result is exported."""

    study: Any
    system: ImpactSystem
    composite: Any
    parametric: Any
    second_iterate: Any
    domains: Any


def export(result: Any, format: str, path: str | os.PathLike[str] | None = None) -> str | dict[str, str]:
    """A map, a closed form, an exact system or all that a study's result holds of them, in another language.

    Polynomials are summed in the Chebyshev products that the map itself is kept in, an iterate of one coordinate curve after
    curve: nothing is expanded, so that nothing cancels. Numbers have as many digits as read back to them.

    Args:
        result: a PolyMap, CompositeMap, ParametricMap, SecondIterate, HeldIterate, ClosedMap or StudyResult; for latex also an
            ImpactSystem.
        format: "latex", "python" (a NumPy module), "c" (C99 with a header), "julia", "matlab" (Octave runs it too) or "json".
        path: a folder to write the files into, which is made if it is not there.

    Returns:
        The text of the file, or texts by file name where there are several, as of "c" or of a study's result.

    Raises:
        NsmapsError: a format or a result that is not accepted, symbols for coefficients, or a region that only python knows.
    """
    if format not in WRITERS:
        raise NsmapsError(f"the format {format!r}{near_match(str(format), WRITERS)}; accepted: {', '.join(WRITERS)}")
    files = _files(result, format)
    if path is not None:
        folder = Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
    several = len(files) > 1 or not isinstance(result, AnyMap | ImpactSystem)
    return files if several else next(iter(files.values()))


def _files(result: Any, format: str) -> dict[str, str]:
    """The texts by file name."""
    if isinstance(result, ImpactSystem):
        if format != "latex":
            raise NsmapsError(f"an exact system as {format!r}: its map is implicit; accepted: 'latex'")
        return system_files(result)
    if isinstance(result, AnyMap):
        return WRITERS[format](result, kind_of(result).replace(" ", "_"))
    if not isinstance(result, Finished):
        raise NsmapsError(f"a {type(result).__name__} cannot be exported; accepted: {ACCEPTED}")
    files = system_files(result.system) if format == "latex" else {}
    for name, each in held_by(result).items():
        files |= WRITERS[format](each, name)
    if not files:
        raise NsmapsError(
            f"the result has nothing that can be written as {format!r}; accepted: one with a composite map, a parametric map or "
            "a second iterate (not one of strips, which ask the exact system near edges)"
        )
    return files


def held_by(result: Finished) -> dict[str, AnyMap]:
    """The maps and closed forms of a study's result, by the name of their file."""
    maps = {"composite_map": result.composite, "parametric_map": result.parametric, "second_iterate": result.second_iterate}
    found: dict[str, AnyMap] = {name: each for name, each in maps.items() if each is not None}
    pieces = {piece.name: piece for piece in result.composite.pieces} if result.composite is not None else {}
    for section in result.study.domains:
        if section.name in result.domains and section.map in pieces:
            found |= _envelopes(section.name, pieces[section.map], result.domains[section.name].updates[-1].envelopes)
    return found


def _envelopes(domain: str, piece: Piece, envelopes: Iterable[Any]) -> dict[str, AnyMap]:
    """The auxiliary maps of the last update that are curves in closed form, eq. auxv."""
    found: dict[str, AnyMap] = {}
    for each in envelopes:
        if isinstance(each, ClosedEnvelope) and each.kind == HELD and each.coordinate not in piece.map.absolute:
            names = identifiers([f"{domain} {each.coordinate} {side}" for side in ("lower", "upper")])
            found |= dict(zip(names, envelope_curves(piece, each), strict=True))
    return found


def _json(result: AnyMap, name: str) -> dict[str, str]:
    return {f"{name}.json": json.dumps(document(result), indent=1, allow_nan=False) + "\n"}


WRITERS: Mapping[str, Callable[[AnyMap, str], dict[str, str]]] = {
    "latex": latex_files,
    "python": lambda result, name: python_files(program_of(result, name), document(result)),
    "c": lambda result, name: c_files(program_of(result, name)),
    "julia": lambda result, name: julia_files(program_of(result, name)),
    "matlab": lambda result, name: matlab_files(program_of(result, name)),
    "json": _json,
}
