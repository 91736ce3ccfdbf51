"""From a study to the objects that it describes: system, grid, regions and fits; an error names the line that is wrong."""

from nsmaps.errors import SystemDefinitionError, UnknownSystemError
from nsmaps.exact.systems.parameters import System
from nsmaps.plugins import system_class
from nsmaps.reduced.conditions.condition import as_number
from nsmaps.study.binding import Binding, Plan
from nsmaps.study.reading.references import check_references
from nsmaps.study.study import Study


def prepare(study: Study) -> Plan:
    """The study's objects; raises StudyError at the first line that is not consistent with the system or the study."""
    binding = Binding(study, _system(study))
    check_references(study)
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
