"""A run keeps the borders of its diagrams' windows, and refits pieces to the same states as on all of the grid."""

import json

import numpy as np
import pytest

import nsmaps
from nsmaps.study.prepare import prepare
from nsmaps.study.sections.maps import refits

STUDY = """
title: Two windows
system: vi_pair
parameters: {d: 0.35, r: 0.5, M: 0.1245, g: 9.8, beta: pi/3, F: 5}
grid:
  v: {from: 0.0033, to: 1, points: 100}
  phi: {from: 0, to: pi, points: 100}
families: {BTB: [BTB]}
composite:
  - name: R1
    box: {v: [0.6, 1], phi: [0.06, 1.4]}
    family: BTB
    data: 0.65 <= v <= 0.94 and 0.12 <= phi <= 0.6
    fit: {full: {v: 5, phi: 4}}
bifurcation_diagram:
  {parameter: d, from: 0.3, to: 0.35, points: 21, starts: [{v: 0.83, phi: 0.36}], direction: down, map: [exact, composite]}
"""


@pytest.mark.thorough
def test_a_run_keeps_its_borders(tmp_path):
    (tmp_path / "two.yaml").write_text(STUDY)
    result = nsmaps.run_study(tmp_path / "two.yaml", tmp_path / "out")
    again = nsmaps.read_result(tmp_path / "out").bifurcation_diagram
    assert {of: each.windows for of, each in again.items()} == {
        of: each.windows for of, each in result.bifurcation_diagram.items()
    }
    record = json.loads((tmp_path / "out" / "result.json").read_text())["numbers"]["bifurcation_diagram"]
    for of, names in (("exact", ["1:1/2T", "1:1/T"]), ("composite", ["1:1, period 2", "1:1, period 1"])):
        assert [window["label"] for window in record[of]["windows"]] == names
        assert {window.low.value for window in result.bifurcation_diagram[of].windows} == {
            window["low"]["value"] for window in record[of]["windows"]
        }
        assert result.bifurcation_diagram[of].windows[1].low.kind == "period doubling"
    exact, fitted = (result.bifurcation_diagram[of].windows[1].low.value for of in ("exact", "composite"))
    assert abs(exact - 0.32418854) < 1e-8 < abs(fitted - exact)


def test_a_refit_of_the_states_that_pieces_use_is_that_of_the_whole_grid(tmp_path, monkeypatch):
    (tmp_path / "two.yaml").write_text(STUDY)
    plan = prepare(nsmaps.load_study(tmp_path / "two.yaml"))
    other = plan.system.at(d=0.31)
    some, data = refits.refit(plan, other)
    assert len(refits._used(plan, other)) < plan.grid.size / 10
    monkeypatch.setattr(refits, "_used", lambda plan, system: np.arange(plan.grid.size))
    whole, all_data = refits.refit(plan, other)
    for one, two in zip(some.pieces[0].map.coefficients, whole.pieces[0].map.coefficients, strict=True):
        assert np.array_equal(one, two)
    assert np.array_equal(data["R1"].member, all_data["R1"].member)
