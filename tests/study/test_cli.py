"""The command line: what it prints, where it writes, and the code it ends with."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.plugins import study_names
from nsmaps.study.sections.longrun.orbits import Orbits
from nsmaps.study.store.archive import FORMAT

ORBIT = "system: ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, n_returns: 3}]\n"
SQUARED = """
import sympy as sp
from nsmaps import HybridSystem, PoincareSection

class Squared(HybridSystem):
    \"\"\"A guard of half the frequency.\"\"\"

    k: float
    states = ("x",)

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"free": {"x": sp.cos(t) - self.k * y.x**2}}

    def section(self, t, y):
        return PoincareSection("s", ("x",))

    def guards(self, t, y):
        from nsmaps import Guard

        return {"s": Guard("free", -sp.sin(t / 2))}
"""


def test_systems_are_listed_with_parameters_and_studies() -> None:
    answer = CliRunner().invoke(app, ["systems"])
    assert answer.exit_code == 0
    text = answer.stdout[answer.stdout.index("ball: ") :]
    assert text.splitlines()[:5] == [
        "ball: Ball on a table that moves as a sin t.",
        "  a        amplitude of the table, in units of gravity",
        "  r        restitution coefficient (default 0.8)",
        "  mode      (default plain)",
        "  studies: ball/drop",
    ]


def test_check_says_what_would_be_computed() -> None:
    answer = CliRunner().invoke(app, ["check", "ball/drop"])
    assert answer.exit_code == 0
    *lines, estimated = answer.stdout.splitlines()
    assert estimated.startswith("  estimated, to a factor of ten: 2 s on one core and ")
    assert lines == [
        "ball/drop: The ball",
        "  system: ball (a = 0.2, r = 0.5); states (v, phi)",
        "  surfaces: low over 31 x 41 states",
        "  composite: slow (fit of low), fast (reset)",
        "  orbits: 5 returns",
        "  domains: exact (map exact, 2 updates)",
        "  required: covered",
    ]
    assert list(Path().iterdir()) == []


@pytest.mark.parametrize("name", [name for name in study_names() if not name.startswith("ball/")])
def test_every_installed_study_is_checked(name) -> None:
    answer = CliRunner().invoke(app, ["check", name])
    assert answer.exit_code == 0, answer.output
    assert answer.stdout.startswith(f"{name}: ")
    assert [line for line in answer.stdout.splitlines() if line.rstrip().endswith(":")] == [], (
        "nothing is named with nothing behind"
    )


def test_check_refuses_the_formulas_of_a_system_with_modes() -> None:
    Path("squared.py").write_text(SQUARED)
    orbit = "orbits: [{start: {x: 0.5}, n_returns: 1}]"
    Path("squared.yaml").write_text(f"system: squared.py:Squared\nparameters: {{k: 1}}\n{orbit}\n")
    answer = CliRunner().invoke(app, ["check", "squared.yaml"])
    assert answer.exit_code == 2
    assert "squared.yaml:1" in answer.output
    assert "squared.py:20" in answer.output
    assert "not the same after one `period`" in answer.output


def test_run_writes_under_runs_and_ends_with_the_verdicts() -> None:
    answer = CliRunner().invoke(app, ["run", "ball/drop"])
    assert answer.exit_code == 0, answer.output
    assert (Path("runs/ball/drop") / "result.json").is_file()
    lines = answer.stdout.splitlines()
    assert lines[-2:] == ["report  runs/ball/drop/report.html", "data    runs/ball/drop/result.json"]
    lines = CliRunner().invoke(app, ["show", "runs/ball/drop", "--verdicts"]).stdout.splitlines()
    words = ["covered", "composite", "map", "yes", "yes", "every", "state", "of", "the", "grid", "lies", "in", "a", "piece"]
    (covered,) = [line for line in lines if line.split()[:1] == ["covered"]]
    assert covered.split() == words
    assert "\x1b" not in answer.output
    assert answer.stderr == ""


def test_a_required_verdict_that_fails_is_exit_code_one(good: str) -> None:
    Path("s.yaml").write_text(good.replace("where: v > 0.2,", "where: v > 0.3,"))
    answer = CliRunner().invoke(app, ["run", "s.yaml", "--out", "here"])
    assert answer.exit_code == 1
    assert "of the grid lies in no piece" in answer.stdout
    assert Path("here/result.json").is_file()
    Path("t.yaml").write_text(Path("s.yaml").read_text().replace("require: [covered]\n", ""))
    assert CliRunner().invoke(app, ["run", "t.yaml", "--out", "there"]).exit_code == 0


def test_quiet_is_quiet() -> None:
    Path("s.yaml").write_text(ORBIT)
    answer = CliRunner().invoke(app, ["run", "s.yaml", "-q"])
    assert (answer.exit_code, answer.output) == (0, "")


def test_figures_are_drawn_and_drawn_again() -> None:
    domain = "domains: [{name: d, map: exact, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}]\n"
    Path("s.yaml").write_text(ORBIT + domain + "figures: [domain_size]\n")
    assert CliRunner().invoke(app, ["run", "s.yaml", "--no-figures"]).exit_code == 0
    assert not Path("runs/s/figures").exists()
    assert CliRunner().invoke(app, ["run", "s.yaml"]).exit_code == 0
    assert [path.suffix for path in Path("runs/s/figures").iterdir()] == [".png"]
    answer = CliRunner().invoke(app, ["figures", "runs/s", "--format", "svg"])
    assert answer.exit_code == 0
    (line,) = answer.stdout.split()
    assert Path(line).read_text().startswith("<?xml")


def test_figures_in_grey_say_what_looks_alike(tmp_path: Path) -> None:
    """Of the envelopes a grey line of 0.4 and blue #0072B2 have L* 43.2 and 46.0 (CIE 15); the sizes have one line."""
    run = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "run"
    only = ("--only", "domain_size", "--only", "envelopes")
    answer = CliRunner().invoke(app, ["figures", str(run), *only, "--grey", "--out", str(tmp_path), "--dpi", "30"])
    assert answer.exit_code == 0
    names = {path.name for path in tmp_path.iterdir()}
    assert {"domain_size.png", "grey-domain_size.png", "grey-envelopes.png", "grey-envelopes.txt"} <= names
    assert "grey-domain_size.txt" not in names
    told = " ".join(answer.stdout.split())
    assert "alike in grey: 'upper map' and 'orbit, both maps in turn' differ by 2.8 of 100 in lightness" in told


def test_figures_of_no_run() -> None:
    answer = CliRunner().invoke(app, ["figures", "nowhere"])
    assert answer.exit_code == 2
    assert answer.stderr == "nowhere contains no result.json; expected: a folder written by `nsmaps run`\n"


def test_the_module_is_the_program() -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "nsmaps", "--version"]
    answer = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (answer.returncode, answer.stderr) == (0, "")
    assert answer.stdout.startswith("nsmaps ")
    assert CliRunner().invoke(app, ["run"]).exit_code == 2
    assert CliRunner().invoke(app, ["run", "ball/drop", "--style", "jurnal"]).exit_code == 2
    assert not Path("runs").exists()
    help_text = CliRunner().invoke(app, ["--help"])
    assert help_text.exit_code == 0
    assert all(command in help_text.stdout for command in ("systems", "check", "run", "figures"))
    assert "\x1b" not in help_text.stdout
    of_run = CliRunner().invoke(app, ["run", "--help"]).stdout
    assert "--no-figures" in of_run
    assert "bool" not in help_text.stdout + of_run.lower()


@pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")
def test_ctrl_c_says_what_was_kept(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("s.yaml").write_text(good.replace("n_returns: 5", "n_returns: 8000000"))
    work, pressed = Orbits.compute, threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))

    def orbits(*given: Any) -> Any:
        pressed.start()
        return work(*given)

    monkeypatch.setattr(Orbits, "compute", orbits)
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # also behind a shell that ignores it
    try:
        done = CliRunner().invoke(app, ["run", "s.yaml", "--out", "out"])
    finally:
        pressed.cancel()
        signal.signal(signal.SIGINT, handler)
    assert done.exit_code == 128 + signal.SIGINT
    assert done.stderr == (
        "stopped; out keeps the finished steps: system, surfaces, composite\nto resume: nsmaps run s.yaml --out out --resume\n"
    )
    assert Path("out/result.json").is_file()
    assert "Traceback" not in done.stdout
    Path("s.yaml").write_text(good)
    refused = CliRunner().invoke(app, ["run", "s.yaml", "--out", "out", "--resume"])
    assert refused.exit_code == 2
    assert refused.stderr.startswith("out holds a run of 's' with another study than 's' now; expected: the same study")


def test_a_figure_that_cannot_be_drawn_is_told_by_the_exit_code_and_does_not_end_the_run(good: str) -> None:
    text = good.replace("low: [BB]", "low: [BB]\n  never: [B_]").replace(
        "require: [covered]", "figures: [surfaces, projections, words]"
    )
    Path("s.yaml").write_text(text)
    done = CliRunner().invoke(app, ["run", "s.yaml", "--out", "out"])
    assert (done.exit_code, done.stderr) == (0, "")
    Path("t.yaml").write_text(
        "system: ball\nparameters: {a: 0.2}\ngrid: {v: {from: 0.1, to: 0.5, points: 5}, phi: {from: 0, to: 3, points: 5}}\n"
        "families: {never: [B_]}\nfigures: [surfaces]\n"
    )
    done = CliRunner().invoke(app, ["run", "t.yaml", "--out", "new"])
    assert done.exit_code == 2
    assert done.stderr == (
        "the figure 'surfaces' cannot be drawn: the figure 'surfaces' has nothing to show: no state of the grid is in 'never'; "
        "expected: families of words that occur on the grid\n"
    )
    assert Path("new/report.html").is_file()


def test_a_run_on_two_processes_has_the_same_numbers() -> None:
    Path("s.yaml").write_text(
        "system: vi_pair\nparameters: {d: 0.35, r: 0.5, g_bar: 0.2113}\n"
        "bifurcation_diagram: {parameter: d, from: 0.3, to: 0.35, points: 5, starts: [{v: 0.8, phi: 0.4}], "
        "n_returns: 20, transient: 100}\n"
        "parameter_plane: {axes: {d: {from: 0.3, to: 0.35, points: 3}, r: {from: 0.4, to: 0.5, points: 3}}, "
        "starts: [{v: 0.8, phi: 0.4}], n_returns: 64, transient: 100}\n"
    )
    for words in (["--out", "one"], ["--out", "two", "--workers", "2"]):
        assert CliRunner().invoke(app, ["run", "s.yaml", "--no-report", *words]).exit_code == 0
    one, two = (nsmaps.read_result(name) for name in ("one", "two"))
    assert one.bifurcation_diagram["exact"].states.tobytes() == two.bifurcation_diagram["exact"].states.tobytes()
    assert one.parameter_plane is not None
    assert two.parameter_plane is not None
    assert one.parameter_plane.exponent.tobytes() == two.parameter_plane.exponent.tobytes()


FALLING = '''
import sympy as sp
from nsmaps import ImpactSystem, Wall


class Falling(ImpactSystem):
    """A ball; its flight begins at its impact where `lift` is zero alone, and its forcing has no period where w is zero."""

    lift: float = 0.0
    w: float = 1.0
    r: float = 0.5

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi / self.w

    def FLIGHT
'''
FLIGHTS = {
    "lift": "displacement(self, t, hit):\n        return hit.z + hit.w * (t - hit.t) - (t - hit.t) ** 2 / 2 + self.lift",
    "w": "acceleration(self, t, place, velocity):\n        return sp.cos(self.w * t) - 2",
}


@pytest.mark.parametrize(("name", "ends", "refused"), [("lift", (0.0, 1.0), True), ("w", (0.0, 2.0), False)])
def test_check_refuses_a_range_that_the_formulas_of_the_class_refuse(name: str, ends: tuple[float, float], refused: bool) -> None:
    """As the run does, at the same place; a single value that is refused is one without a map."""
    Path("falling.py").write_text(FALLING.replace("FLIGHT", FLIGHTS[name]))
    diagram = f"{{parameter: {name}, from: {ends[0]}, to: {ends[1]}, points: 3, starts: [{{v: 1, phi: 1}}], n_returns: 4}}"
    Path("s.yaml").write_text(f"title: t\nsystem: falling.py:Falling\nbifurcation_diagram: {diagram}\n")
    checked, run = (
        CliRunner().invoke(app, [command, "s.yaml", *more]) for command, more in (("check", []), ("run", ["--no-report"]))
    )
    assert (checked.exit_code, run.exit_code) == ((2, 2) if refused else (0, 0))
    if refused:
        assert checked.stderr.splitlines()[-1] == run.stderr.splitlines()[-1]
        assert checked.stderr.splitlines()[-1].startswith("s.yaml:3:46: Falling.displacement does not start at hit.z")
    else:
        assert "2 values of w" in run.stdout or "no attractor" in run.stdout


def test_a_certificate_that_is_not_there_is_a_file_not_read() -> None:
    done = CliRunner().invoke(app, ["verify", "none.proof"])
    assert (done.exit_code, done.stderr) == (2, "none.proof: No such file or directory\n")
