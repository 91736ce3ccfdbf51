"""What the parts of a study need of each other: sections, and names that were given elsewhere in it."""

from collections.abc import Iterator

from nsmaps.figures.catalogue import CATALOGUE
from nsmaps.study.sections import SECTIONS
from nsmaps.study.sections.base import Need
from nsmaps.study.study import Study


def check_references(study: Study) -> None:
    """A StudyError at the first name that refers to nothing or is given twice, or section whose need the study does not name."""
    for section in SECTIONS:
        if study.names(section.key):
            section.check(getattr(study, section.key), study)
    _check_figures(study)
    made = {key for each in SECTIONS if study.names(each.key) for key in each.stands_for(getattr(study, each.key))}
    for loc, what, key in _needs(study):
        if not study.names(key) and key not in made:
            raise study.source.error(loc, f"{what} needs the section {key!r}, which is missing")


def _check_figures(study: Study) -> None:
    """A StudyError at the first figure that would have nothing to show."""
    for number, figure in enumerate(study.figures):
        with study.source.located(("figures", number)):
            CATALOGUE[figure].check(study)


def _needs(study: Study) -> Iterator[Need]:
    """Every need as (where it arises, what has it, the section it is for)."""
    for section in SECTIONS:
        if study.names(section.key):
            yield from section.needs(getattr(study, section.key))
    for number, figure in enumerate(study.figures):
        for key in CATALOGUE[figure].sections:
            yield ("figures", number), f"the figure {figure!r}", key
    for verdict, keys in (("covered", ("composite", "grid")), ("tolerance", ("partition",))):
        if verdict in study.require:
            for key in keys:
                yield ("require",), f"the verdict {verdict!r}", key
