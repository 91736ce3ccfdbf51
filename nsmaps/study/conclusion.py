"""What a run comes to, in a sentence or two."""

from nsmaps.study.expected import unmet
from nsmaps.study.motions import coexisting
from nsmaps.study.result import StudyResult


def conclusion(result: StudyResult) -> str:
    """Which required verdicts fail, or that all hold; how many of the others do, and what coexists."""
    required, others = ([v for v in result.verdicts if v.required is asked] for asked in (True, False))
    failed = [f"{verdict.name} ({verdict.of})" for verdict in required if not verdict.holds]
    if failed:
        text = (
            f"{len(failed)} of {len(required)} required verdicts {'fail' if len(failed) > 1 else 'fails'}: {'; '.join(failed)}."
        )
    elif required:
        text = f"All {len(required)} required verdicts hold." if len(required) > 1 else "The one required verdict holds."
    else:
        text = "The study requires no verdict."
    if others:
        expected = sum(bool(verdict.shows) for verdict in others)
        shown = f", {expected} fail{'s' * (expected == 1)} as expected" if expected else ""
        text += f" Of {len(others)} that are not required, {sum(verdict.holds for verdict in others)} hold{shown}."
    text += "".join(f" Expected to fail, but no verdict here that is not required: {name}." for name in unmet(result))
    text = " ".join(filter(None, (text, coexisting(result))))
    return text if result.finished else f"Unfinished: the run was stopped, and this is what it had computed. {text}"
