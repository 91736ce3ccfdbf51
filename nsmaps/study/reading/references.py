"""References between the parts of a study: required sections, and names that are defined elsewhere in it."""

from collections.abc import Iterator

from nsmaps.study.pictures.catalogue import figures_of
from nsmaps.study.sections.base import Need
from nsmaps.study.study import Study


def check_references(study: Study) -> None:
    """Raise StudyError at the first undefined or repeated name, or section whose required sections are missing."""
    for analysis in study.analyses().values():
        analysis.check(study)
    _check_figures(study)
    replaced = {key for analysis in study.analyses().values() for key in analysis.replaces()}
    for loc, what, key in _needs(study):
        if not study.names(key) and key not in replaced:
            raise study.source.error(loc, f"{what} needs the section {key!r}, which is missing")


def _check_figures(study: Study) -> None:
    """Raise StudyError at the first figure without data."""
    for number, figure in enumerate(study.figures):
        with study.source.located(("figures", number)):
            figures_of(study.kinds())[figure].check(study)


def _needs(study: Study) -> Iterator[Need]:
    """Every need as (place, part that needs, required section)."""
    for analysis in study.analyses().values():
        yield from analysis.needs()
    for number, figure in enumerate(study.figures):
        for key in figures_of(study.kinds())[figure].sections:
            yield ("figures", number), f"the figure {figure!r}", key
    for kind in study.kinds().values():
        for claim, keys in kind.claims.items():
            yield from ((("require",), f"the verdict {claim!r}", key) for key in keys if claim in study.require)
