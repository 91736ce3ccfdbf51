"""Phrases that captions share: parameters with their units, shares, the sheet of which a caption speaks."""

from collections.abc import Iterable

from nsmaps.files.storage import file_part
from nsmaps.study.result import StudyResult

MOST = 5  #: parts of a list that are named


def parameters(result: StudyResult, without: Iterable[str] = ()) -> str:
    """The values of the parameters with their units, such as `d = 0.35, r = 0.5`, apart from those that are varied."""
    left = {name: value for name, value in result.system.parameters.items() if name not in without}
    return ", ".join(f"{name} = {value:.6g}{_unit(result, name)}" for name, value in left.items())


def part_of(names: Iterable[str], part: str) -> str:
    """The name of which a file has this part, the first where it has none; empty if it is of none."""
    listed = list(names)
    return next((name for name in listed if file_part(name) == part), "") if part else next(iter(listed), "")


def at(result: StudyResult, without: Iterable[str] = ()) -> str:
    """The same at the beginning of a sentence, empty where there is none."""
    given = parameters(result, without)
    return f"At {given}: " if given else ""


def _unit(result: StudyResult, name: str) -> str:
    unit = result.system.units.get(name, "")
    return f" {unit}" if unit else ""
