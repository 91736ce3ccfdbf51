"""The objects that a study describes: system, grid, regions and fits; an error names the line that is wrong."""

from collections.abc import Iterator

from nsmaps.errors import SystemDefinitionError, UnknownSystemError
from nsmaps.exact.systems.parameters import System
from nsmaps.plugins import system_class
from nsmaps.reduced.conditions.condition import as_number
from nsmaps.study.binding import Binding, Plan
from nsmaps.study.pictures.catalogue import figures_of
from nsmaps.study.sections.base import Need
from nsmaps.study.study import Study


def prepare(study: Study) -> Plan:
    """The study's objects; raises StudyError at the first line that is not consistent with the system or the study."""
    binding = Binding(study, _system(study))
    _check_references(study)
    bound = {}
    for key, analysis in study.analyses().items():
        with study.source.located((key,)):
            bound[key] = analysis.bind(binding)
    return Plan(study, binding.system, bound)


def _system(study: Study) -> System:
    source = study.source
    try:
        cls = system_class(study.system)
    except (UnknownSystemError, SystemDefinitionError) as error:
        raise source.error(("system",), str(error)) from error
    texts = set(cls.model_fields) - set(cls.parameter_names())  # fields that are not numbers, such as choices and switches
    for name in [name for name in study.parameters if name not in texts]:
        with source.located(("parameters", name)):
            as_number(study.parameters[name])
    with source.located(("parameters",) if study.parameters else ("system",), cls):
        system = study.system_object()
    with source.located(("system",)):
        system.coordinates  # noqa: B018 - a system with modes reads its formulas for them
    return system


def _check_references(study: Study) -> None:
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
