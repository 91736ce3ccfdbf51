"""The steps of a study's run, in order: the compiled map, then each analysis from the results of those before it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsmaps.study.binding import Plan
from nsmaps.study.reading.head import Head as Study
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import Steps

SYSTEM = "system"  #: the first step


def analyses_by_step(study: Study) -> dict[str, Steps]:
    """The analyses of a study that compute something, by the names of their steps, in order."""
    return {analysis.name_of_step(): analysis for analysis in study.analyses().values() if analysis.computes()}


def compute_step(name: str, plan: Plan, result: StudyResult) -> dict[str, Any]:
    """The parts of the result that a step computes from those of earlier steps.

    The first compiles the exact map, or reads it from the cache, so that its time is not part of another's. An error is one at
    the section of the step, unless the analysis states a place in it.
    """
    if name != SYSTEM:
        analysis = analyses_by_step(plan.study)[name]
        with plan.study.source.located((analysis.key,)):
            found = analysis.compute(plan, result)
        return dict(found) if isinstance(found, Mapping) else {name: found}
    with plan.study.source.located(("system",)):
        plan.system.first_return(np.zeros((1, len(plan.system.coordinates))))
    return {}


def steps_of(study: Study) -> list[str]:
    """The names of the steps of a run of the study, in order."""
    return [SYSTEM, *analyses_by_step(study)]
