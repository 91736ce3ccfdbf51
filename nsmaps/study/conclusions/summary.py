"""Descriptions of the sections of a study, and the numbers and tables of its result."""

from collections.abc import Iterator
from typing import Any

from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Table, concluding
from nsmaps.study.steps import analyses_by_step
from nsmaps.study.study import Study


def about(study: Study) -> dict[str, str]:
    """A description of each step by its name, without any computation."""
    return {name: analysis.describe(study) for name, analysis in analyses_by_step(study).items()}


def numbers(result: StudyResult) -> dict[str, Any]:
    """The main numbers of a result, as plain data for result.json, by heading."""
    return {heading: data for analysis in concluding(result) for heading, data in analysis.numbers(result).items()}


def tables(result: StudyResult) -> Iterator[Table]:
    """The tables that are printed at the end of a run."""
    for analysis in concluding(result):
        yield from analysis.tables(result)
