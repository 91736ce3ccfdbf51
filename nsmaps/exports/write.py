"""Any result as files of another language: `nsmaps.export(result, "c")`."""

import os
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nsmaps.errors import NsmapsError, check_known
from nsmaps.errors.arguments import checked
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exports.document import KINDS, kind_of
from nsmaps.exports.equations.modes import mode_files
from nsmaps.exports.equations.system import system_files
from nsmaps.exports.exportables import held_by, is_finished
from nsmaps.exports.headers import of_study
from nsmaps.exports.languages import LANGUAGES
from nsmaps.exports.program import MATH_H, Exportable, identifiers
from nsmaps.symbolic.map_iterates import symbolic_iterate

if TYPE_CHECKING:
    from nsmaps.study.result import StudyResult

PROGRAMS = ("c", "julia", "javascript")  #: languages in which the first return of an exact system is written
SYSTEMS = "ImpactSystem, HybridSystem, PiecewiseMap"
ACCEPTED = f"{', '.join(cls.__name__ for cls, _, _ in KINDS.values())}, {SYSTEMS}, the result of a study"


@checked
def export(
    result: Any, language: str, path: str | os.PathLike[str] | None = None, *, name: str | None = None
) -> str | dict[str, str]:
    """A map, a closed form, an exact system or all that a study's result holds of them, in another language.

    Polynomials are summed in the Chebyshev products that the map itself is kept in, an iterate of one coordinate curve after
    curve: nothing is expanded, so that nothing cancels. Numbers have as many digits as read back to them.

    Args:
        result: a PolyMap, CompositeMap, ParametricMap, SecondIterate, HeldIterate, ClosedMap, PiecewiseMap or StudyResult; for
            latex also an ImpactSystem or a HybridSystem; for c, julia and javascript one whose flights are in closed form, or
            linear between events: its first return at its parameters.
        language: "latex", "python" (a NumPy module), "c" (C99 with a header), "julia", "matlab" (Octave runs it too),
            "javascript" (for a page or node) or "json".
        path: a folder to write the files into, which is made if it is not there.
        name: of the file and of the function in it, in letters, digits and _; else by its kind, such as closed_map. The files
            of a study's result are called after what they hold.

    Returns:
        The text of the file, or texts by file name where there are several, as of "c" or of a study's result.

    Raises:
        NsmapsError: a language, a name or a result that is not accepted, symbols for coefficients, a region or a map with a
            function that formulas do not have, or a system whose exact map has no table: with flights that are integrated or
            nonlinear, or with an impact law or reset that C has no function for.

    Examples:
        >>> import nsmaps
        >>> logistic = nsmaps.reduced.PolyMap.of_monomials(("x",), {"x": {(1,): 4, (2,): -4}}, [[0, 1]])
        >>> twice = nsmaps.symbolic.symbolic_iterate(logistic, 2)
        >>> sorted(nsmaps.export(twice, "c", name="logistic_twice"))
        ['logistic_twice.c', 'logistic_twice.h']
        >>> nsmaps.export(twice, "python", name="logistic_twice").count("def logistic_twice(states):")
        1
        >>> result = nsmaps.read_result("runs/vi_pair/fp")  # doctest: +SKIP
        >>> nsmaps.export(result, "latex", "tex")  # doctest: +SKIP
    """
    files = _files(result, language, name)
    _write(files, path)
    several = len(files) > 1 or not isinstance(result, Exportable | System)
    return files if several else next(iter(files.values()))


def export_iterate(
    result: "StudyResult", n: int, piece: str | None, language: str, path: str | os.PathLike[str] | None = None
) -> dict[str, str]:
    """The n-th iterate of a piece of a result's composite map, all coordinates, as texts by file name; errors as `export`."""
    if result.composite is None:
        raise NsmapsError("the result has no composite map; expected: one, of whose pieces there are iterates in closed form")
    closed = symbolic_iterate(result.composite, n, piece=piece)
    source = piece if piece is not None else result.composite.pieces[0].name
    (name,) = identifiers([f"{source} iterate {n}"])
    returns = result.composite.piece(source).returns
    counted = f", of {n * returns} returns" if returns > 1 else ""
    about = f"The iterate {n} of the piece {source}, all coordinates{counted}."
    files = _writer(language)(closed, name, [about, *of_study(result)])
    _write(files, path)
    return files


def _write(files: Mapping[str, str], path: str | os.PathLike[str] | None) -> None:
    if path is not None:
        folder = Path(path)
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")


def _writer(language: str) -> Callable[[Exportable, str, Sequence[str]], dict[str, str]]:
    """The function that writes a language."""
    check_known("there is no language", language, LANGUAGES)
    return import_module(f"nsmaps.exports.languages.{language}").files


def _files(result: Any, language: str, name: str | None) -> dict[str, str]:
    """The texts by file name."""
    write = _writer(language)
    if name is not None:
        near = f"{name}_" if language == "c" and name.lower() in MATH_H.split() else identifiers([name])[0]
        if near != name:
            raise NsmapsError(f"the name {name!r}; expected: letters, digits and _, but no word of a language, such as {near!r}")
    if isinstance(result, System):
        return _of_system(result, language, name)
    if isinstance(result, Exportable):
        return write(result, name or kind_of(result).replace(" ", "_"), ())
    if not is_finished(result):
        raise NsmapsError(f"a {type(result).__name__} cannot be exported; expected: {ACCEPTED}")
    if name is not None:
        raise NsmapsError(f"the name {name!r} for all that a result holds; expected: none, or one of its maps with a name")
    files = {} if _unwritten(result.system, language) else _of_system(result.system, language)
    for each in held_by(result).files:
        files |= write(each.map, each.name, each.about)
    if not files:
        raise NsmapsError(
            f"the result has nothing that can be written as {language!r}; expected: one with a composite map, a parametric map "
            "or a second iterate (not one of strips, which ask the exact system near edges)"
        )
    return files


def left_out(result: "StudyResult", language: str) -> list[str]:
    """What a study's result holds that is not written in a language, each with the reason."""
    writes_map = language in ("latex", *PROGRAMS) or isinstance(result.system, PiecewiseMap)
    why = _unwritten(result.system, language) if writes_map else ""
    return [*held_by(result).skipped, *([f"the exact map: {why}"] if why else [])]


def _of_system(system: System, language: str, name: str | None = None) -> dict[str, str]:
    """The equations of an exact system, its first return as a program, or a map given by formulas, by file name."""
    if why := _unwritten(system, language):
        others = ", ".join(each for each in LANGUAGES if not _unwritten(system, each))
        expected = others or ("a `displacement`" if isinstance(system, FlowSystem) else FlowSystem.wanted)
        expected = "latex, or a formula of known functions" if isinstance(system, PiecewiseMap) else expected
        raise NsmapsError(f"{type(system).__name__} as {language!r}: {why}; expected: {expected}")
    if isinstance(system, PiecewiseMap):
        from nsmaps.exports.equations.pieces import piece_files

        return piece_files(system, language, _writer(language), name)
    assert isinstance(system, ImpactSystem | HybridSystem)
    if language == "latex":
        return system_files(system, name) if isinstance(system, ImpactSystem) else mode_files(system, name)
    from nsmaps.exports.programs.displacement import displacement_return
    from nsmaps.exports.programs.modes import modes_return
    from nsmaps.exports.programs.program import program_files

    what = displacement_return(system) if isinstance(system, ImpactSystem) else modes_return(system)
    return program_files(what, language, name or identifiers([type(system).__name__.lower()])[0])


def _unwritten(system: System, language: str) -> str:
    """The reason why a system cannot be written in a language, or no text."""
    if isinstance(system, PiecewiseMap):
        return "" if language == "latex" else _without_text(system)
    if not isinstance(system, FlowSystem):
        return "its returns are given by a program, and not by formulas"
    if isinstance(system, ImpactSystem) and system.flight() == "acceleration":
        return "its flights are given by an acceleration"
    if language == "latex":
        return ""
    if language not in PROGRAMS:
        return "its map is implicit"
    nonlinear = isinstance(system, HybridSystem) and system._definition().smooth
    return "its flights are nonlinear, and followed by code of heyoka" if nonlinear else ""


def _without_text(system: PiecewiseMap) -> str:
    """The reason why a map given by formulas has no text, or none."""
    from nsmaps.reduced.composite.formulas import composite_of

    try:
        composite_of(system)
    except NsmapsError as error:
        return str(error)
    return ""
