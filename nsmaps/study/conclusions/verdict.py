"""The verdicts of a result, those that are expected to fail, and the conclusion of a run."""

from collections.abc import Mapping
from dataclasses import replace

from nsmaps.study.conclusions.texts import as_computed
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Verdict, concluding
from nsmaps.study.sections.parameters.motions import coexisting


def verdicts(result: StudyResult) -> tuple[Verdict, ...]:
    """All verdicts of a result; the text of one that is expected to fail states this.

    Expected failures apply to the study's own parameters, and to verdicts that are not required.
    """
    expected = {} if result.study.source.changed else result.study.expected_failures
    results = [_as_expected(verdict, expected) for analysis in concluding(result) for verdict in analysis.verdicts(result)]
    name, of, text = ([as_computed(result, getattr(each, part)) for each in results] for part in ("name", "of", "text"))
    return tuple(replace(each, name=a, of=b, text=c) for each, a, b, c in zip(results, name, of, text, strict=True))


def unmet(result: StudyResult) -> list[str]:
    """The names of expected failures that match no verdict of the run, or a required one."""
    if result.study.source.changed or not result.finished:
        return []
    known = {name for verdict in result.verdicts if not verdict.required for name in _names(verdict)}
    return [name for name in result.study.expected_failures if as_computed(result, name) not in known]


def _names(verdict: Verdict) -> tuple[str, ...]:
    """The names by which a study may refer to a verdict: with or without its claim, each with or without its map."""
    names = verdict.name, verdict.name.rpartition(": ")[0] or verdict.name
    return *names, *(f"{name} ({verdict.of})" for name in names)


def _as_expected(verdict: Verdict, expected: Mapping[str, str]) -> Verdict:
    meaning = next((text for name, text in expected.items() if name in _names(verdict)), "")
    if not meaning or verdict.required:
        return verdict
    because = verdict.text.partition(": ")[2]
    if verdict.holds:
        return replace(verdict, text=f"yes: expected to fail, but confirmed; {because}")
    return replace(verdict, shows=meaning, text=f"no: expected to fail: shows that {meaning}; {because}")


def _only(verdict: Verdict) -> str:
    """The only verdict in a sentence."""
    return f"The only verdict, which is not required, {'holds' if verdict.holds else 'does not hold'}: {verdict.name}."


def _first(names: list[str], n_names: int = 3) -> str:
    """The first of some names, and how many more there are."""
    more = len(names) - n_names
    return "; ".join(names[:n_names]) + (f" and {more} more" if more > 0 else "")


def conclusion(result: StudyResult) -> str:
    """The required verdicts that fail, or that none does; the others that fail unexpectedly; coexisting attractors; else ""."""
    required, others = ([v for v in result.verdicts if v.required is asked] for asked in (True, False))
    failed = [f"{verdict.name} ({verdict.of})" for verdict in required if not verdict.holds]
    if failed:
        text = (
            f"{len(failed)} of {len(required)} required verdicts {'fail' if len(failed) > 1 else 'fails'}: {'; '.join(failed)}."
        )
    elif required:
        text = f"All {len(required)} required verdicts hold." if len(required) > 1 else "The one required verdict holds."
    else:
        text = ""
    if others:
        expected = sum(bool(verdict.shows) for verdict in others)
        shown = f", {expected} fail{'s' * (expected == 1)} as expected" if expected else ""
        held = sum(verdict.holds for verdict in others)
        failing = [f"{verdict.name} ({verdict.of})" for verdict in others if not verdict.holds and not verdict.shows]
        shown += f", {len(failing)} fail{'s' * (len(failing) == 1)}: {_first(failing)}" if failing else ""
        which = f" Of {len(others)} that are not required" if required else f"Of {len(others)} verdicts, none of them required"
        text += f"{which}, {held} hold{'s' * (held == 1)}{shown}." if required or len(others) > 1 else _only(others[0])
    text += "".join(f" Expected to fail, but no verdict here that is not required: {name}." for name in unmet(result))
    text = " ".join(filter(None, (text, coexisting(result))))
    return text if result.finished else f"Unfinished: the run was stopped, and this is what it had computed. {text}".rstrip()
