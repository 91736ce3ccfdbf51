"""What `nsmaps check` says: something of every step of every study, how much work it is, and whether the formula starts right."""

import re
from pathlib import Path

import pytest
from ball import BALL
from typer.testing import CliRunner

from nsmaps import load_study, plugins
from nsmaps.cli.cli import app
from nsmaps.study.conclusions.summary import about
from nsmaps.study.sections.base import Steps
from nsmaps.study.study import Study

SHIPPED = [name for name in plugins.study_names() if name.split("/")[0] in ("vi_pair", "bouncing_ball", "impact_oscillator")]


def test_every_step_is_described() -> None:
    assert [key for key, kind in Study.kinds().items() if kind.computes() and kind.describe is Steps.describe] == []


@pytest.mark.parametrize("name", SHIPPED)
def test_nothing_is_named_with_nothing_behind(name: str) -> None:
    assert all(about(load_study(name)).values())


LONG = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0, to: 1, points: 20}, phi: {from: 0, to: 6, points: 30}}
bifurcation_diagram:
  {parameter: a, from: 0.2, to: 0.4, points: 3, starts: [{v: 1, phi: 1}], transient: 10, n_returns: 4, direction: both}
lyapunov: {parameter: a, from: 0.2, to: 0.4, points: 5, starts: [{v: 1, phi: 1}], transient: 100, n_returns: 50}
basins: {max_returns: 7}
noise:
  {sigma: [0, 0.1], tau: 0.5, start: {v: 1, phi: 1}, n_returns: 12, n_realisations: 3, modes: {one: [BB]},
   impacts: {parameter: a, from: 0.2, to: 0.4, points: 2, sigma: 0.1, n_returns: 5, transient: 6}}
"""


def test_the_long_run_says_parameter_range_points_and_returns() -> None:
    Path("s.yaml").write_text(LONG)
    told = about(load_study("s.yaml"))
    assert told["bifurcation_diagram"] == f"3 values of a from 0.2 to 0.4, 10 + 4 returns each of exact; {3 * 14 * 2} returns"
    assert told["lyapunov"] == f"5 values of a from 0.2 to 0.4, 100 + 50 returns each; {5 * 150} returns with derivatives"
    assert told["basins"] == "20 x 30 states, up to 7 returns each; at most 4,200 returns"
    assert told["noise"] == (
        "2 amplitudes, 3 realisations of 12 returns each, and impacts at 2 values of a from 0.2 to 0.4, 6 + 5 returns each; "
        f"{2 * 3 * 12 + 4 * 2 * 11} returns"
    )


WRONG = [
    ("- self.a * (sp.sin(t) - sp.sin(hit.t))", "- self.a * sp.sin(t)", "does not start at hit.z: off by 0.3935"),
    ("(hit.w + self.a * sp.cos(hit.t)) * s", "hit.w * s", "does not start with the velocity hit.w: off by 0.5001"),
]


@pytest.mark.parametrize(("right", "wrong", "says"), WRONG)
def test_check_refuses_a_displacement_that_starts_elsewhere(right: str, wrong: str, says: str) -> None:
    assert right in BALL
    Path("mine.py").write_text(BALL.replace(right, wrong))
    Path("s.yaml").write_text("# mine\nsystem: mine.py:Ball\nparameters: {a: 0.2}\n")
    line = next(number for number, text in enumerate(BALL.splitlines(), 1) if "def displacement" in text)
    answer = CliRunner().invoke(app, ["check", "s.yaml"])
    assert (answer.exit_code, answer.stdout) == (2, "")
    first, told = answer.stderr.split("\n", 1)
    assert first.startswith(f"executes {Path('mine.py').resolve()}:Ball, the file of the system")
    assert told.startswith(f"s.yaml:2:9: Ball.displacement {says}")
    assert re.search(rf" at a = 7/11, phi = 2/3 \({re.escape(str(Path('mine.py').resolve()))}:{line}\)\n$", answer.stderr)


def test_a_run_says_so_too_in_the_class_s_own_names() -> None:
    right, wrong, _ = WRONG[0]
    Path("mine.py").write_text(BALL.replace(right, wrong))
    Path("s.yaml").write_text("system: mine.py:Ball\nparameters: {a: 0.2}\n")
    answer = CliRunner().invoke(app, ["run", "s.yaml"])
    assert answer.exit_code == 2
    assert "s.yaml:1:9: Ball.displacement does not start at hit.z: off by " in answer.stderr
    assert " at a = 7/11, phi = 2/3 (" in answer.stderr
    assert "_p_" not in answer.stderr
    assert str(Path("mine.py").resolve()) in answer.stderr
    assert not Path("runs").exists()
