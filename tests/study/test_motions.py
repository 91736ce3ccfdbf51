"""What a sweep says in words: motions by interval, and attractors beside each other, on the terminal and in the report."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import systems
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.study.conclusions.summary import numbers
from nsmaps.study.conclusions.verdict import conclusion
from nsmaps.study.sections.parameters.motions import digits, motions, widest

FOLD, CRISIS = 0.227713761, 0.22505  #: of 2:1/T and of the chaos beside it; see test_branch.py and docs/explanation/dynamics.md
PAIR = """\
system: vi_pair
parameters: {d: 0.2265, r: 0.25, M: 0.1245, g: 9.8, beta: pi/6, F: 5}
bifurcation_diagram:
  {parameter: d, from: 0.222, to: 0.238, points: 33, starts: [{v: 0.6, phi: 0.3}], transient: 3000, n_returns: 120,
   direction: both}
"""
BALL = """\
system: bouncing_ball
parameters: {Gamma: 1.4}
bifurcation_diagram:
  {parameter: Gamma, from: 1.5, to: 1.9, points: 41, starts: [{v: 4.1887902, phi: 0.15}], n_returns: 240, direction: up}
"""


@pytest.fixture
def both(once: Callable[..., Path]) -> Path:
    """The folder of a run of one orbit up and one down through the window in which two attractors coexist."""
    return once(PAIR)


def test_what_coexists_is_said_wherever_the_run_is_summed_up(both: Path) -> None:
    result = nsmaps.read_result(both)
    values = result.bifurcation_diagram["exact"].values
    inside = [value for value in values if CRISIS < value < FOLD]
    told = f"Attractors of the exact map coexist: 2:1/T beside C for d from {inside[0]:.6g} to {inside[-1]:.6g}"
    sentence = f"{told} (C: chaos)."
    assert conclusion(result) == sentence
    (row,) = numbers(result)["bifurcation_diagram"]["exact"]["coexisting"]
    assert row == {"motion": "2:1/T", "beside": "C", "from": inside[0], "to": inside[-1], "values": len(inside)}
    assert sentence in CliRunner().invoke(app, ["show", str(both)]).output
    page = (both / "report.html").read_text()
    assert page.count(sentence) == 1
    assert re.search(f"coexisting</h.>.*2:1/T</td>.*{inside[0]:.6g}</td>.*{inside[-1]:.6g}</td>", page)
    assert json.loads((both / "result.json").read_text())["numbers"]["bifurcation_diagram"]["exact"]["coexisting"] == [row]


@pytest.mark.thorough
def test_all_that_coexists_is_listed_and_what_does_not_is_not() -> None:
    """Up to 46 intervals of chaos beside itself were told; the rattle has two attractors where 1:1/T is beside 2:1/2T and on."""
    Path("s.yaml").write_text(f"""\
system: {systems.__file__}:GearRattle
parameters: {{eps: 0.3}}
bifurcation_diagram: {{parameter: eps, from: 0.26, to: 0.9, points: 65, starts: [{{v: 3, phi: 1}}], direction: both}}
""")
    result = nsmaps.run_study("s.yaml")
    alike = "1:1/T beside 2:1/2T at eps = 0.44; 1:1/T beside 2:1/4T at eps = 0.45; 1:1/T beside C at eps = 0.46"
    assert f"Attractors of the exact map coexist: {alike} (C: chaos)" in conclusion(result)
    starts = np.random.default_rng(0).uniform([0.1, 0], [14, 6.28], (60, 2))
    found = nsmaps.basins(result.system.at(eps=0.45), starts)
    assert {attractor.label for attractor in found.attractors} == {"1:1/T", "2:1/4T"}


def test_motions_beside_each_other_again_and_again_are_told_once(both: Path) -> None:
    result = nsmaps.read_result(both)
    made = result.bifurcation_diagram["exact"]
    inside = np.flatnonzero((made.values > CRISIS) & (made.values < FOLD))
    rows = {name: getattr(made, name).copy() for name in ("states", "turns", "codes", "outcome", "period")}
    for table in rows.values():
        table[inside[2], 1] = table[inside[2], 0]  # one value between at which both orbits come to the same
    again = result.with_parts({"bifurcation_diagram": {"exact": replace(made, **rows)}})
    ends = [f"{made.values[inside[k]]:.6g}" for k in (0, -1)]
    assert f"coexist: 2:1/T beside C at {len(inside) - 1} values for d from {ends[0]} to {ends[1]} (C: " in conclusion(again)


def test_one_orbit_tells_of_no_coexistence() -> None:
    Path("s.yaml").write_text(PAIR.replace("direction: both", "direction: up"))
    result = nsmaps.run_study("s.yaml")
    assert conclusion(result) == ""
    assert set(numbers(result)["bifurcation_diagram"]["exact"]) == {"ended", "motions", "windows"}


def test_the_table_keeps_the_widest_intervals_and_counts_the_rest(once: Callable[..., Path]) -> None:
    folder = once(BALL)
    told = CliRunner().invoke(app, ["show", str(folder)]).output
    made = nsmaps.read_result(folder).bifurcation_diagram["exact"]
    rows = motions(made)
    counts = [sum(row["from"] <= value <= row["to"] for value in made.values) for row in rows]
    assert sum(counts) == len(made.values)
    assert len(rows) > 12
    kept, more, largest = widest(made, 12)
    assert (len(kept), more) == (12, len(rows) - 12)
    assert sorted((row["values"] for row in kept), reverse=True) == sorted(counts, reverse=True)[:12]
    assert largest == sorted(counts, reverse=True)[12] == 1
    assert [row["from"] for row in kept] == sorted(row["from"] for row in kept)
    assert f"Of the exact map there are {more} more intervals, of at most one value." in told
    assert "C: chaos; unresolved: " in told
    assert re.search(r"exact\s+1:0/2T\s+1\.53\s+1\.66\s+14", told), "the doublings are at 1.5249 and 1.6673"
    above, below = told.split("Windows")
    table = [line for line in above.splitlines() if line.startswith("  exact")]
    assert len(table) == 12
    doubling = ((np.pi / 3) ** 2 + (2 * 1.25 / 1.5**2) ** 2) ** 0.5
    (found,) = re.findall(r"exact\s+1:0/2T\s+([\d.]+),\s+period halving", below)
    assert float(found) == pytest.approx(doubling, abs=1e-10)
    assert all(len(line) < 100 for line in table), "motion that sticks is named by more than its words"


def test_values_have_the_digits_that_tell_them_apart(once: Callable[..., Path]) -> None:
    made = nsmaps.read_result(once(BALL)).bifurcation_diagram["exact"]
    assert digits([1.5, 1.5100000000000002, 1.9], made) == ["1.5", "1.51", "1.9"]
    assert len(set(digits(made.values.tolist(), made))) == len(made.values)


def test_orbits_of_a_diagram_that_end_are_a_verdict_with_the_reason() -> None:
    """Below Gamma = 1 gravity is never outweighed: a ball that has come to rest stays."""
    Path("s.yaml").write_text(BALL.replace("from: 1.5", "from: 0.5").replace("to: 1.9, points: 41", "to: 0.9, points: 5"))
    told = CliRunner().invoke(app, ["run", "s.yaml", "--out", "out"]).output
    (verdict,) = nsmaps.read_result("out").verdicts
    assert (verdict.holds, verdict.required) == (False, False)
    assert verdict.text == f"no: an orbit ends at 5 of 5 values, most frequently: {nsmaps.Outcome.rests.advice}"
    assert re.search(r"exact\s+no attractor\s+0.5\s+0.9\s+5", told)
    assert "C: chaos" not in told
