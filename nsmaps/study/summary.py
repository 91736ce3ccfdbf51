"""What each section says of itself: what a run would compute, the numbers it found, tables of them."""

from collections.abc import Iterator
from typing import Any

from nsmaps.study.result import StudyResult
from nsmaps.study.sections import SECTIONS
from nsmaps.study.sections.base import Table
from nsmaps.study.study import Study


def about(study: Study) -> dict[str, str]:
    """What each step would compute, by its name; nothing is computed for it."""
    named = [section for section in SECTIONS if section.compute and study.names(section.key)]
    return {section.name: section.describe(getattr(study, section.key), study) for section in named}


def numbers(result: StudyResult) -> dict[str, Any]:
    """The numbers of a result that a reader looks for, as plain data for result.json, by heading."""
    return {heading: data for section in SECTIONS for heading, data in section.numbers(result).items()}


def tables(result: StudyResult) -> Iterator[Table]:
    """What a reader of a run's end looks for, but for verdicts."""
    for section in SECTIONS:
        yield from section.tables(result)
