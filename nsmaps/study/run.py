"""From a study to its result: only what it names is computed, each step from those before it."""

import os
import shutil
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from nsmaps.errors import NsmapsError, StudyError
from nsmaps.interrupts import heard
from nsmaps.plugins import is_file
from nsmaps.progress import working
from nsmaps.storage import missing_of, remove_empty
from nsmaps.study.binding import Plan, prepare
from nsmaps.study.limits import check_sizes
from nsmaps.study.reading.reader import check_installed, load_study
from nsmaps.study.result import StudyResult
from nsmaps.study.steps import STEPS, steps_of
from nsmaps.study.store.archive import BrokenRun, read_result, versions_of, write
from nsmaps.study.store.checkpoint import PARTS, keep_step, with_steps
from nsmaps.study.store.run_folder import check_folder, writable
from nsmaps.study.study import Study
from nsmaps.study.verdict import verdicts

Progress = Callable[
    [str, float, int], None
]  #: what is being computed, how many steps are done and which share of it, of how many
ALMOST = 0.999  #: the largest share of a step that is told before it is done


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a run: `result` holds the steps that were finished, `folder` is where they were written, if any."""

    def __init__(self, result: StudyResult, folder: Path | None) -> None:
        self.result = result
        self.folder = folder


def run(
    study: Study | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    resume: bool = False,
    *,
    installed_only: bool = False,
    max_memory: float | None = None,
    max_hours: float | None = None,
) -> StudyResult:
    """Compute what a study names, and write it to the folder `out`, if one is given.

    With `resume` the steps that a stopped run of the same study left in that folder are read from it, not computed again, and of
    the step that it stopped in the finished parts: those of diagrams, exponents, basins and noise of the exact map.

    A study whose system is a class in a file runs that file; with `installed_only` it is refused. A run that is estimated to need
    more than `max_memory` gigabytes or `max_hours` on one core is refused before anything is computed: by default more than the
    environment variables `NSMAPS_MAX_MEMORY` and `NSMAPS_MAX_HOURS` say, else the memory of the machine and 24 hours.

    `progress` is called with the step, how many are done with the share of it, and how many there are; without one a line on a
    terminal says so.

    What an earlier run of the study left in the folder is replaced, with all that the commands drew and exported from it.

    Raises StudyError for a study that cannot be run; NsmapsError for a folder that holds a run of another study, or, to be
    resumed, of other versions; Interrupted on Ctrl-C. When a step is stopped, or fails for no fault of the study, those before it
    have been written.
    """
    study = study if isinstance(study, Study) else load_study(study, installed_only=installed_only)
    with working(study.name, progress) as work:

        def line(what: str, done: float, total: int) -> None:
            work.step_to(f"{what} ({min(int(done) + 1, total)} of {total})", done / total)

        return _run(study, out, progress or line, resume, installed_only, max_memory, max_hours)


def _run(
    study: Study,
    out: str | os.PathLike[str] | None,
    progress: Progress,
    resume: bool,
    installed_only: bool,
    max_memory: float | None,
    max_hours: float | None,
) -> StudyResult:
    if installed_only:
        check_installed(study)
    plan = prepare(study)
    check_sizes(study, plan.system, max_memory, max_hours)
    folder = None if out is None else Path(out)
    if folder:
        check_folder(folder, study.name)
    result = StudyResult(study, plan.system, versions=versions_of(study.system))
    if resume and folder and (folder / "result.json").is_file():
        result = _kept(result, folder)
    names = steps_of(study)
    if folder and resume:
        result = with_steps(result, names, folder)
    elif folder:
        shutil.rmtree(folder / PARTS, ignore_errors=True)
    missing = missing_of(folder / PARTS) if folder else []
    try:
        with heard() as stopped:
            for done, name in enumerate(names):
                progress(name, done, len(names))
                if name not in result.timings:
                    keep = folder and folder / PARTS / name
                    told = _share(progress, stopped, name, done, len(names))
                    result = _with_step(replace(plan, told=told, keep=keep), result, name, folder)
                stopped()
            progress("done", len(names), len(names))
            timings = {name: result.timings[name] for name in names} | result.timings  # in the order of the steps
            result = replace(result, timings=timings, verdicts=verdicts(result), finished=True)
    except KeyboardInterrupt:
        raise Interrupted(_unfinished(result, folder), folder) from None
    except StudyError:  # what is kept of a study that is refused helps no later run
        for parts in missing[:1]:
            shutil.rmtree(parts, ignore_errors=True)
        remove_empty(missing[1:])
        raise
    except Exception:
        if result.timings:
            _unfinished(result, folder)
        raise
    if folder:
        _write(result, folder)
    return result


def _unfinished(result: StudyResult, folder: Path | None) -> StudyResult:
    """The result of the steps that are finished, with its verdicts, written if there is a folder."""
    result = replace(result, verdicts=verdicts(result))
    if folder:
        _write(result, folder)
    return result


def _write(result: StudyResult, folder: Path) -> None:
    """Write a result, and only then let go of the parts of its steps."""
    with writable(folder):
        write(result, folder)
    if result.finished:
        shutil.rmtree(folder / PARTS, ignore_errors=True)
        return
    for name in result.timings:
        shutil.rmtree(folder / PARTS / name, ignore_errors=True)
        with suppress(OSError):  # not there
            (folder / PARTS / f"{name}.npz").unlink()
    with suppress(OSError):  # not there, or with parts of a step that was stopped
        (folder / PARTS).rmdir()


def _share(progress: Progress, stopped: Callable[[], None], name: str, done: int, total: int) -> Callable[[float], None]:
    """What a step tells of itself, told as part of the run, which ends there if it was stopped."""

    def told(share: float) -> None:
        progress(name, done + min(share, ALMOST), total)
        stopped()

    return told


def _with_step(plan: Plan, result: StudyResult, name: str, folder: Path | None) -> StudyResult:
    """The result with what one step computes, and its time; kept in the folder, if there is one."""
    begun = perf_counter()
    changes = STEPS[name](plan, result)
    result = replace(result, **changes, timings={**result.timings, name: perf_counter() - begun})
    if folder:
        with writable(folder):
            keep_step(result, name, changes, folder)
    return result


def _kept(new: StudyResult, folder: Path) -> StudyResult:
    """The result in a folder, if it is one of the same study by the same versions."""
    try:
        kept = read_result(folder, installed_only=not is_file(new.study.system))
    except BrokenRun as error:
        warnings.warn(f"{error}; all of it is computed again", RuntimeWarning, stacklevel=2)
        return new
    for what, same in (("study", kept.study == new.study), ("versions", kept.versions == new.versions)):
        if not same:
            raise NsmapsError(
                f"{folder} holds a run of {kept.study.name!r} with another {what} than {new.study.name!r} now; expected: "
                "the same study, system and versions, or a run from the beginning"
            )
    return kept
