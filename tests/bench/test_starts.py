"""The time to a first result: programs beside what their imports take, as a table."""

import os
import re
import time

import pytest
from messages import message

from nsmaps.bench import starts
from nsmaps.bench.starts import Clock, Start, StartResult
from nsmaps.errors import NsmapsError

BUSY = "import os\nend = os.times().user + {}\nwhile os.times().user < end: sum(range(10_000))"


def test_user_time_is_that_of_the_program_and_not_of_what_it_waits_for(tmp_path):
    clock = Clock(tmp_path, os.environ)
    assert clock.user("-c", "import time; time.sleep(0.5)") < clock.user("-c", BUSY.format(0.2))


def test_shares_are_of_the_imports_before_and_after(tmp_path, monkeypatch):
    taken = iter([1.0, 6.0, 2.0, 9.0, 1.0])  # imports before, between and after two turns of a program
    monkeypatch.setattr(Clock, "user", lambda *_: next(taken))
    found = Clock(tmp_path, os.environ).take("busy", turns=2)
    assert found.seconds == (6.0, 9.0)
    assert found.shares == (6.0 / 1.5, 9.0 / 1.5)
    assert found.share == 5.0


def test_a_program_that_fails_is_told_with_what_it_said(tmp_path):
    with pytest.raises(NsmapsError, match=message("bench.ended", number=3)):
        Clock(tmp_path, os.environ).user("-c", "import sys; sys.stderr.write('no such luck'); sys.exit(3)")


def test_programs_have_the_environment_that_is_given(tmp_path):
    """That of the shell, in which I is what a user would take, and not what this process has set for itself."""
    program = "import os, sys; sys.exit(3 * ('OPENBLAS_NUM_THREADS' in os.environ))"
    assert Clock(tmp_path, {"PATH": os.environ["PATH"]}).user("-c", program) >= 0
    with pytest.raises(NsmapsError, match=message("bench.ended", number=3)):
        Clock(tmp_path, {"OPENBLAS_NUM_THREADS": "1"}).user("-c", program)


def test_the_unit_imports_what_is_there():
    exec(starts.IMPORTS, {})


def test_a_study_is_told_with_its_steps(tmp_path, monkeypatch):
    """A run without figures, its kernels compiled before."""
    monkeypatch.setattr(starts, "IMPORTS", BUSY.format(0.05))  # more than the resolution of user times
    begun = time.perf_counter()
    taken = Clock(tmp_path, os.environ).study("fits", "--no-figures", "--no-report")
    spent = time.perf_counter() - begun
    assert taken.name == "run vi_pair/fits --no-figures --no-report"
    assert {"system", "surfaces", "diagonal", "composite"} <= set(taken.steps)
    assert 0 < sum(taken.steps.values()) < spent


def test_a_formula_known_and_edited(tmp_path):
    """Both have a first return, after another time; two thirds of the gravity bring the ball back later."""
    times = []
    for divisor in (2, 3):
        (tmp_path / "ball.py").write_text(starts.FORMULA.format(divisor=divisor))
        namespace: dict[str, object] = {}
        exec(compile((tmp_path / "ball.py").read_text(), "ball.py", "exec"), namespace)
        ball = namespace["Ball"](Gamma=2.0)
        times.append(ball.first_return([[3.0, 1.0]]).time[0])
    assert times[1] > times[0]


def test_the_table_has_multiples_seconds_and_steps():
    rows = (
        Start("run vi_pair/fp --no-figures", (2.4, 2.8, 2.6), (2.5, 2.9, 2.7), {"system": 0.41, "domains": 1.26}),
        Start("first return, formula edited", (9.0,), (9.4,)),
    )
    table = StartResult(rows, 1.04).table()
    assert "| run vi_pair/fp --no-figures | 2.6 | 2.7 | system 0.4, domains 1.3 |" in table
    assert "| first return, formula edited | 9.0 | 9.4 |  |" in table
    assert re.search(r"1\.04 s here.*\n", table)


def test_no_turns_are_refused():
    with pytest.raises(NsmapsError, match=message("bench.turns", number=0)):
        starts.start(n_turns=0)
