"""Branches and planes of two parameters in studies: against closed forms and their functions, in folders, numbers and tables."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from math import pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from messages import message
from scipy.optimize import brentq, newton
from typer.testing import CliRunner

from nsmaps import Outcome, bifurcation_diagram, lyapunov, parameter_plane, periodic_orbit, read_result, run_study
from nsmaps.cli.cli import app
from nsmaps.dynamics.continuation import follow as branch
from nsmaps.dynamics.continuation.follow import continue_branch, doublings_of
from nsmaps.dynamics.curves.special import SpecialPoint
from nsmaps.dynamics.planes import parameter_plane as planes
from nsmaps.errors import StudyError
from nsmaps.exact import Along
from nsmaps.interrupts import Interrupted
from nsmaps.progress import outermost
from nsmaps.study.result import StudyResult
from nsmaps.study.store.archive import write

STORED = Path(__file__).parents[1] / "data" / "run-format-4"
BALL = """\
system: ball
parameters: {a: 1.2, r: 0.5}
branches:
  - {name: one, parameter: a, bounds: [0.5, 1.8], start: {v: 2*pi/1.5, phi: 0.51}, n_doublings: 2}
"""
PLANE = """\
parameter_plane:
  axes:
    a: {from: 1.1, to: 1.7, points: 4}
    r: {from: 0.46, to: 0.54, points: 5}
  starts: [{v: 4.19, phi: 0.5}]
  transient: 200
  n_returns: 32
  max_period: 16
  direction: down
  bifurcation_curves: [{branch: one, event: period doubling}, {branch: one, event: fold}]
"""


Computed = Callable[..., tuple[StudyResult, Path]]
Swept = tuple[StudyResult, Path, list[tuple[str, float]]]


def fold(e: float) -> float:
    """The amplitude at which the fixed points of the ball are born."""
    return pi * (1 - e) / (1 + e)


def doubling(e: float) -> float:
    """That at which the stable one doubles its period."""
    return sqrt(fold(e) ** 2 + (2 * (1 + e**2) / (1 + e) ** 2) ** 2)


def ran(text: str, **how: Any) -> StudyResult:
    """The result of a study's text."""
    Path("s.yaml").write_text(text)
    return run_study("s.yaml", **how)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory, site: Path) -> "Swept":
    """Branches with a stability diagram and curves: the result, its folder, and the steps and fractions that were reported."""
    folder, seen = tmp_path_factory.mktemp("swept"), []
    Path(folder, "s.yaml").write_text(BALL + PLANE)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(site))
        made = run_study(folder / "s.yaml", out=folder / "out", progress=lambda share: seen.append((outermost().step, share)))
    return made, folder / "out", seen


def test_a_branch_is_that_of_the_closed_form_and_read_back_as_it_was(computed: Computed) -> None:
    made, folder = computed(BALL)
    up, down, two, *rest = made.branches["one"]
    assert abs(up.of_kind("period doubling")[0].value - doubling(0.5)) < 1e-8
    assert abs(down.of_kind("fold")[0].value - fold(0.5)) < 1e-8
    assert np.allclose(down.points[:, 0, 0], 2 * pi / 1.5, atol=1e-10)
    assert (up.ended, two.period, rest) == ("the range ends at 1.8", 2, [])
    assert np.allclose(two.points[0], up.of_kind("period doubling")[0].orbit.states)
    again = read_result(folder)
    assert again.study == made.study
    for one, other in zip(made.branches["one"], again.branches["one"], strict=True):
        for name in ("values", "arclength", "points", "words", "multipliers", "labels", "stable"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        assert (one.ended, one.period, one.tolerance) == (other.ended, other.period, other.tolerance)
        assert np.array_equal(one.returns.derivative, other.returns.derivative)
        assert len(one.orbits) == len(other.orbits) == len(one.values)
        for event, kept in zip(one.events, other.events, strict=True):
            assert (event.kind, event.value, event.precision, event.detail) == (
                kept.kind,
                kept.value,
                kept.precision,
                kept.detail,
            )
            assert np.array_equal(event.multipliers, kept.multipliers)


def test_a_branch_is_what_the_functions_give(computed: Computed) -> None:
    result, _ = computed(BALL)
    made, system = result.branches["one"], result.system
    map_of, within = Along(system, "a"), (0.5, 1.8)
    orbit = periodic_orbit(system, [2 * pi / 1.5, 0.51])
    first = [continue_branch(map_of, "p", orbit, 1.2, within, direction=way) for way in ("up", "down")]
    expected = [*first, *(branch for one in first for branch in doublings_of(map_of, one, within, 1))]
    assert len(made) == len(expected)
    for one, other in zip(made, expected, strict=True):
        assert np.array_equal(one.points, other.points)
        assert one.ended == other.ended


def test_only_the_events_that_are_named_are_located() -> None:
    few = BALL.replace("n_doublings: 2", "kinds: [fold]")
    up, down = ran(few).branches["one"]
    assert {event.kind for event in (*up.events, *down.events)} == {"fold"}
    assert not up.stable[-1]


def test_numbers_verdicts_and_table_say_what_happens(computed: Computed) -> None:
    _, folder = computed(BALL)
    answer = CliRunner().invoke(app, ["show", str(folder)])
    assert answer.exit_code == 0, answer.output
    rows = [line.split() for line in answer.stdout.splitlines() if line.split()[:1] == ["one"]]
    found = next(row for row in rows if row[2:4] == ["period", "doubling"])
    assert found[:2] == ["one", "1:0/T"]
    assert found[4:6] == ["a", "="]
    assert float(found[6]) == pytest.approx(doubling(0.5), abs=1e-8)
    assert float(found[7]) < 1e-8
    numbers = json.loads((folder / "result.json").read_text())["numbers"]["branches"]["one"]
    events = [(row["kind"], row["label"], pytest.approx(row["value"])) for row in numbers["events"]]
    assert numbers["events"][0]["digits"] == found[6]
    assert ("period doubling", "1:0/T", doubling(0.5)) in events
    assert ("fold", "1:0/T", fold(0.5)) in events
    assert numbers["parts"][0] | {"orbits": 0} == {
        "period": 1,
        "orbits": 0,
        "from": 1.2,
        "to": 1.8,
        "ended": "the range ends at 1.8",
    }
    texts = {verdict.name: (verdict.holds, verdict.required, verdict.text) for verdict in read_result(folder).verdicts}
    told = "yes: up: the range ends at 1.8; down: the range ends at 1.8"
    assert texts["branch one: followed to the end of its range"] == (True, False, told)
    two = read_result(folder).branches["one"][2].of_kind("period doubling")[0]
    assert texts["branch one: doublings"] == (True, False, f"yes: at {doubling(0.5):.8g}, {two.value:.8g}")


def test_check_says_what_would_be_followed() -> None:
    Path("s.yaml").write_text(BALL + PLANE)
    lines = CliRunner().invoke(app, ["check", "s.yaml"]).stdout.splitlines()
    assert "  branches: one (a from 0.5 to 1.8)" in lines
    assert "  parameter_plane: 4 values of a x 5 values of r; 4,640 returns" in lines


def test_doublings_that_are_not_in_the_range_are_said() -> None:
    for end, said in ((1.6, f"1 of 2, at {doubling(0.5):.8g}"), (1.4, "0 of 2")):
        result = ran(BALL.replace("1.8]", f"{end}], direction: up"))
        (told,) = [verdict for verdict in result.verdicts if verdict.name == "branch one: doublings"]
        assert told.text == f"no: {said}; then: the range ends at {end}"


@pytest.mark.thorough
def test_a_start_that_leads_nowhere_is_said_and_the_rest_is_kept() -> None:
    text = BALL.replace(", n_doublings: 2", "") + (
        "  - {name: nowhere, parameter: a, bounds: [0.5, 1.8], start: {v: 1.0, phi: 3}, period: 5}\n"
        "  - {name: twice, parameter: a, bounds: [0.5, 1.8], start: {v: 2*pi/1.5, phi: 0.51}, period: 2}\n"
        "  - {name: beyond, parameter: r, bounds: [0.4, 1.5], start: {v: 2*pi/1.5, phi: 0.51}, direction: up}\n"
        "  - {name: too fast, parameter: a, bounds: [0.5, 1.8], start: {v: 1e300, phi: 1}}\n"
        "figures: [branches]\n"
    )
    Path("s.yaml").write_text(text)
    assert CliRunner().invoke(app, ["run", "s.yaml", "--out", "out"]).exit_code == 0
    made = read_result("out")
    assert made.finished
    assert len(made.branches["one"][0].orbits) > 5
    for name in ("nowhere", "twice", "too fast"):
        assert all(len(branch.values) == 0 for branch in made.branches[name])
    texts = {verdict.name.split(":")[0]: verdict.text for verdict in made.verdicts if "followed" in verdict.name}
    assert texts["branch nowhere"] == "no: no orbit at 1.2: Newton's method does not converge"
    assert texts["branch twice"] == "no: no orbit of period 2 at 1.2: Newton's method converges to one of period 1"
    assert texts["branch too fast"].startswith("no: no orbit at 1.2: Newton's method does not converge, and the guess has no")
    assert texts["branch beyond"].startswith("no: up: end of the valid domain at ")
    assert sorted(path.name for path in Path("out/figures").iterdir()) == ["branches-a.png", "branches-r.png"]


def test_a_range_that_leaves_the_valid_domain_ends_the_branch_there() -> None:
    text = "system: ball\nparameters: {a: 1.2, r: 0.5}\nbranches:\n"
    text += "  - {name: up, parameter: r, bounds: [0.4, 1.5], start: {v: 2*pi/1.5, phi: 0.51}, direction: up}\n"
    made = ran(text)
    (branch,) = made.branches["up"]
    assert [event.kind for event in branch.events] == ["period doubling", "end of the valid domain"]
    assert abs(branch.events[0].value - brentq(lambda e: doubling(e) - 1.2, 0.5, 0.9)) < 1e-8
    assert abs(branch.events[1].value - 1) < 1e-8
    (told,) = made.verdicts
    assert told.text.startswith("no: up: end of the valid domain at ")
    assert re.search(r", Ball: r is 1\.0\d*; expected: less than or equal to 1$", told.text)


def test_a_plane_is_that_of_the_functions_and_its_curves_of_the_closed_form(swept: Swept) -> None:
    made, folder, _ = swept
    along, across = np.linspace(1.1, 1.7, 4), np.linspace(0.46, 0.54, 5)
    how = {"max_period": 16, "n_returns": 32, "transient": 200, "direction": "down"}
    direct = parameter_plane(made.system, {"a": along, "r": across}, [4.19, 0.5], **how)
    for each in (made, read_result(folder)):
        assert each.parameter_plane is not None
        assert np.array_equal(each.parameter_plane.period, direct.period)
        assert np.array_equal(each.parameter_plane.labels, direct.labels)
        assert np.array_equal(each.parameter_plane.outcome, direct.outcome)
        assert list(each.plane_curves) == ["period doubling of one", "fold of one"]
        for curve, exact in zip(each.plane_curves.values(), (doubling, fold), strict=True):
            a, r = curve.parameters.T
            assert np.abs(a - [exact(e) for e in r]).max() < 1e-11
            assert sorted(r[[0, -1]]) == pytest.approx([0.46, 0.54])
            assert {end.split(" at ")[0] for end in curve.ended} == {"the range of the second parameter ends"}
    numbers = json.loads((folder / "result.json").read_text())["numbers"]["parameter_plane"]
    assert sum(numbers["shares"].values()) == pytest.approx(1)
    assert numbers["shares"]["1:0/T"] == (direct.labels == "1:0/T").mean() > 0
    assert numbers["curves"]["fold of one"]["parameters"] == made.plane_curves["fold of one"].parameters.tolist()


def test_points_of_codimension_two_are_read_back_and_in_numbers(tmp_path: Path) -> None:
    made = read_result(STORED / "curves")
    fold = made.plane_curves["fold of one"]
    event = made.branches["one"][0].events[0]
    cusp = SpecialPoint("cusp", (1.05, 0.5), (1e-9, 2e-9), event.orbit)
    write(made.with_parts({"plane_curves": {"fold of one": replace(fold, special=(cusp,))}}), tmp_path)
    (again,) = read_result(tmp_path).plane_curves["fold of one"].special
    assert (again.kind, again.parameters, again.precision) == ("cusp", (1.05, 0.5), (1e-9, 2e-9))
    assert np.array_equal(again.orbit.states, event.orbit.states)
    numbers = json.loads((tmp_path / "result.json").read_text())["numbers"]["parameter_plane"]
    assert numbers["curves"]["fold of one"]["special"] == [{"kind": "cusp", "parameters": [1.05, 0.5], "precision": [1e-9, 2e-9]}]


def graze(r: float, g: float) -> float:
    """The length at which the pair's motion BB, once a period, touches T: v = 2 g/(1 + r), sin phi = pi g (1 - r)/(1 + r)."""
    v, phi = 2 * g / (1 + r), pi - np.arcsin(pi * g * (1 - r) / (1 + r))
    turn = newton(lambda s: -r * v + g * s + (np.sin(pi * s + phi) - np.sin(phi)) / pi, 0.7)
    drift = -r * v - np.sin(phi) / pi
    return float(-(drift * turn + g * turn**2 / 2 - (np.cos(pi * turn + phi) - np.cos(phi)) / pi**2))


GRAZE = """\
system: vi_pair
parameters: {d: 0.35, r: 0.5, g_bar: 0.2113}
branches: [{name: BB, parameter: d, bounds: [0.29, 0.36], value: 0.32, start: {v: 0.2817, phi: 2.918}}]
parameter_plane:
  axes:
    d: {from: 0.32, to: 0.35, points: 2}
    r: {from: 0.49, to: 0.51, points: 3}
  starts: [{v: 0.9, phi: 0.5}]
  transient: 20
  n_returns: 64
  bifurcation_curves: [{branch: BB, event: grazing}]
"""


def test_a_curve_of_grazes_is_that_of_the_closed_form() -> None:
    curve = ran(GRAZE).plane_curves["grazing of BB"]
    d, r = curve.parameters.T
    assert np.abs(d - [graze(x, 0.2113) for x in r]).max() < 1e-10
    assert np.ptp(r) == pytest.approx(0.02)


def test_a_curve_without_its_event_says_why_and_nothing_is_lost() -> None:
    made = ran(GRAZE.replace("event: grazing", "event: period doubling"))
    (verdict,) = [each for each in made.verdicts if each.name == "parameter_plane: curve of the period doubling of BB"]
    assert verdict.text.startswith("no: the branch has none: ")
    assert made.plane_curves["period doubling of BB"].parameters.shape == (0, 2)
    assert made.parameter_plane is not None


LOCKED = """\
system: bouncing_ball
parameters: {Gamma: 3.2, r: 0}
branches:
  - {name: locked, parameter: Gamma, bounds: [3, 3.5], start: {v: 1, phi: 1}, chatter: true, direction: up}
observe: {observables: [loss, work]}
"""


def test_a_branch_with_complete_chatter_ends_at_its_border() -> None:
    result = ran(LOCKED, out="out")
    (branch,) = result.branches["locked"]
    assert branch.ended == "end of complete chatter"
    assert branch.events[0].value == pytest.approx(sqrt(1 + pi**2), abs=1e-11)
    assert set(branch.words.ravel().tolist()) == {"B_B"}
    (means,) = result.branch_observables["locked"]
    landing = np.array([orbit.states[0, :1] for orbit in branch.orbits])
    assert np.abs(means.per_return.value / (landing**2 / 2) - 1).max() < 1e-12
    (again,) = read_result("out").branches["locked"]
    assert again.events[0].value == branch.events[0].value
    made = json.loads(Path("out/result.json").read_text())
    (verdict,) = [each for each in made["verdicts"] if each["name"].startswith("branch locked")]
    assert "end of complete chatter at 3.2969" in verdict["text"]


def test_chatter_of_a_system_with_modes_is_refused() -> None:
    text = "system: buck_converter\nparameters: {E: 20.0}\nbranches:\n"
    text += "  - {name: one, parameter: E, bounds: [19, 21], start: {v: 11.97, i: 0.59}, chatter: true}\n"
    with pytest.raises(StudyError, match=message("dynamics.no-rests", system="BuckConverter")):
        ran(text)


RANGE = "from: 0.8, to: 1.2, points: 5"
STARTS = "starts: [{v: 4.19, phi: 0.5}], transient: 9"
SWEEPS = {
    "bifurcation_diagram": f"bifurcation_diagram: {{parameter: r, {RANGE}, {STARTS}, n_returns: 4}}",
    "lyapunov": f"lyapunov: {{parameter: r, {RANGE}, {STARTS}, n_returns: 64}}",
    "parameter_plane": f"parameter_plane: {{axes: {{r: {{{RANGE}}}, a: {{from: -0.5, to: 0.5, points: 3}}}}, "
    f"{STARTS}, n_returns: 64}}",
}


@pytest.mark.parametrize("section", SWEEPS)
def test_a_sweep_that_leaves_the_valid_domain_keeps_the_rest(section: str) -> None:
    made = ran(f"system: ball\nparameters: {{a: 0.3}}\n{SWEEPS[section]}\n", out="out")
    assert made.finished
    (told,) = [verdict for verdict in made.verdicts if verdict.name.endswith("a map at every value")]
    assert (told.holds, told.required) == (False, False)
    along, start, values = Along(made.system, "r"), [4.19, 0.5], np.linspace(0.8, 1.2, 5)
    if section == "parameter_plane":
        assert told.text == "no: none at 12 of 15 pixels; Ball: a is -0.5; expected: greater than 0"
        assert made.parameter_plane is not None
        assert made.parameter_plane.refused.tolist() == [[True] * 5, [True] * 5, [False] * 3 + [True] * 2]
        assert (made.parameter_plane.outcome[..., 0] == Outcome.invalid).tolist() == made.parameter_plane.refused.tolist()
        return
    assert told.text.startswith("no: none at 2 of 5 values; Ball: r is 1.1; expected: less than or equal to 1"), told.text
    if section == "bifurcation_diagram":
        each = made.bifurcation_diagram["exact"]
        assert np.array_equal(
            each.states[:3], bifurcation_diagram(along, "p", values[:3], start, n_returns=4, transient=9).states
        )
        assert np.isnan(each.states[3:]).all()
    else:
        assert made.lyapunov is not None
        each = made.lyapunov
        assert np.array_equal(each.exponents[:3], lyapunov(along, "a", values[:3], start, n_returns=64, transient=9).exponents)
        assert np.isnan(each.exponents[3:]).all()
    assert [bool(reason) for reason in each.reasons] == [False] * 3 + [True] * 2


@pytest.mark.parametrize("section", SWEEPS)
def test_orbits_that_escape_are_data(section: str) -> None:
    text = SWEEPS[section].replace("v: 4.19", "v: 1e300").replace("to: 1.2", "to: 1").replace("from: -0.5", "from: 0.1")
    made = ran(f"system: ball\nparameters: {{a: 0.3}}\n{text}\n", out="out")
    assert made.finished
    ends = ["bifurcation_diagram exact: orbit completes at every parameter value"] if section == "bifurcation_diagram" else []
    assert [verdict.name for verdict in made.verdicts] == ends
    numbers = json.loads(Path("out/result.json").read_text())["numbers"][section]
    if section == "bifurcation_diagram":
        assert set(made.bifurcation_diagram["exact"].outcome.ravel().tolist()) == {Outcome.escaped}
        assert numbers["exact"]["ended"] == 5
    elif section == "lyapunov":
        assert set(made.lyapunov.outcome.tolist()) == {Outcome.escaped}
        assert numbers["exponents"] == [[None, None]] * 5
    else:
        assert set(made.parameter_plane.outcome.ravel().tolist()) == {Outcome.escaped}
        assert numbers["shares"] == {}


def test_a_closed_branch_is_followed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    follow = branch.continue_branch
    monkeypatch.setattr(branch, "continue_branch", lambda *given, **how: replace(follow(*given, **how), ended="closed"))
    made = ran(BALL.replace("n_doublings: 2", "direction: both"))
    (one,) = made.branches["one"]
    assert one.values[-1] == 1.8
    assert [verdict.text for verdict in made.verdicts] == ["yes: up: closed"]


@pytest.mark.thorough
def test_a_stopped_plane_is_resumed_at_its_rows(monkeypatch: pytest.MonkeyPatch, swept: Swept) -> None:
    whole, *_ = swept

    def stop(share: float) -> None:
        if outermost().step == "parameter_plane" and share >= (2 + 2 / 3 / 3) / 3:  # of three parts, a third of the last step
            raise KeyboardInterrupt

    monkeypatch.setattr(planes, "PART", 2 * 4 * 232)  # two rows
    with pytest.raises(Interrupted):
        ran(BALL + PLANE, out="out", progress=stop)
    assert len(list(Path("out/parts/parameter_plane").rglob("part-*.npz"))) == 2
    rows: list[float] = []
    pixels = planes.pixels

    @wraps(pixels)
    def noted(map_of: Any, coordinates: Any, row: np.ndarray, *how: Any) -> Any:
        rows.extend(row[:, 0, 1])
        return pixels(map_of, coordinates, row, *how)

    monkeypatch.setattr(planes, "pixels", noted)
    again = ran(BALL + PLANE, out="out", resume=True)
    assert np.allclose(rows, [0.54])
    assert np.array_equal(again.parameter_plane.labels, whole.parameter_plane.labels)
    assert np.array_equal(again.plane_curves["fold of one"].parameters, whole.plane_curves["fold of one"].parameters)
    assert not Path("out/parts").exists()


def test_progress_of_branches_and_planes_never_goes_back(swept: Swept) -> None:
    *_, seen = swept
    done = [share for _, share in seen]
    assert done == sorted(done)
    assert [share for step, share in seen if step == "branches"] == pytest.approx([1 / 3, 2 / 3])
    assert [share for step, share in seen if step == "parameter_plane"][-1] == 1
    assert len([share for step, share in seen if step == "parameter_plane"]) == 1 + 1 + 2
