"""The result of a run in a few sentences and numbers: what its analyses found, each of a map, with the kind of evidence."""

import re

from nsmaps.study.conclusions.texts import as_computed, count_of, counted
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Finding, concluding

PARAMETERS = "optimize", "observe", "parameter_plane", "bifurcation_diagram", "branches", "lyapunov"
STATES = "basins", "orbits", "manifolds", "noise", "domains", "morse_sets", "partition", "parametric_map", "composite"
#: keys of analyses in the order of a headline; others are in it where there is none of these
FIRST = (*PARAMETERS, "global_continuation", *STATES, "exit_times")
MOST = 3  #: findings in a headline
EACH = 3  #: numbers of one of them, unless there are too few of others
NAME = re.compile(r"\b(\d+):(\d+)/(\d*)T\b")  #: of a motion, n:m/pT
DECIMAL = re.compile(r"-?[0-9.]+(e-?[0-9]+)?")  #: a number alone


def findings(result: StudyResult) -> list[Finding]:
    """What the analyses of a run found: the first of each, then more; those of other packages lead, then it is as in `FIRST`.

    Basins say what orbits would, and first returns and maps in their place are silent where there is more.
    """
    others = result.study.others()
    analyses = {each.key: each for each in concluding(result)}
    order = [*others, *FIRST, *analyses]
    found = {key: list(analyses[key].findings(result)) for key in dict.fromkeys(order) if key in analyses}
    if found.get("basins"):
        found.pop("orbits", None)
    leading = [some for key, some in found.items() if some and (key in FIRST or key in others)]
    chosen = leading or [some for some in found.values() if some]
    return [*(some[0] for some in chosen), *(finding for some in chosen for finding in some[1:])]


def headline(result: StudyResult) -> str:
    """The main findings, by the map of which each is true, and what the first name of a motion means; empty without any."""
    texts: dict[str, list[str]] = {}
    for finding in findings(result)[:MOST]:
        texts.setdefault(as_computed(result, finding.of), []).append(as_computed(result, finding.text))
    text = " ".join(f"{_sentence(of)}: {'. '.join([parts[0], *map(_sentence, parts[1:])])}." for of, parts in texts.items())
    name = NAME.search(text)
    return f"{text} {meaning(*name.groups())}" if name else text


def _sentence(text: str) -> str:
    """A text with a capital letter at its beginning."""
    return text[:1].upper() + text[1:]


def meaning(returns: str, others: str, periods: str) -> str:
    """What the name n:m/pT of a motion stands for, as a sentence.

    >>> meaning("1", "2", "")
    '1:2/T: one return to the section and two other impacts in one period of the forcing.'
    """
    parts = count_of(int(returns), "return"), f"{counted(int(others))} other impact{'s' * (int(others) != 1)}"
    time = count_of(int(periods or 1), "period")
    return f"{returns}:{others}/{periods}T: {parts[0]} to the section and {parts[1]} in {time} of the forcing."


def key_numbers(result: StudyResult, max_numbers: int) -> list[tuple[str, str]]:
    """The main numbers of the findings with their meanings: `EACH` of one, then, where there is room, more of them.

    A number that another finding has to more digits is left out.
    """
    found = findings(result)
    whole = list(dict.fromkeys(number for finding in found for number in finding.numbers))
    every = [number for number in whole if not any(_is_rounded(number, other) for other in whole)]
    first = [number for number in every if any(number in finding.numbers[:EACH] for finding in found)]
    chosen = [*first, *(number for number in every if number not in first)][:max_numbers]
    return [(value, as_computed(result, text)) for value, text in every if (value, text) in chosen]


def _is_rounded(number: tuple[str, str], other: tuple[str, str]) -> bool:
    """Whether a number is another one of the same meaning with fewer digits.

    >>> _is_rounded(("a = 1.52682", "period doubling"), ("a = 1.5268237", "period doubling of 1:0/T"))
    True
    """
    (value, text), (longer, more) = number, other
    if len(value) >= len(longer) or not more.startswith(text):
        return False
    (name, _, few), (same, _, many) = value.partition(" = "), longer.partition(" = ")
    return bool(name == same and DECIMAL.fullmatch(few) and DECIMAL.fullmatch(many)) and f"{float(many):.6g}" == few
