"""What a run says of its orbits' attractors, and when it says that both maps have the same."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

import nsmaps
from nsmaps.dynamics.attractors.limit_set import OrbitPair, limit_set
from nsmaps.plugins import study_files
from nsmaps.study.sections.longrun.orbits import Orbits

SECTIONS = ("system", "parameters", "grid", "families", "composite", "orbits")


@pytest.fixture
def pd() -> str:
    """The part of the paper's case PD that orbits of both maps need, as a file."""
    whole = YAML(typ="safe").load(study_files("vi_pair")["pd"].read_text())
    Path("pd.yaml").write_text(json.dumps({name: whole[name] for name in SECTIONS}))
    return "pd.yaml"


def same(result: nsmaps.StudyResult) -> nsmaps.study.Verdict:
    (verdict,) = (v for v in result.verdicts if v.name.endswith(": same attractor as the exact map"))
    return verdict


def by_hand(return_map: nsmaps.exact.ReturnMap, start: list[float], returns: int) -> np.ndarray:
    """The last two states of an orbit, by nothing but returns."""
    states = np.array([start])
    for _ in range(returns):
        last, states = states, return_map.first_return(states).image
    return np.sort(np.concatenate([last, states]), axis=0)


def test_the_paper_s_two_cycle_is_that_of_both_maps(pd: str) -> None:
    result = nsmaps.run_study(pd, out="out")
    verdict = same(result)
    assert (verdict.of, verdict.holds, verdict.required) == ("composite map", True, False)
    exact, ours = (by_hand(formulas, [0.2, 0.1], 400) for formulas in (result.system, result.composite))
    sides = [axis.high - axis.low for axis in result.study.grid.values()]
    apart = (np.abs(exact - ours) / sides).max()  # each is nearest to its like: the cycles are 0.2 long
    assert verdict.text.startswith("yes: period 2 (1:1/2T) of the exact map, period 2 (1:1) of the composite map, ")
    assert verdict.text.endswith(f", at a distance of {apart:.2g} relative to the extents")
    attractor = json.loads(Path("out/result.json").read_text())["numbers"]["orbits"][0]["attractor"]["exact"]
    assert (attractor["period"], attractor["label"], attractor["words"], attractor["stable"]) == (2, "1:1/2T", "BTB BTB", True)
    assert np.array(attractor["states"]) == pytest.approx(exact, abs=1e-9)
    slopes = result.system.first_return(exact, derivative=True).derivative
    expected = np.sort_complex(np.linalg.eigvals(slopes[1] @ slopes[0]))
    found = np.sort_complex([complex(*pair) for pair in attractor["multipliers"]])
    assert found == pytest.approx(expected, abs=1e-7)
    again = nsmaps.read_result("out").orbits[0]
    assert np.array_equal(again.ends.multipliers, result.orbits[0].ends.multipliers)
    assert again.composite_ends.text == result.orbits[0].composite_ends.text


def test_an_orbit_that_ends_elsewhere_is_not_said_to_be_right(pd: str) -> None:
    """At r = 0.45 the composite map's orbit completes all returns, and goes to rest beside the wall; the exact one does not."""
    result = nsmaps.run_study(nsmaps.load_study(pd, parameters={"r": 0.45}))
    returning = [v for v in result.verdicts if v.name.endswith(": completes all returns")]
    assert [v.holds for v in returning] == [True, True]
    exact, ours = (by_hand(formulas, [0.2, 0.1], 4000) for formulas in (result.system, result.composite))
    assert np.linalg.norm(exact - ours, axis=1).min() > 0.5
    verdict = same(result)
    assert not verdict.holds
    assert verdict.text.startswith("no: period 2 (1:1/2T) of the exact map, period 1 ")
    stays, leaves = (by_hand(*here, 400) for here in ((result.composite, exact[0]), (result.system, ours[0])))
    assert np.abs(stays - exact).max() < 0.1
    assert np.linalg.norm(leaves - ours, axis=1).min() > 0.5
    also = "the exact map's is also an attractor of the composite map, the composite map's is not one of the exact map"
    assert verdict.text.endswith(f"relative to the extents; {also}")
    assert not any("arrives" in v.name for v in result.verdicts)


LEAST, MOST = [0.6756, 6.2245], [0.75, 0.3]  #: starts that come to 2:1/2T, up to a fold at d = 0.289429646, and to 1:1/2T


@pytest.mark.parametrize(
    ("d", "starts", "told"),
    [
        ((0.285, 0.285), (LEAST, MOST), "each map has both attractors"),
        (
            (0.2896, 0.289),
            (MOST, LEAST),
            "the exact map's is also an attractor of the composite map, the",
        ),
        ((0.289, 0.2896), (LEAST, MOST), "the composite map's is also an attractor of the exact map, the"),
        ((0.285, 0.35), (LEAST, MOST), "neither map stays on the other's attractor"),
    ],
)
def test_which_attractor_is_also_the_other_map_s(pd: str, pair, d, starts, told) -> None:
    """The exact map at another d stands for the composite one: both of its attractors there are known (see dynamics.md)."""
    maps = [pair(value) for value in d]
    paths = [nsmaps.orbit(formulas, start, 2000) for formulas, start in zip(maps, starts, strict=True)]
    ends = [limit_set(formulas, path) for formulas, path in zip(maps, paths, strict=True)]
    orbits = OrbitPair(paths[0].states[0], *paths, ends=ends[0], composite_ends=ends[1])
    study = nsmaps.load_study(pd)
    (verdict,) = (
        v
        for v in Orbits().verdicts(nsmaps.StudyResult(study, maps[0], {"composite": maps[1], "orbits": (orbits,)}))
        if v.name.endswith(": same attractor as the exact map")
    )
    assert not verdict.holds
    assert {end.label for end in ends} == ({"2:1/2T", "1:1/2T"} if d[1] < 0.3 else {"2:1/2T", "1:1/T"})
    assert f"; {told}" in verdict.text


def test_the_unit_of_speed_does_not_count_between_attractors(pd: str) -> None:
    """Two cycles 2 % of the phases' extent apart, whatever the unit of the speeds."""
    result = nsmaps.run_study(pd)
    (orbits,) = result.orbits
    told = []
    for unit in (1e-4, 1, 1e4):
        scaled = [replace(end, states=end.states * [unit, 1]) for end in (orbits.ends, orbits.composite_ends)]
        grid = {
            name: axis.model_copy(update={"low": axis.low * by, "high": axis.high * by})
            for (name, axis), by in zip(result.study.grid.items(), (unit, 1), strict=True)
        }
        study = result.study.model_copy(update={"grid": grid})
        other = replace(result.with_parts({"orbits": (replace(orbits, ends=scaled[0], composite_ends=scaled[1]),)}), study=study)
        told.append([v.text for v in Orbits().verdicts(other) if v.name.endswith(": same attractor as the exact map")])
    assert told[0] == told[1] == told[2]


def test_an_orbit_that_leaves_all_pieces_has_no_attractor(good: str) -> None:
    Path("s.yaml").write_text(good.replace("where: v > 0.2,", "where: v > 0.31,").replace("require: [covered]\n", ""))
    result = nsmaps.run_study("s.yaml")
    keeps = [v for v in result.verdicts if v.name.endswith(": completes all returns") and v.of == "composite map"]
    assert [v.holds for v in keeps] == [False]
    assert keeps[0].text == "no: after 0 of 5 returns at (v = 0.3, phi = 1). That state lies in no piece."
    assert same(result).text == "no: the composite map's orbit does not complete all returns"
    assert result.orbits[0].composite_ends is None


def test_chaos_is_told_by_its_exponent() -> None:
    text = "system: vi_pair\nparameters: {d: 0.26, g_bar: 0.2113275}\norbits: [{start: {v: 0.7, phi: 0.3}, n_returns: 300}]\n"
    Path("s.yaml").write_text(text)
    result = nsmaps.run_study("s.yaml")
    found = result.orbits[0].ends
    assert found.period == 0
    resting = replace(found, exponent=-np.inf, exponent_error=np.nan, words=("BTB", "B~"))
    assert resting.text.endswith(", largest Lyapunov exponent -inf, as where orbits that rest become one")
    constant = replace(resting, words=("BTB",))
    assert constant.text.endswith(", largest Lyapunov exponent -inf, as where an image does not depend on the state")
    independent = nsmaps.lyapunov(result.system, starts=[0.7, 0.3], n_returns=20_000)
    assert found.exponent > 0
    assert found.exponent == pytest.approx(independent.exponents[0], abs=5 * found.exponent_error)
    assert f"largest Lyapunov exponent {found.exponent:.3g} +- " in result.verdicts[0].text
