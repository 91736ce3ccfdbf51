"""Descriptions of the sections of a study, and the numbers and tables of its result."""

from collections.abc import Iterator
from typing import Any

from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Table
from nsmaps.study.sections.registry import SECTIONS
from nsmaps.study.study import Study


def about(study: Study) -> dict[str, str]:
    """A description of each step by its name, without any computation."""
    named = [section for section in SECTIONS if section.compute and study.names(section.key)]
    return {section.name: section.describe(getattr(study, section.key), study) for section in named}


def numbers(result: StudyResult) -> dict[str, Any]:
    """The main numbers of a result, as plain data for result.json, by heading."""
    return {heading: data for section in SECTIONS for heading, data in section.numbers(result).items()}


def tables(result: StudyResult) -> Iterator[Table]:
    """The tables that are printed at the end of a run."""
    for section in SECTIONS:
        yield from section.tables(result)
