"""The sentence that says what a run found: true of what was computed, and of the map that it names."""

import re
from fractions import Fraction
from html import unescape
from pathlib import Path

import numpy as np
import pytest

import nsmaps
from nsmaps.auxiliary.bounds import ErrorBound
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study.conclusions.headline import findings, headline, key_numbers
from nsmaps.study.conclusions.texts import cycle_of
from nsmaps.study.result import StudyResult
from nsmaps.study.sections.base import concluding

PAIR = "system: vi_pair\nparameters: {d: 0.35, r: 0.5, M: 0.1245, g: 9.8, beta: pi/3, F: 5}\n"
ORBITS = "orbits: [{start: {v: 0.35, phi: 1.5}, n_returns: 200}, {start: {v: 0.2, phi: 0.1}, n_returns: 220}]\n"
BOX = "domains: [{name: exact, map: exact, box: {v: [0.8214, 0.8454], phi: [0.3391, 0.3881]}, max_updates: 2}]\n"


def told(text: str) -> str:
    Path("s.yaml").write_text(text)
    return headline(nsmaps.run_study("s.yaml"))


def boxes(text: str) -> np.ndarray:
    """The intervals of a sentence, shape (boxes, 2, 2)."""
    ends = re.findall(r"(?:v|phi) in \[([^,]+), ([^\]]+)\]", text)
    return np.array(ends, float).reshape(-1, 2, 2)


def test_one_fixed_point_and_a_box_that_orbits_stay_in() -> None:
    """Orbits of 500 starts of the box that is told stay in it, and are in the other one at last."""
    said = told(PAIR + ORBITS + BOX)
    point = "Exact map: one stable fixed point (1:1/T), on which both orbits followed end. Every orbit from v in "
    assert said.startswith(point)
    name = "1:1/T: one return to the section and one other impact in one period of the forcing."
    assert said.endswith(f" and stays there (enclosed), which contains the attractors of the orbits. {name}")
    start, end = boxes(said)
    system = nsmaps.load_study("s.yaml").system_object()
    states = nsmaps.orbit(system, np.random.default_rng(2).uniform(*start.T, (500, 2)), 60).states
    assert ((start[:, 0] <= states) & (states <= start[:, 1])).all()
    assert ((end[:, 0] <= states[-20:]) & (states[-20:] <= end[:, 1])).all()
    assert (start[:, 0] >= [0.8214, 0.3391]).all(), "what orbits start in is rounded inwards"
    assert (start[:, 1] <= [0.8454, 0.3881]).all()


def test_a_two_cycle_of_one_orbit_and_samples_that_prove_nothing() -> None:
    one = "orbits: [{start: {v: 0.2, phi: 0.1}, n_returns: 220}]\n"
    said = told(PAIR.replace("0.35", "0.30") + one)
    name = "1:1/2T: one return to the section and one other impact in two periods of the forcing."
    assert said == f"Exact map: one stable two-cycle (1:1/2T), on which the one orbit followed ends. {name}"
    doubt = ". Sampled on a grid of states: every orbit from "
    sampled = told(PAIR + one + BOX.replace("max_updates: 2", "max_updates: 2, bounds_kind: sampled"))
    assert doubt in sampled
    assert "enclosed" not in sampled


def test_motions_beside_each_other_are_told_apart() -> None:
    """At d = 0.2265, r = 0.25 and beta = pi/6 chaos and a cycle of two returns coexist."""
    pair = "system: vi_pair\nparameters: {d: 0.2265, r: 0.25, M: 0.1245, g: 9.8, beta: pi/6, F: 5}\n"
    starts = [(0.67, 0.48), (0.2, 1.0), (0.25, 1.1)]
    orbits = ", ".join(f"{{start: {{v: {v}, phi: {phi}}}, n_returns: 300}}" for v, phi in starts)
    Path("s.yaml").write_text(f"{pair}orbits: [{orbits}]\n")
    made = nsmaps.run_study("s.yaml")
    periods = [each.ends.period for each in made.orbits]
    assert sorted(set(periods)) == [0, 2]
    said = headline(made)
    assert "one stable two-cycle (2:1/T)" in said
    assert "chaos (C), largest Lyapunov exponent 0.1" in said or "chaos (C), largest Lyapunov exponent 0.2" in said
    first, other = ("one", "two") if periods.count(periods[0]) == 1 else ("two", "one")
    assert f"on which {first} and {other} of the 3 orbits followed end. 2:1/T: " in said


def of_half(**how: object) -> StudyResult:
    """A result with the domain of x' = -x/2 on [-1, 1], and nothing else."""
    half = PolyMap.of_monomials(("x",), {"x": {(1,): Fraction(-1, 2)}}, [[-2, 2]])
    study = nsmaps.Study(system="ball", parameters={"a": 0.2})
    return StudyResult(
        study, study.system_object(), {"domains": {"half": nsmaps.attracting_domain(half, [[-1, 1]], max_updates=1, **how)}}
    )


def test_a_bound_of_a_fit_is_not_one_of_the_exact_map() -> None:
    said = headline(of_half(of="fitted map R1"))
    assert said.startswith("Fitted map R1: every orbit from x in [-1, 1] enters x in [")
    assert "xact" not in said
    error = ErrorBound(np.full(1, 1e-3), "held-out")
    estimate = headline(of_half(error=error, of="exact map, by fitted map R1"))
    assert estimate.startswith("Exact map, by fitted map R1: estimated by the held-out error of the fit: every orbit from ")


def test_the_surest_box_is_told() -> None:
    """A bound before an estimate, of the exact map before a fit."""
    result = of_half(of="fitted map R1")
    error = ErrorBound(np.full(1, 1e-3), "held-out")
    for of, how in (("exact map", {"bounds_kind": "sampled"}), ("exact map, by fitted map R1", {"error": error})):
        result.domains[of] = of_half(of=of, **how).domains["half"]
    assert headline(result).startswith("Fitted map R1: every orbit")
    result.domains["bound"] = of_half(of="exact map").domains["half"]
    assert headline(result).startswith("Exact map: every orbit from x in [-1, 1]")


def test_nothing_is_told_where_nothing_was_found() -> None:
    assert told("system: ball\nparameters: {a: 0.2}\n") == ""


@pytest.mark.parametrize(
    ("period", "name"), [(1, "fixed point"), (2, "two-cycle"), (9, "nine-cycle"), (10, "cycle of 10 returns")]
)
def test_cycles_have_names(period: int, name: str) -> None:
    assert cycle_of(period) == name


KINDS = {  #: stored runs with the analyses that have a finding in each
    "accurate": ["partition"],
    "plane": ["parameter_plane", "branches"],
    "curves": ["parameter_plane", "branches"],
    "long": ["lyapunov", "basins", "noise"],
    "manifolds": ["manifolds"],
    "motion": ["orbits"],
    "observables": ["observe", "bifurcation_diagram"],
    "optimum": ["optimize"],
    "partition": ["partition", "composite"],
    "resilience": ["global_continuation"],
    "run": ["domains", "parametric_map"],
    "windows": ["bifurcation_diagram"],
}


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_of_study_has_a_headline_with_numbers(name: str) -> None:
    made = nsmaps.read_result(Path(__file__).parents[1] / "data" / "run-format-4" / name)
    analyses = {each.key: each for each in concluding(made)}
    for key in KINDS[name]:
        found = list(analyses[key].findings(made))
        assert found, f"{key} has no finding"
        assert all(any(map(str.isdigit, finding.text)) for finding in found)
        assert any(finding.numbers for finding in found)
    assert findings(made)[0].text in headline(made)
    assert 1 <= len(key_numbers(made, 5)) <= 5


def test_a_diagram_leads_and_names_its_bifurcations() -> None:
    """The doubling of the 1:0/T motion of the ball is at Gamma^2 = pi^2 ((1 - r)/(1 + r))^2 + (2 (1 + r^2)/(1 + r)^2)^2."""
    made = nsmaps.read_result(Path(__file__).parents[1] / "data" / "run-format-4" / "windows")
    r = made.system.parameters["r"]
    doubling = np.hypot(np.pi * (1 - r) / (1 + r), 2 * (1 + r * r) / (1 + r) ** 2)
    value, meaning = key_numbers(made, 5)[0]
    assert (float(value.removeprefix("Gamma = ")), meaning) == (pytest.approx(doubling, rel=1e-5), "period doubling")
    assert f"1:0/T for Gamma < {value.removeprefix('Gamma = ')}; period doubling at {value}" in headline(made)


def test_a_result_is_printed_in_words() -> None:
    result = of_half(of="exact map")
    assert str(result).startswith(headline(result))
    assert headline(result) in unescape(result._repr_html_())
    assert repr(result) == f"StudyResult({result.study.name}: domains)"
