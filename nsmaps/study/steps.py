"""The steps of a study's run, in order; each computes fields of the result from those before it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsmaps.study.binding import Plan
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Section
from nsmaps.study.sections.registry import SECTIONS
from nsmaps.study.study import Study


def _system(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """The compiled map, compiled or read from the cache, as a separate step so that its time is not part of another's."""
    with plan.study.source.located(("system",)):
        plan.system.first_return(np.zeros((1, len(plan.system.coordinates))))
    return {}


@dataclass(frozen=True, slots=True)
class _Step:
    """The step of one section."""

    section: Section[Any]

    def __call__(self, plan: Plan, result: StudyResult) -> dict[str, Any]:
        assert self.section.compute is not None
        return self.section.compute(getattr(plan.study, self.section.key), plan, result)


STEPS: dict[str, Callable[[Plan, StudyResult], dict[str, Any]]] = {
    "system": _system,
    **{section.name: _Step(section) for section in SECTIONS if section.compute},
}
SECTION = {section.name: section for section in SECTIONS if section.compute}  #: by the name of its step


def steps_of(study: Study) -> list[str]:
    """The names of the steps of a run of the study, in order."""
    return [name for name in STEPS if name == "system" or study.names(SECTION[name].key)]
