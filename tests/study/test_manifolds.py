"""The section `manifolds` of a study: against the function, against the boundary of basins, in numbers and in its figure."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError, StudyError
from nsmaps.figures.longrun.manifolds import manifolds
from nsmaps.study.pictures.catalogue import caption
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.study import CATALOGUE

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "manifolds"


@pytest.fixture(scope="module")
def result():
    return nsmaps.read_result(STORED)


def test_it_is_what_the_function_grows(result):
    saddle = nsmaps.periodic_orbit(result.system, [0.34, 2.87], scale=result.manifolds["saddle"][0].scale)
    for which, kept in zip(("unstable", "stable"), result.manifolds["saddle"], strict=True):
        direct = nsmaps.manifold(result.system, saddle, which, length=2, gap=0.1)
        assert kept.which == which
        np.testing.assert_allclose(kept.states, direct.states, rtol=1e-9)
        assert kept.piece.tolist() == direct.piece.tolist()
        assert kept.ended == direct.ended


def test_lengths_are_in_units_of_the_scale_that_is_given(result, tmp_path):
    text = (
        (STORED / "study.yaml")
        .read_text()
        .replace("gap: 0.1", "gap: 0.1\n  scale: {v: 2, phi: 0.5}")
        .replace("length: 2.0", "length: 0.2")
    )
    (tmp_path / "own.yaml").write_text(text)
    study = nsmaps.load_study(tmp_path / "own.yaml")
    found = nsmaps.run_study(study.without("basins", "figures")).manifolds["saddle"][0]
    saddle = nsmaps.periodic_orbit(result.system, [0.34, 2.87], scale=[2, 0.5])
    np.testing.assert_allclose(found.states, nsmaps.manifold(result.system, saddle, length=0.2, gap=0.1).states, rtol=1e-9)
    assert found.scale.tolist() == [2, 0.5]


def test_numbers_verdicts_tables_and_caption_say_what_was_found(result):
    numbers = result.study.manifolds.numbers(result)["manifolds"]
    assert [row["which"] for row in numbers["saddle"]] == ["unstable", "stable"]
    assert numbers["sink: none"].startswith("the orbit has the multipliers")
    own, sink = result.study.manifolds.verdicts(result)
    assert (own.holds, own.text) == (True, "yes: unstable: length 2; stable: length 2")
    assert (sink.holds, sink.required) == (False, False)
    assert "expected: a saddle" in sink.text
    (table,) = result.study.manifolds.tables(result)
    assert [row[:2] for row in table.rows] == [("saddle", "unstable"), ("saddle", "stable")]
    assert "saddle, stable:" in caption(result, "manifolds")
    assert result.study.manifolds.describe(result.study) == "saddle (both, length 2), sink (unstable, length 10)"


def test_the_figure_draws_every_piece_in_one_turn(result):
    ax = Figure().subplots()
    found = result.manifolds["saddle"]
    manifolds(found, ax)
    lines = [line for line in ax.get_lines() if line.get_linestyle() == "-" and len(line.get_xdata())]
    assert len(lines) == sum(len(each.lines) for each in found)
    drawn = np.concatenate([np.asarray(line.get_ydata(), float) for line in lines])
    assert np.nanmin(drawn) >= 0
    assert np.nanmax(drawn) < 2 * np.pi
    steps = np.concatenate([np.diff(np.asarray(line.get_ydata(), float)) for line in lines])
    assert np.nanmax(np.abs(steps)) < np.pi
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["unstable manifold", "stable manifold", "saddle"]


def test_it_is_drawn_over_the_families_of_the_study(result):
    (sheet,) = CATALOGUE["manifolds"].sheets(result)
    (ax,) = sheet.figure().axes
    labels = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert {"unstable manifold", "stable manifold", "saddle"} < set(labels)
    assert len(labels) > 3


def test_the_stable_manifold_is_the_boundary_of_the_basins():
    """Points bisected between the basins of 2:1/T and of chaos, beside the saddle on its own side of the map's folds."""
    system = nsmaps.load_system("vi_pair", d=0.2265, r=0.25, M=0.1245, g=9.8, beta=np.pi / 6, F=5)
    axes = {"v": nsmaps.Axis(low=0.005, high=0.2, points=10), "phi": nsmaps.Axis(low=1.8, high=2.3, points=10)}
    made = nsmaps.basins(system, nsmaps.Grid(axes=axes), max_returns=300)
    line = nsmaps.basin_boundary(system, made, tolerance=1e-6, max_returns=300)
    saddle = nsmaps.periodic_orbit(system, [0.0429, 2.0548], 2)
    stable = nsmaps.manifold(system, saddle, "stable", length=1.0, gap=0.005)
    assert len(line.points) > 5
    for point in line.points:
        off = system.coordinates.difference(stable.states, point) / stable.scale
        nearest = np.linalg.norm(off, axis=1).argmin()
        assert np.linalg.norm(off[nearest]) < 0.005
        tangent = (stable.states[nearest + 1] - stable.states[nearest - 1]) / stable.scale
        across = abs(float(np.linalg.det([tangent / np.linalg.norm(tangent), off[nearest]])))
        assert across < 1e-4  # the curve between neighbours is not a line


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("gap: 0.1", "gap: 0", message("errors.greater", name="gap", value=0.0, bound=0)),
        ("name: sink", "name: saddle", message("study.given-twice", name="saddle")),
        ("gap: 0.1", "gap: 0.1\n  scale: {v: 1}", message("study.coordinate-missing", name="phi")),
        ("gap: 0.1", "gap: 0.1\n  scale: {v: 0, phi: 1}", message("errors.greater", name="v", value=0, bound=0)),
        ("v: 0.83, ", "", message("study.coordinate-missing", name="v")),
    ],
)
def test_errors_name_the_entry(old, new, said, tmp_path):
    text = (STORED / "study.yaml").read_text()
    assert old in text
    (tmp_path / "bad.yaml").write_text(text.replace(old, new))
    with pytest.raises(StudyError, match=said):
        nsmaps.run_study(nsmaps.load_study(tmp_path / "bad.yaml"))


def test_a_figure_of_no_manifold_says_why(result):
    with pytest.raises(NsmapsError, match=message("dynamics.no-saddle", at="the figure 'manifolds' has nothing to show")):
        CATALOGUE["manifolds"].sheets(result.with_parts({"manifolds": {"sink": ()}}))


def test_the_reasons_of_both_manifolds_are_kept(result, monkeypatch):
    def refused(system, orbit, which, **how):
        raise NsmapsError(f"no {which} one")

    monkeypatch.setattr("nsmaps.dynamics.manifolds.manifold.manifold", refused)
    own = result.study.manifolds
    plan = SimpleNamespace(
        system=result.system, bound={"manifolds": [(np.array(start), None) for start in ([0.34, 2.87], [0.83, 0.36])]}
    )
    reasons = own.compute(plan, result)["no_manifold"]
    assert reasons == {"saddle": "no unstable one; no stable one", "sink": "no unstable one"}
