"""From a study to its result: only what it names is computed, each step from those before it."""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from nsmaps.study.archive import versions_of, write
from nsmaps.study.plan import prepare
from nsmaps.study.reader import load_study
from nsmaps.study.result import StudyResult
from nsmaps.study.spec import Study
from nsmaps.study.steps import STEPS, steps_of
from nsmaps.study.verdicts import verdicts

Progress = Callable[[str, int, int], None]  #: what is being computed, how many steps are done, of how many


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a run: `result` holds the steps that were finished, `folder` is where they were written, if any."""

    def __init__(self, result: StudyResult, folder: Path | None) -> None:
        self.result = result
        self.folder = folder


def run(
    study: Study | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    progress: Progress = lambda what, done, total: None,
) -> StudyResult:
    """Compute what a study names, and write it to the folder `out`, if one is given.

    Raises StudyError for a study that cannot be run, in which case nothing is written; Interrupted on Ctrl-C, when what
    is finished has been written.
    """
    study = study if isinstance(study, Study) else load_study(study)
    plan = prepare(study)
    folder = None if out is None else Path(out)
    result = StudyResult(study, plan.system, versions=versions_of(study.system))
    names = steps_of(study)
    try:
        for done, name in enumerate(names):
            progress(name, done, len(names))
            begun = perf_counter()
            parts = STEPS[name](plan, result)
            result = replace(result, **parts, timings={**result.timings, name: perf_counter() - begun})
        progress("done", len(names), len(names))
        result = replace(result, verdicts=verdicts(result), finished=True)
    except KeyboardInterrupt:
        result = replace(result, verdicts=verdicts(result))
        if folder:
            write(result, folder)
        raise Interrupted(result, folder) from None
    if folder:
        write(result, folder)
    return result
