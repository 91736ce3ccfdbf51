"""From a study to its result: the steps of its sections, each computed from the results of those before it."""

import os
import shutil
import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

from nsmaps.errors import NsmapsError, StudyError
from nsmaps.errors.arguments import checked
from nsmaps.files.storage import missing_of, remove_empty
from nsmaps.interrupts import Interrupted, heard
from nsmaps.parallel import Parallel
from nsmaps.plugins import is_installed
from nsmaps.progress import Progress, Work, working
from nsmaps.study.ahead import compiling_ahead
from nsmaps.study.binding import Plan
from nsmaps.study.conclusions.verdict import verdicts
from nsmaps.study.limits import check_sizes
from nsmaps.study.prepare import prepare
from nsmaps.study.reading.reader import check_installed, load_study
from nsmaps.study.result import StudyResult
from nsmaps.study.steps import compute_step, steps_of
from nsmaps.study.store.archive import BrokenRunError, read_result, versions_of, write
from nsmaps.study.store.checkpoint import keep_step, with_steps
from nsmaps.study.store.run_folder import PARTS, check_folder, writable
from nsmaps.study.study import Study


@checked
def run_study(
    study: Study | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    resume: bool = False,
    installed_only: bool = False,
    max_memory: float | None = None,
    max_hours: float | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> StudyResult:
    """Run a study, and write its result to the folder `out`, if one is given.

    The results of an earlier run of the study in this folder are replaced, and the figures and exports made from them are
    removed. If a step is stopped or fails for a reason outside of the study, the results of the steps before it are written.

    Args:
        study: a `Study`, the path of a YAML file, or the name of an installed study, such as `vi_pair/fp`.
        out: the folder of the run.
        resume: read the steps that a stopped run of the same study finished in this folder instead of computing them, and
            finished parts of the step in which it stopped: of diagrams, exponents, basins and noise of the exact map.
        installed_only: refuse a study with a class in a file or module, which would be executed.
        max_memory: refuse a run that is estimated to need more gigabytes, before anything is computed; by default the value of
            the environment variable `NSMAPS_MAX_MEMORY`, else the memory of the machine.
        max_hours: the same for hours on one core; by default the value of `NSMAPS_MAX_HOURS`, else 24.
        executor: where the parts of diagrams, planes, exponents, basins and noise run, as of `Parallel`; this process if omitted.
            The numbers are the same.
        progress: called with the fraction of the run that is finished, in which all steps count equally;
            `nsmaps.progress.outermost` returns the current step. By default both are shown on a terminal.

    Raises:
        StudyError: the study cannot be run, or is estimated to exceed a limit.
        NsmapsError: the folder contains a run of another study or, with `resume`, of other versions.
        Interrupted: on Ctrl-C, with the finished steps.
    """
    study = study if isinstance(study, Study) else load_study(study, installed_only=installed_only)
    if installed_only:
        check_installed(study)
    with working(study.name, progress) as work:
        plan = prepare(study)
        check_sizes(study, plan.system, max_memory, max_hours)
        folder = None if out is None else Path(out)
        if folder:
            check_folder(folder, study.name)
        return _Run(plan, folder, work, executor, _at_first(plan, folder, resume)).result_of_all()


def _at_first(plan: Plan, folder: Path | None, resume: bool) -> StudyResult:
    """The result before the first step: empty, or with the steps that a stopped run left in the folder."""
    study = plan.study
    result = StudyResult(study, plan.system, versions=versions_of(study))
    if folder and resume:
        result = _kept(result, folder) if (folder / "result.json").is_file() else result
        return with_steps(result, steps_of(study), folder)
    if folder:
        shutil.rmtree(folder / PARTS, ignore_errors=True)
    return result


@dataclass(slots=True)
class _Run:
    """A run in progress: each step adds to its result."""

    plan: Plan
    folder: Path | None
    work: Work
    executor: Executor | None
    result: StudyResult

    def result_of_all(self) -> StudyResult:
        """The result of all steps, written if there is a folder; the finished steps are also written if the run is stopped."""
        missing = missing_of(self.folder / PARTS) if self.folder else []
        try:
            self._all_steps()
        except KeyboardInterrupt:
            raise Interrupted(_unfinished(self.result, self.folder), self.folder) from None
        except StudyError:  # finished steps of a study with an error are of no use
            for parts in missing[:1]:
                shutil.rmtree(parts, ignore_errors=True)
            remove_empty(missing[1:])
            raise
        except Exception:
            if self.result.timings:
                _unfinished(self.result, self.folder)
            raise
        if self.folder:
            _write(self.result, self.folder)
        return self.result

    def _all_steps(self) -> None:
        names = steps_of(self.plan.study)
        with heard() as stopped, compiling_ahead(self.plan, lambda: not self.result.timings):
            for number, name in enumerate(names):
                self.work.at(name, number, len(names))
                if name not in self.result.timings:
                    self._step(name, number, len(names), stopped)
                stopped()
            timings = {name: self.result.timings[name] for name in names} | self.result.timings  # in the order of the steps
            self.result = replace(self.result, timings=timings, verdicts=verdicts(self.result), finished=True)

    def _step(self, name: str, number: int, steps: int, stopped: Callable[[], None]) -> None:
        """Compute one step, and add its result and its time; written to the folder, if there is one."""

        def progress(share: float) -> None:
            self.work.at(name, number, steps, share)
            stopped()

        begun = perf_counter()
        with working(name, progress) as step:
            parallel = Parallel(self.executor, self.folder and self.folder / PARTS / name, progress=step.reached)
            changes = compute_step(name, replace(self.plan, parallel=parallel), self.result)
        timings = {**self.result.timings, name: perf_counter() - begun}
        self.result = replace(self.result.with_parts(changes), timings=timings)
        if self.folder:
            with writable(self.folder):
                keep_step(self.result, name, changes, self.folder)


def _unfinished(result: StudyResult, folder: Path | None) -> StudyResult:
    """The result of the steps that are finished, with its verdicts, written if there is a folder."""
    result = replace(result, verdicts=verdicts(result))
    if folder:
        _write(result, folder)
    return result


def _write(result: StudyResult, folder: Path) -> None:
    """Write a result, then remove the parts of its steps."""
    with writable(folder):
        write(result, folder)
    if result.finished:
        shutil.rmtree(folder / PARTS, ignore_errors=True)
        return
    for name in result.timings:
        shutil.rmtree(folder / PARTS / name, ignore_errors=True)
        with suppress(OSError):  # missing
            (folder / PARTS / f"{name}.npz").unlink()
    with suppress(OSError):  # missing, or with parts of a step that was stopped
        (folder / PARTS).rmdir()


def _kept(new: StudyResult, folder: Path) -> StudyResult:
    """The result in a folder; raises NsmapsError if it is of another study or of other versions."""
    try:
        kept = read_result(folder, installed_only=all(map(is_installed, new.study.classes().values())))
    except BrokenRunError as error:
        warnings.warn(f"{error}; all steps are computed again", RuntimeWarning, stacklevel=2)
        return new
    for what, same in (("study", kept.study == new.study), ("versions", kept.versions == new.versions)):
        if not same:
            raise NsmapsError(
                f"{folder} holds a run of {kept.study.name!r} with another {what} than {new.study.name!r} now; expected: "
                "the same study, system and versions, or a run from the beginning"
            )
    return kept
