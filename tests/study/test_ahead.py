"""Code of later steps is compiled by another process: the right code, started once, waited for, and never left behind."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from nsmaps.exact.compiling import compiled
from nsmaps.study import ahead
from nsmaps.study.prepare import prepare
from nsmaps.study.reading.reader import load_study

SAME_CODE = """
import gc, sys
from numba.core.registry import CPUDispatcher
from nsmaps.exact.compiling.compiled import _Kept
from nsmaps.study import ahead
from nsmaps.study.prepare import prepare
from nsmaps.study.reading.reader import load_study
from nsmaps.study.run import run_study

def compiled():
    return {(f.__module__, f.__name__, str(s)) for f in gc.get_objects() if isinstance(f, CPUDispatcher)
            and isinstance(f._cache, _Kept) for s in f.signatures}

name, calls = sys.argv[1], sys.argv[2].split()
study = load_study(name)
domains = tuple(each.model_copy(update={"updates": 1}) for each in study.domains)
grid = study.grid and {name: axis.model_copy(update={"points": 100}) for name, axis in study.grid.items()}
study = study.model_copy(update={"domains": type(study.domains)(domains), "grid": grid and type(study.grid)(grid)})
system = prepare(study).system
system.first_return([[0.5] * len(system.coordinates)])
for each in calls:
    getattr(ahead, each)(system)
before = compiled()
run_study(study)
after = {each for each in compiled() if "composite" in each[0] or "enclosure" in each[0] or "noise" in each[0]}
assert after, "the study calls none of this"
assert after <= before, after - before
"""


@pytest.mark.parametrize(
    ("study", "calls"),
    [
        ("vi_pair/fp", "call_composite call_boxes"),
        pytest.param("soft_impact/domain", "call_boxes", marks=pytest.mark.thorough),
    ],
)
def test_steps_call_the_code_that_was_compiled_ahead(study, calls):
    assert [call.__name__ for call in ahead.calls_of(load_study(study))] == calls.split()
    subprocess.run([sys.executable, "-c", SAME_CODE, study, calls], check=True, capture_output=True, text=True)


@pytest.fixture
def sleeper(monkeypatch):
    """A process that ends when it is told to, in place of the one that compiles; those that were started."""
    started = []

    def start(system, names):
        started.append(subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE))
        return started[-1:]

    monkeypatch.setattr(ahead, "_started", start)
    monkeypatch.setattr(ahead.os, "cpu_count", lambda: 2)
    yield started
    for each in started:
        each.kill()


def miss():
    """What happens where compiled code is not in the folder."""
    for each in [*compiled.missing]:
        each()


def test_the_process_starts_once_with_the_first_missing_code(sleeper):
    with ahead.compiling_ahead(prepare(load_study("vi_pair/fp")), lambda: True):
        assert not sleeper
        miss()
        miss()
        assert len(sleeper) == 1
    assert not compiled.missing


def test_a_process_that_is_not_needed_any_more_is_stopped(sleeper):
    with ahead.compiling_ahead(prepare(load_study("vi_pair/fp")), lambda: True):
        miss()
    assert sleeper[0].poll() is not None
    assert not compiled.missing


def test_nothing_is_started_for_code_that_is_missing_later(sleeper):
    with ahead.compiling_ahead(prepare(load_study("vi_pair/fp")), lambda: False):
        miss()
    assert not sleeper


def test_nothing_is_started_for_a_study_whose_steps_need_no_more_code(sleeper):
    with ahead.compiling_ahead(prepare(load_study("vi_pair/motion")), lambda: True):
        miss()
    assert not sleeper


def test_a_system_that_cannot_be_sent_is_left_to_the_run():
    assert ahead._started(SimpleNamespace(formula=lambda: 0), ["boxes"]) == []
