"""The section `plane` of a study: against the function, in numbers, tables and captions, and resumed."""

from pathlib import Path

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import StudyError
from nsmaps.study.pictures.catalogue import caption
from nsmaps.study.store.archive import FORMAT
from nsmaps.study.study import Study

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "plane" / "study.yaml"
ARRAYS = ("motion", "attractor", "exponent", "outcome", "state", "means", "refused", "computed")

OBSERVABLES = ["loss", {"name": "fastest", "formula": "v", "largest": True}]


@pytest.fixture(scope="module")
def result():
    return nsmaps.run_study(nsmaps.load_study(STORED))


def test_it_is_the_chart_of_the_function(result):
    plane = {"d": np.linspace(0.24, 0.36, 5), "r": np.linspace(0.45, 1.05, 4)}
    direct = nsmaps.parameter_plane(
        result.system, plane, [[0.8, 0.4], [0.2, 3.0]], n_returns=40, transient=200, max_period=16, observables=OBSERVABLES
    )
    assert direct.motions == result.parameter_plane.motions
    for name in ARRAYS:
        assert getattr(direct, name).tobytes() == getattr(result.parameter_plane, name).tobytes()
    curve = result.plane_curves["period doubling of 1:1"]
    assert np.abs(curve.multipliers + 1).min(axis=1).max() < 1e-9
    assert curve.parameters[:, 0].min() >= 0.3  # the range of the branch
    assert curve.parameters[:, 1].min() == pytest.approx(0.45)


def test_numbers_verdicts_tables_and_caption_say_what_was_found(result):
    section = result.study.parameter_plane
    numbers = section.numbers(result)["parameter_plane"]
    shares = {name: (result.parameter_plane.labels == name).any(axis=2).mean() for name in numbers["shares"]}
    assert numbers["shares"] == pytest.approx(shares)
    assert (numbers["refused"], numbers["computed"], numbers["returns"]) == (5, 20, result.parameter_plane.n_returns)
    assert numbers["observables"]["fastest"] == [
        np.nanmin(result.parameter_plane.means[..., 1]),
        np.nanmax(result.parameter_plane.means[..., 1]),
    ]
    (verdict,) = [each for each in result.verdicts if each.name == "parameter_plane: a map at every value"]
    assert verdict.text == "no: none at 5 of 20 pixels; VIPair: r is 1.05; expected: less than or equal to 1"
    (table,) = section.tables(result)
    assert table.rows[0] == ("1:1/T", f"{100 * shares['1:1/T']:.3g} %")
    assert "the system refuses the parameters of 5 pixels" in caption(result, "parameter_plane")
    assert result.study.parameter_plane.describe(result.study) == "5 values of d x 4 values of r; 9,600 returns"


def test_a_study_that_stopped_goes_on_with_the_same_numbers(result, tmp_path, monkeypatch):
    study = nsmaps.load_study(STORED)
    monkeypatch.setattr("nsmaps.dynamics.planes.parameter_plane.PART", 240 * 2 * 4)
    count = 0

    def stop(share):
        nonlocal count
        count += len(list((tmp_path / "parts" / "parameter_plane").rglob("part-*.npz"))) >= 2
        if count:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nsmaps.run_study(study, out=tmp_path, progress=stop)
    assert len(list((tmp_path / "parts" / "parameter_plane").rglob("part-*.npz"))) == 2
    again = nsmaps.run_study(study, out=tmp_path, resume=True)
    for name in ARRAYS:
        assert getattr(again.parameter_plane, name).tobytes() == getattr(result.parameter_plane, name).tobytes()


def test_a_plane_outside_of_the_class_is_an_error_of_the_study():
    study = {
        "name": "none",
        "system": "vi_pair",
        "parameters": {"d": 0.3, "g_bar": 0.2},
        "parameter_plane": {
            "axes": {"d": {"from": -2, "to": -1, "points": 3}, "r": {"from": 0.1, "to": 0.9, "points": 2}},
            "starts": [{"v": 0.8, "phi": 0.4}],
        },
    }
    with pytest.raises(StudyError, match=message("errors.greater", name="d", value=-2.0, bound=0)):
        nsmaps.run_study(Study.model_validate(study))
