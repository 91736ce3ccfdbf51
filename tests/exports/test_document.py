"""JSON and Python modules read back as the identical map; nothing else is accepted."""

import json
import re
from dataclasses import fields, is_dataclass

import exported
import numpy as np
import pytest
from messages import message
from pydantic import BaseModel

import nsmaps
from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.reduced.composite.parametric import ParametricReport
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.study.store.serialize import decode, encode
from nsmaps.symbolic.curve_iterates import second_iterate

CASES = exported.cases()
GENERAL = second_iterate(PolynomialFit(degrees={"v": 3, "phi": 2}))


def same(a, b):
    """Whether two results are the same, arrays to the bit."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, BaseModel):
        return same(dict(a), dict(b))
    if is_dataclass(a):
        return all(same(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return a == b


@pytest.mark.parametrize("language", ["json", "python"])
@pytest.mark.parametrize("name", CASES)
def test_what_is_read_back_is_identical(name, language, tmp_path):
    result, box, _ = CASES[name]
    nsmaps.export(result, language, tmp_path)
    (file,) = tmp_path.iterdir()
    read = nsmaps.load_map(file)
    assert same(read, result) or name == "functions"  # which has a region that is read back as its condition
    if name in ("map", "composite"):
        states = exported.states_of(box)
        evaluated = [each.first_return(states).image if name == "composite" else each(states) for each in (read, result)]
        assert evaluated[0].tobytes() == evaluated[1].tobytes()


def test_a_difference_would_be_seen():
    result = CASES["map"][0]
    nudged = [c.copy() for c in result.coefficients]
    nudged[1][3] = np.nextafter(nudged[1][3], 1)
    other = type(result)(result.coordinates, result.exponents, tuple(nudged), result.centre, result.scale, result.domain, ("v",))
    assert same(result, result)
    assert not same(result, other)


def test_reports_and_general_coefficients_are_kept(tmp_path):
    fitted = fit_of_a_sheet()
    assert fitted.report is not None
    assert same(of_json(fitted, tmp_path / "a"), fitted)
    general = of_json(GENERAL, tmp_path / "b")
    assert same((general.alpha, general.held), (GENERAL.alpha, GENERAL.held))
    parametric = exported.parametric()
    errors = np.array([[[1e-3, np.nan]], [[np.inf, 2e-3]]])
    report = ParametricReport(("P0", "P1"), np.array([0.3]), errors, errors, errors)
    told = type(parametric)(*(report if f.name == "report" else getattr(parametric, f.name) for f in fields(parametric)))
    assert same(of_json(told, tmp_path / "c"), told)


def of_json(result, folder):
    nsmaps.export(result, "json", folder)
    (file,) = folder.iterdir()
    assert json.loads(file.read_text())["version"] == 1
    return nsmaps.load_map(file)


def fit_of_a_sheet():
    from sheets import surface_of

    surface = surface_of(lambda v, phi: (np.cos(v) * phi, v + np.sin(phi)), (0.1, 0.9, 12), (0.2, 1.1, 11))
    return PolynomialFit(degrees={"v": 2, "phi": 2}).fit(surface)


def test_angles_are_told_from_other_coordinates(tmp_path):
    read = of_json(CASES["composite"][0], tmp_path)
    assert [isinstance(name, Angle) for name in read.coordinates] == [False, True]
    assert [isinstance(name, Angle) for name in read.pieces[0].map.coordinates] == [False, True]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.json", "{}", message("exports.schema", schema="None", version="None")),
        ("a.json", "[1, 2]", message("exports.schema", schema="None", version="None")),
        ("a.json", "{", message("exports.not-a-map")),
        (
            "a.json",
            '{"schema": "nsmaps", "version": 2, "kind": "polynomial map"}',
            message("exports.schema", schema="'nsmaps'", version=2),
        ),
        ("a.json", '{"schema": "nsmaps", "version": 1, "kind": "poem"}', message("exports.kind", kind="poem")),
        (
            "a.json",
            '{"schema": "nsmaps", "version": 1, "kind": "polynomial map"}',
            message("exports.not-a-map", why="KeyError: 'coordinates'"),
        ),
        ("a.py", "MAP = 3 +", message("exports.not-a-map", why="SyntaxError")),
        ("a.py", "MAQ = {}", message("exports.no-table")),
        ("a.py", "MAP = open('b', 'w')", message("exports.not-a-map")),
    ],
)
def test_other_files_are_refused(name, text, said, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(NsmapsError) as told:
        nsmaps.load_map(tmp_path / name)
    assert re.search(said, str(told.value))
    assert not (tmp_path / "b").exists()


def test_a_region_of_a_class_is_read_back_as_its_condition(tmp_path):
    """Also from the file of a run."""
    whole = exported.functions()
    nsmaps.export(whole, "json", tmp_path)
    read = nsmaps.load_map(tmp_path / "composite_map.json").pieces[-1].region
    disc = whole.pieces[-1].region
    states = exported.states_of([[0, 1.5], [0, 6.28]])
    assert read.text == "(phi - 6.0)**2 + (v - 0.9)**2 < 0.16000000000000003"
    assert np.array_equal(read.contains(states), disc.contains(states))
    assert decode(encode(disc, "", {}), {}) == read
    assert r"\left(\phi - 6.0\right)^{2}" in nsmaps.export(whole, "latex")


def test_a_file_that_does_not_say_what_is_held_is_read_too(tmp_path):
    data = json.loads(nsmaps.export(CASES["second"][0], "json"))
    assert data.pop("about") == [
        "Order max_first: first the curve at the largest values of the others, then the one at the smallest.",
        "Curve 1, at phi_max = 0.7.",
        "Curve 2, at phi_min = 0.2.",
    ]
    assert data.pop("held") == [{"phi": 0.7}, {"phi": 0.2}]
    (tmp_path / "old.json").write_text(json.dumps(data))
    read = nsmaps.load_map(tmp_path / "old.json")
    assert read.held == ()
    assert same(read.alpha, CASES["second"][0].alpha)
    assert "Curve 1: fitted on" in nsmaps.export(read, "julia")
