"""A study's run: what it names and nothing else, its verdicts with their numbers, its folder, its figures again."""

import json
import re
import shutil
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from messages import message
from ruamel.yaml import YAML

from nsmaps import StudyResult, load_study, read_result, run_study
from nsmaps.coordinates import Coordinates
from nsmaps.dynamics.attractors.distance import extents, hausdorff
from nsmaps.errors import NsmapsError
from nsmaps.interrupts import Interrupted
from nsmaps.plugins import study_files
from nsmaps.progress import outermost
from nsmaps.study.binding import Plan
from nsmaps.study.sections.longrun.orbits import Orbits
from nsmaps.study.store.archive import FORMAT, resolved

WHOLE = """\
title: all of it
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.01, to: 0.5, points: 31}, phi: {from: 0, to: 2*pi, points: 41}}
families: {low: [BB], rest: ["B~", BB~]}
diagonal:
  family: low
  delta: 1.5
  sweep: {parameter: a, from: 0.2, to: 0.4, points: 2}
  region: "phi < pi"
  orders: {low: {full: {v: 1, phi: 1}}, high: {full: {v: 2, phi: 2}}}
composite:
  - {name: all, box: {v: [0, 1], phi: [0, 2*pi]}, family: low, fit: {full: {v: 2, phi: 3}}}
orbits:
  - {start: {v: 0.3, phi: 1}, n_returns: 3}
domains:
  - {name: fitted, map: all, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 2, require: [forward_invariant]}
  - {name: exact, map: exact, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 2}
  - {name: both, map: composite, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}
second_iterate: {domain: fitted}
require: [covered]
"""


@pytest.fixture
def whole(computed: Callable[..., tuple[StudyResult, Path]]) -> StudyResult:
    """The result of a study that names every section, with a copy of its folder, `out`."""
    result, folder = computed(WHOLE, "whole")
    shutil.copytree(folder, "out")
    return result


def test_only_what_is_named_is_computed() -> None:
    Path("small.yaml").write_text("system: ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, n_returns: 3}]\n")
    steps: list[str] = []
    result = run_study("small.yaml", progress=lambda share: steps.append(outermost().step))
    assert list(dict.fromkeys(steps)) == ["system", "orbits"]
    assert list(result.timings) == ["system", "orbits"]
    assert (result.surfaces, result.composite, result.domain, result.diagonal) == ({}, None, None, None)
    assert result.orbits[0].composite is None
    assert result.orbits[0].exact.states.shape == (4, 2)
    assert result.finished
    assert list(Path().iterdir()) == [Path("small.yaml")]


def test_the_steps_of_a_whole_study(whole: StudyResult) -> None:
    assert list(whole.timings) == ["system", "surfaces", "diagonal", "composite", "orbits", "domains", "second_iterate"]
    assert whole.returns is not None
    assert len(whole.returns) == 31 * 41
    assert set(whole.surfaces) == {"low", "rest"}
    low = whole.surfaces["low"]
    assert np.array_equal(low.member, whole.returns.has_word("BB") & whole.returns.valid)
    assert whole.diagonal is not None
    assert [value for value, _ in whole.diagonal.values] == [0.2, 0.4]
    assert [name for name, _ in whole.orders] == ["low", "high"]
    (simple, richer) = (report for _, report in whole.orders)
    assert np.all(richer.sse <= simple.sse)
    assert whole.domain is whole.domains["fitted"]
    assert whole.domains["fitted"].of == "fitted map all"
    assert whole.domains["both"].of == "composite map"


def test_orders_are_compared_on_the_states_near_the_diagonals(whole: StudyResult) -> None:
    assert whole.diagonal is not None
    (_, own), (_, other) = whole.diagonal.values
    count = len(own)
    assert 0 < len(other) < count < len(whole.surfaces["low"].start)
    assert all(np.all(np.asarray(report.points) == count) for _, report in whole.orders)
    (near,) = whole.near
    assert near.delta == 1.5
    np.testing.assert_array_equal(near.surface.start, own)
    np.testing.assert_array_equal(near.surface.image, whole.diagonal.images[0])
    assert [(name, made.report) for name, made in near.maps.items()] == list(whole.orders)


def test_orders_at_several_deltas_are_kept_with_their_maps(whole: StudyResult) -> None:
    Path("deltas.yaml").write_text(WHOLE.replace("  delta: 1.5\n", "  delta: 1.5\n  deltas: [1.3, 1.5, 1.7]\n"))
    result = run_study("deltas.yaml", out="kept")
    states = [len(near.surface.start) for near in result.near]
    assert [near.delta for near in result.near] == [1.5, 1.3, 1.7]
    assert states[1] < states[0] == len(whole.near[0].surface.start) < states[2]
    record = json.loads(Path("kept/result.json").read_text())["numbers"]["diagonal"]["orders"]
    assert [(row["delta"], row["points"][0]) for row in record[::2]] == list(zip((1.5, 1.3, 1.7), states, strict=True))
    sse = {(row["delta"], row["name"]): row["sse"] for row in record}
    again = read_result("kept").near
    for near, kept in zip(result.near, again, strict=True):
        for name, made in near.maps.items():
            np.testing.assert_array_equal(made(near.surface.start), kept.maps[name](kept.surface.start))
            assert sse[near.delta, name] == made.report.sse.tolist()


@pytest.mark.parametrize(
    ("data", "kept"),
    [
        ("diagonal", None),
        ('"0.1 < v < 0.3 and phi < 2"', lambda v, phi: (v > 0.1) & (v < 0.3) & (phi % (2 * np.pi) < 2)),
    ],
)
def test_a_piece_may_be_fitted_to_other_data_than_its_region(
    data: str, kept: Callable[..., np.ndarray] | None, whole: StudyResult
) -> None:
    Path("data.yaml").write_text(WHOLE.replace("family: low, fit", f"family: low, data: {data}, fit"))
    result = run_study("data.yaml")
    assert result.diagonal is not None
    own = next(states for value, states in result.diagonal.values if value == 0.2)
    count = len(own) if kept is None else np.sum(kept(*result.surfaces["low"].start.T))
    (piece,) = result.composite.pieces
    assert piece.map.report.points.tolist() == [count, count]
    assert piece.region == whole.composite.pieces[0].region


def test_every_verdict_names_its_map_and_its_numbers(whole: StudyResult) -> None:
    by_name = {(verdict.name, verdict.of): verdict for verdict in whole.verdicts}
    assert list(by_name) == [
        ("covered", "composite map"),
        ("words agree with the exact map", "composite map"),
        ("orbit from (v = 0.3, phi = 1): completes all returns", "exact map"),
        ("orbit from (v = 0.3, phi = 1): completes all returns", "composite map"),
        ("orbit from (v = 0.3, phi = 1): same attractor as the exact map", "composite map"),
        *((f"domain fitted: {claim}", "fitted map all") for claim in ("forward invariant", "converged")),
        *((f"domain exact: {claim}", "exact map") for claim in ("forward invariant", "converged")),
        *((f"domain both: {claim}", "composite map") for claim in ("forward invariant", "converged")),
    ]
    required = [verdict.name for verdict in whole.verdicts if verdict.required]
    assert required == ["covered", "domain fitted: forward invariant"]
    for verdict in whole.verdicts:
        assert verdict.text.startswith("yes: " if verdict.holds else "no: ")
    exact = by_name["domain exact: forward invariant", "exact map"]
    assert exact.holds == whole.domains["exact"].forward_invariant
    returning = by_name["orbit from (v = 0.3, phi = 1): completes all returns", "exact map"].text
    v, phi = whole.orbits[0].exact.states[-1]
    assert f"(v = {v:.5g}, phi = {phi:.5g})" in returning
    assert whole.holds == all(verdict.holds for verdict in whole.verdicts if verdict.required)


def test_a_domain_says_how_it_bounds_and_for_which_map() -> None:
    more = """\
domains:
  - {name: own, map: all, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}
  - {name: with its error, map: all, bounds_kind: inflated, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}
  - {name: on a grid, map: exact, bounds_kind: sampled, box: diagonal, max_updates: 1}
"""
    Path("bounds.yaml").write_text(WHOLE.split("domains:")[0] + more)
    result = run_study("bounds.yaml", out="out")
    own, moved, grid = result.domains.values()
    assert [(d.of, d.status) for d in (own, moved, grid)] == [
        ("fitted map all", "outer"),
        ("exact map, by fitted map all", "inflated by held-out error"),
        ("exact map", "sampled"),
    ]
    assert [d.claim for d in (own, moved, grid)] == [
        "enclosed for the fitted map all: outer",
        "estimated for the exact map, by fitted map all: inflated by held-out error",
        "sampled for the exact map",
    ]
    width = moved.updates[0].envelopes[0].upper - own.updates[0].envelopes[0].upper
    states = np.random.default_rng(7).uniform([0.1, 0.2], [0.3, 1], (2000, 2))
    error = np.abs(result.composite.piece("all").map(states) - result.system.first_return(states).lifted)[:, 0]
    assert width == pytest.approx(np.full(201, width[0]))
    assert width[0] >= error.max()
    near = result.diagonal.values[0][1]
    assert grid.boxes[0] == pytest.approx(np.column_stack([near.min(axis=0), near.max(axis=0)]))
    assert read_result("out").domains["own"].updates[0].envelopes[0].kind == own.updates[0].envelopes[0].kind
    kept = json.loads(Path("out/result.json").read_text(), parse_constant=pytest.fail)["numbers"]["domains"]["own"]
    assert kept["part"] == list(own.part)


def test_what_no_piece_covers_is_said() -> None:
    text = WHOLE.replace("phi: [0, 2*pi]", "phi: [0, 3]").split("domains:")[0] + "require: [covered]\n"
    Path("part.yaml").write_text(text)
    result = run_study("part.yaml")
    covered = result.verdicts[0]
    assert (covered.name, covered.holds, covered.required, result.holds) == ("covered", False, True, False)
    phi = result.returns.start[:, 1]
    share = 100 * np.mean((phi > 3) & (phi < 2 * np.pi))
    assert covered.text.startswith(f"no: {share:.3g} % of the grid lies in no piece, within v in [0.01, 0.5] x phi in [")


def test_a_study_as_resolved_reads_back_as_itself(whole: StudyResult) -> None:
    again = load_study("out/study.yaml")
    assert again == whole.study
    assert again.name == "whole"
    assert resolved(again) == Path("out/study.yaml").read_text()
    assert "to: 6.283185307179586" in Path("out/study.yaml").read_text()


def test_the_folder_of_a_run(whole: StudyResult) -> None:
    assert {path.name for path in Path("out").iterdir()} == {"study.yaml", "result.json", "arrays.npz"}
    record = json.loads(Path("out/result.json").read_text(), parse_constant=pytest.fail)
    assert record["format"] == FORMAT
    assert record["system"]["parameters"] == {"a": 0.2, "r": 0.8}
    assert record["versions"]["system"] == "balls 1.0"
    assert {"python", "numpy", "numba"} <= set(record["versions"])
    assert [verdict["name"] for verdict in record["verdicts"]] == [verdict.name for verdict in whole.verdicts]
    assert sum(record["numbers"]["returns"]["outcomes"].values()) == 31 * 41
    assert record["numbers"]["domains"]["fitted"]["boxes"][0] == [[0.1, 0.3], [0.2, 1.0]]
    for name, domain in whole.domains.items():
        apart = [abs(cycle.iterated - cycle.roots).max() for cycle in domain.cycles]
        told = [cycle["apart"] for cycle in record["numbers"]["domains"][name]["cycles"]]
        assert told == [None if np.isnan(value) else value for value in apart]
    with np.load("out/arrays.npz") as arrays:
        assert np.array_equal(arrays["domains/fitted/boxes"], whole.domains["fitted"].boxes)


def test_a_result_reads_back_as_it_was(whole: StudyResult) -> None:
    again = read_result("out")
    assert again.study == whole.study
    assert again.system == whole.system
    assert again.verdicts == whole.verdicts
    assert again.returns is not None
    assert again.returns.coordinates == whole.returns.coordinates == Coordinates(("v", "phi"), ("phi",))
    stored = json.dumps(json.loads(Path("out/result.json").read_text()))
    assert '{"$": "nsmaps.coordinates:Coordinates", "names": ["v", "phi"], "angles": ["phi"]}' in stored
    states = whole.returns.start[:50]
    assert np.array_equal(again.composite.first_return(states).image, whole.composite.first_return(states).image)
    assert np.array_equal(again.surfaces["low"].lifted, whole.surfaces["low"].lifted)
    assert np.array_equal(again.orbits[0].exact.words, whole.orbits[0].exact.words)
    update, before = again.domains["exact"].updates[0], whole.domains["exact"].updates[0]
    assert np.array_equal(update.envelopes[1].upper, before.envelopes[1].upper)
    assert again.second_iterate.alpha == whole.second_iterate.alpha
    assert [report.r2.tolist() for _, report in again.orders] == [report.r2.tolist() for _, report in whole.orders]


PARAMETRIC = WHOLE.split("orbits:")[0] + "parametric_map: {parameter: a, bounds: [0.2, 0.4], degree: 3, require: [follows]}\n"


def test_a_parametric_map_is_made_held_against_refits_and_kept() -> None:
    Path("swept.yaml").write_text(PARAMETRIC)
    result = run_study("swept.yaml", out="out")
    made = result.parametric_map
    assert made is not None
    assert len(made.nodes) == 7
    assert made.report is not None
    assert (made.report.values[0], made.report.values[-1], len(made.report.values)) == (0.2, 0.4, 8)
    (verdict,) = (v for v in result.verdicts if v.name == "parametric_map: follows")
    assert (verdict.of, verdict.holds, verdict.required) == ("parametric map", False, True)
    assert verdict.text == "no: the exact map has no attractor from the start at any value compared"  # the ball comes to rest
    states = result.returns.start[:50]
    Path("own.yaml").write_text(PARAMETRIC.replace("a: 0.2}", "a: 0.3}").split("parametric_map:")[0])
    fitted = run_study("own.yaml").composite  # the truth: the same pieces, fitted at the value itself
    apart = np.abs(made.at(0.3).piece("all").map(states) - fitted.piece("all").map(states)).max()
    assert apart <= made.report.refit.max()
    kept = json.loads(Path("out/result.json").read_text(), parse_constant=pytest.fail)["numbers"]["parametric_map"]
    assert (kept["parameter"], kept["from"], kept["to"]) == ("a", 0.2, 0.4)
    assert kept["pieces"]["all"]["difference"] == made.report.difference.max(axis=1)[0].tolist()
    again = read_result("out").parametric_map
    assert np.array_equal(again.at(0.3).first_return(states).image, made.at(0.3).first_return(states).image, equal_nan=True)


def test_a_value_at_which_a_piece_has_no_data_is_named() -> None:
    text = PARAMETRIC.replace("orders: {low: {full: {v: 1, phi: 1}}, high: {full: {v: 2, phi: 2}}}", "orders: {}")
    Path("swept.yaml").write_text(
        text.replace("family: low, fit", "family: low, data: diagonal, fit").replace("0.4], d", "9], d")
    )
    at = r"swept.yaml:\d+:\d+: at a = [\d.]+: swept.yaml:\d+:\d+: piece 'all': v'"
    with pytest.raises(NsmapsError, match=message("reduced.at-values", at=re.compile(at))):
        run_study("swept.yaml")


PRINTED = """\
system: ball
parameters: {a: 0.2}
composite:
  - {name: near, box: {v: [0, 0.5], phi: [0, 2*pi]}, polynomial: maps/printed.json#near}
  - name: far
    where: v > 0.5
    polynomial: {over: {v: [0, 1], phi: [0, 7]}, absolute: [v], images: {v: {"1": -1, v: 0.5}, phi: {"1": 1}}}
orbits: [{start: {v: 0.3, phi: 1}, n_returns: 2}]
domains: [{name: printed, map: near, box: {v: [0.1, 0.3], phi: [0.2, 1]}, max_updates: 1}]
"""
NEAR = """{"note": "of a ball", "near": {"parameter": "a", "over": {"v": [0, 0.5], "phi": [0, "2*pi"]},
"images": {"v": {"v": [0, 2.5], "1": [0.1, 1]}, "phi": {"phi": 1, "v*phi": [0, 1]}}}}"""


def test_printed_coefficients_are_a_piece_and_the_run_stands_alone() -> None:
    Path("maps").mkdir()
    Path("maps/printed.json").write_text(NEAR)
    Path("printed.yaml").write_text(PRINTED)
    result = run_study("printed.yaml", out="out")
    image = result.composite.first_return([[0.3, 1.0], [0.8, 2.0]]).image
    np.testing.assert_allclose(image, [[0.2 * 2.5 * 0.3 + 0.1 + 0.2, 1 + 0.2 * 0.3], [1 - 0.4, 1]], rtol=1e-14)
    assert result.domains["printed"].of == "printed map near"
    Path("maps/printed.json").unlink()
    assert load_study("out/study.yaml") == result.study
    with pytest.raises(
        NsmapsError, match=message("study.no-table", file="maps/printed.json#near", at=re.compile(r"printed\.yaml:4:\d+"))
    ):
        load_study("printed.yaml")
    Path("maps/printed.json").write_text(NEAR.replace('"near"', '"nera"'))
    with pytest.raises(NsmapsError, match=message("errors.unknown-near", kind="polynomial", name="near")):
        load_study("printed.yaml")


def test_printed_coefficients_are_parametric_too() -> None:
    Path("maps").mkdir()
    Path("maps/printed.json").write_text(NEAR)
    Path("printed.yaml").write_text(PRINTED + "parametric_map: {parameter: a, bounds: [0.1, 0.3], degree: 1}\n")
    result = run_study("printed.yaml")
    assert result.parametric_map.report is None
    assert not any(verdict.name.startswith("parametric") for verdict in result.verdicts)
    image = result.parametric_map.at(0.25).first_return([[0.3, 1.0], [0.8, 2.0]]).image
    np.testing.assert_allclose(image, [[0.25 * 2.5 * 0.3 + 0.1 + 0.25, 1 + 0.25 * 0.3], [1 - 0.4, 1]], rtol=1e-13)


def test_no_class_but_our_own_is_made_from_a_file(whole: StudyResult) -> None:
    record = json.loads(Path("out/result.json").read_text())
    for stranger in ("subprocess:Popen", "nsmaps.plugins:load_system", "nsmaps.study.store.serialize:np"):
        record["objects"]["coverage"] = {"$": stranger, "args": "ls"}
        Path("out/result.json").write_text(json.dumps(record))
        with pytest.raises(NsmapsError, match=message("study.class-of-result", cls=stranger)):
            read_result("out")


def test_a_folder_that_holds_no_result(whole: StudyResult) -> None:
    with pytest.raises(NsmapsError, match=message("study.no-result", folder="nowhere", file="result.json")):
        read_result("nowhere")
    Path("out/result.json").write_text('{"format": 99}')
    with pytest.raises(NsmapsError, match=message("study.format", found=99, format=FORMAT)):
        read_result("out")


def test_ctrl_c_keeps_what_is_finished() -> None:
    def stop(share: float) -> None:
        if outermost().step == "domains":
            raise KeyboardInterrupt

    Path("whole.yaml").write_text(WHOLE)
    with pytest.raises(Interrupted) as stopped:
        run_study("whole.yaml", out="out", progress=stop)
    kept = read_result("out")
    assert (kept.finished, kept.domains, kept.second_iterate) == (False, {}, None)
    assert list(kept.timings) == ["system", "surfaces", "diagonal", "composite", "orbits"]
    assert np.array_equal(kept.orbits[0].exact.states, stopped.value.result.orbits[0].exact.states)
    composite = "composite map"
    assert [verdict.of for verdict in kept.verdicts] == [composite, composite, "exact map", composite, composite]


def test_ctrl_c_that_a_step_loses_still_stops_the_run(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    work, handler = Orbits.compute, signal.signal(signal.SIGINT, signal.default_int_handler)

    def lost(orbits: Orbits, plan: Plan, result: StudyResult) -> dict[str, Any]:
        with suppress(KeyboardInterrupt):  # as C code may that looks up an attribute
            signal.raise_signal(signal.SIGINT)
        work(orbits, plan, result)
        raise AssertionError("the next progress of the step stops it")

    monkeypatch.setattr(Orbits, "compute", lost)
    Path("s.yaml").write_text(good)
    try:
        with pytest.raises(Interrupted):
            run_study("s.yaml", out="out")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, handler)
    kept = read_result("out")
    assert not kept.finished
    assert list(kept.timings) == ["system", "surfaces", "composite"]
    monkeypatch.setattr(Orbits, "compute", work)
    assert run_study("s.yaml", out="out", resume=True).finished


def test_ctrl_c_within_a_cover_stops_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    from nsmaps.cells import morse as cover

    whole, levels = cover._next, []

    def stopped(return_map: Any, stage: Any, level: int, depth: int) -> Any:
        levels.append(level)
        if level == 1:
            raise KeyboardInterrupt
        return whole(return_map, stage, level, depth)

    Path("s.yaml").write_text("system: ball\nparameters: {a: 0.2}\nmorse_sets: {box: {v: [0.1, 0.3], phi: [0.2, 1]}, depth: 2}\n")
    with monkeypatch.context() as patched:
        patched.setattr(cover, "_next", stopped)
        with pytest.raises(Interrupted):
            run_study("s.yaml", out="out")
    assert levels == [0, 1]
    assert "morse_sets" not in read_result("out").timings
    shares: list[float] = []
    result = run_study("s.yaml", out="out", progress=shares.append, resume=True)
    assert result.morse_sets is not None
    assert result.morse_sets.finished
    assert {0, 1 / 2, 5 / 8, 3 / 4, 1} <= set(shares)  # of steps and levels
    assert shares == sorted(shares)


def test_a_second_run_leaves_nothing_of_the_first(whole: StudyResult) -> None:
    Path("whole.yaml").write_text("system: ball\nparameters: {a: 0.2}\norbits: [{start: {v: 0.3, phi: 1}, n_returns: 3}]\n")
    run_study("whole.yaml", out="out")
    again = read_result("out")
    assert (again.study.title, again.composite, again.surfaces) == ("", None, {})
    assert {path.name for path in Path("out").iterdir()} == {"study.yaml", "result.json", "arrays.npz"}


def test_a_system_in_a_file_is_found_from_the_studys_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    import inspect

    from nsmaps.plugins import system_class

    Path("deep").mkdir()
    source = inspect.getsource(__import__("sys").modules[system_class("ball").__module__])
    Path("deep/mine.py").write_text(source)
    Path("deep/s.yaml").write_text("system: mine.py:Ball\nparameters: {a: 1}\n")
    study = load_study("deep/s.yaml")
    assert study.system == f"{Path('deep/mine.py').resolve()}:Ball"
    assert study.system_object().parameters == {"a": 1.0, "r": 0.8}


LONG_RUN = """\
system: ball
parameters: {a: 0.2}
grid: {v: {from: 0.01, to: 0.5, points: 31}, phi: {from: 0, to: 2*pi, points: 41}}
families: {low: [BB]}
composite:
  - {name: all, box: {v: [0, 1], phi: [0, 2*pi]}, family: low, fit: {full: {v: 2, phi: 3}}}
bifurcation_diagram:
  {parameter: a, from: 0.2, to: 0.4, points: 3, starts: [{v: 0.3, phi: 1}], transient: 10, n_returns: 4, map: [exact, composite]}
figures: [bifurcation_diagram]
"""


def test_bifurcation_is_that_of_maps_made_at_each_value() -> None:
    Path("long.yaml").write_text(LONG_RUN)
    result = run_study("long.yaml", out="long")
    again = read_result("long")
    for k, a in enumerate((0.2, 0.3, 0.4)):
        Path("one.yaml").write_text(
            LONG_RUN.replace("parameters: {a: 0.2}", f"parameters: {{a: {a}}}").partition("bifurcation_diagram:")[0]
        )
        alone = run_study("one.yaml")
        assert alone.composite is not None
        for of, return_map in (("exact", alone.system), ("composite", alone.composite)):
            state = np.array([[0.3, 1.0]])
            path = []
            for _ in range(14):
                state = return_map.first_return(state).image
                path.append(state[0])
            for made in (result, again):
                assert np.allclose(made.bifurcation_diagram[of].states[k, 0], path[10:], atol=1e-12, equal_nan=True)
    assert result.bifurcation_diagram["exact"].held.all()
    record = json.loads(Path("long/result.json").read_text())["numbers"]["bifurcation_diagram"]
    assert record["exact"]["ended"] == 0
    assert record["exact"]["motions"][0]["from"] == 0.2


def test_a_bifurcation_does_not_make_partitions() -> None:
    text = "".join(line for line in LONG_RUN.splitlines(keepends=True) if "composite:" not in line and "name: all" not in line)
    Path("parts.yaml").write_text(text + "partition: {tolerance: 1e-2}\n")
    with pytest.raises(NsmapsError, match=message("study.one-value")):
        run_study("parts.yaml")


def test_both_ways_tell_what_coexists() -> None:
    """The shipped study around its window, whose ends are a fold at 0.227713761 and a crisis between 0.22504 and 0.22506."""
    whole = YAML(typ="safe").load(study_files("vi_pair")["bistable"].read_text())
    part = {key: whole[key] for key in ("system", "parameters", "bifurcation_diagram")}
    part["bifurcation_diagram"] |= {"from": 0.22, "to": 0.23, "points": 101}  # of its own values
    Path("part.yaml").write_text(json.dumps(part))
    result = run_study("part.yaml", out="both")
    assert result.bifurcation_diagram["exact"].held.all()
    record = json.loads(Path("both/result.json").read_text())["numbers"]["bifurcation_diagram"]["exact"]["attractors"]
    low, chaos = (next(row for row in record if row["label"] == label) for label in ("2:1/T", "C"))
    assert low["attractor"] != chaos["attractor"]
    assert 0.2274 < low["to"] < 0.227713761
    assert 0.2250 < chaos["from"] <= 0.22525


def test_a_step_that_fails_keeps_those_before_it(good: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(orbits: Orbits, plan: Plan, result: StudyResult) -> dict[str, Any]:
        raise ZeroDivisionError("raised by the test")

    Path("s.yaml").write_text(good)
    with monkeypatch.context() as patched:
        patched.setattr(Orbits, "compute", failing)
        with pytest.raises(ZeroDivisionError, match=message("others.raised")):
            run_study("s.yaml", out="out")
    kept = read_result("out")
    assert not kept.finished
    assert list(kept.timings) == ["system", "surfaces", "composite"]
    assert run_study("s.yaml", out="out", resume=True).finished


@pytest.mark.parametrize("name", ["result.json", "study.yaml", "arrays.npz"])
def test_a_file_of_a_run_that_is_cut_off_or_missing(whole: StudyResult, name: str) -> None:
    file = Path("out", name)
    content = file.read_bytes()
    if name != "study.yaml":
        file.write_bytes(content[: len(content) // 2])
        with pytest.raises(NsmapsError, match=message("study.unread", file=f"out/{name}")):
            read_result("out")
    file.unlink()
    said = message("study.no-result", file=name) if name == "result.json" else message("study.file-missing", file=f"out/{name}")
    with pytest.raises(NsmapsError, match=said):
        read_result("out")


PLANE = """\
system: recoil_pair
parameters: {eta: 0.05, kappa: 0.04, Lambda: 0.2, d: 0.35, r: 0.5, g_bar: 0.2113}
grid: {GRID}
families: {BTB: [BTB]}
composite:
  - name: all
    where: v > 0
    family: BTB
    polynomial:
      images: {v: {"1": 0.5, v: 0.4}, X: {X: 1}, V: {V: 1}, phi: {phi: 0.9}}
      over: {v: [0.6, 1], X: [0, 0.2], V: [-1, 0], phi: [0.2, 0.6]}
orbits:
  - {start: {v: 0.84, X: 0.09, V: -0.67, phi: 0.4}, n_returns: 30}
"""
SIDES = ["v: {from: 0.6, to: 1.0, points: 4}", "X: 0.09", "V: -0.67", "phi: {from: 0.2, to: 0.6, points: 4}"]


def test_a_grid_with_coordinates_held_is_judged_in_those_that_vary_and_in_any_order_of_its_keys() -> None:
    texts = []
    for sides in (SIDES, SIDES[::-1]):
        Path("plane.yaml").write_text(PLANE.replace("{GRID}", "{" + ", ".join(sides) + "}"))
        result = run_study("plane.yaml")
        texts.append([verdict.text for verdict in result.verdicts])
        exact, other = (ends.states for ends in (result.orbits[0].ends, result.orbits[0].composite_ends))
        scale = [0.4, *extents(result.orbits[0].exact.states, result.system.coordinates)[1:3], 0.4]
        distance = hausdorff(exact, other, result.system.coordinates, scale, np.inf)
        assert f"at a distance of {distance:.2g} relative" in texts[-1][-1]
        assert "nan" not in "".join(texts[-1])
    assert texts[0] == texts[1]
