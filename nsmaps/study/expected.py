"""Verdicts that a study expects to fail, each with what its failure shows: a run says so beside the reason."""

from collections.abc import Mapping
from dataclasses import replace

from nsmaps.study.result import StudyResult, Verdict


def as_expected(result: StudyResult, found: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """The verdicts, those that are expected to fail told as such: what a failure shows, or that it did not come.

    A study expects this of its own parameters alone, and of no verdict that it requires.
    """
    expected = {} if result.study.source.changed else result.study.expected_failures
    return tuple(_told(verdict, expected) for verdict in found)


def unmet(result: StudyResult) -> list[str]:
    """What a study expects to fail and is no verdict of its run, or a required one."""
    if result.study.source.changed or not result.finished:
        return []
    known = {name for verdict in result.verdicts if not verdict.required for name in _names(verdict)}
    return [name for name in result.study.expected_failures if name not in known]


def _names(verdict: Verdict) -> tuple[str, ...]:
    """What a verdict may be called: its name, that without its claim, each also with its map."""
    names = verdict.name, verdict.name.rpartition(": ")[0] or verdict.name
    return *names, *(f"{name} ({verdict.of})" for name in names)


def _told(verdict: Verdict, expected: Mapping[str, str]) -> Verdict:
    shows = next((text for name, text in expected.items() if name in _names(verdict)), "")
    if not shows or verdict.required:
        return verdict
    because = verdict.text.partition(": ")[2]
    if verdict.holds:
        return replace(verdict, text=f"yes: expected to fail, yet it holds; {because}")
    return replace(verdict, shows=shows, text=f"no: expected to fail: shows that {shows}; {because}")
