"""The public face of exports: what is returned and written, what is refused, and the command."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import exported
import numpy as np
import pytest
import toys
from typer.testing import CliRunner

import nsmaps
from nsmaps.auxiliary.iterate import second_iterate
from nsmaps.cli import app
from nsmaps.errors import NsmapsError
from nsmaps.export.program import identifiers
from nsmaps.reduced.composite import CompositeMap
from nsmaps.reduced.polyfit import Full

STUDY = f"""\
system: {Path(toys.__file__)}:BouncingBall
parameters: {{a: 0.2, r: 0.5}}
grid:
  v: {{from: 0.05, to: 0.5, points: 21}}
  phi: {{from: 0.2, to: 1.2, points: 21}}
families: {{low: [BB]}}
composite:
  - {{name: all, box: {{v: [0, 1], phi: [0, 2*pi]}}, family: low, fit: {{full: {{v: 2, phi: 2}}}}}}
domains:
  - {{name: fitted, map: all, box: {{v: [0.1, 0.3], phi: [0.2, 1]}}, updates: 1}}
second_iterate: {{domain: fitted}}
"""


def test_one_file_is_its_text_and_several_are_texts_by_name(tmp_path):
    plane = exported.random_map([[0.5, 1.0], [0.1, 0.9]])
    text = nsmaps.export(plane, "julia", tmp_path / "new" / "folder")
    assert isinstance(text, str)
    assert (tmp_path / "new" / "folder" / "polynomial_map.jl").read_text() == text
    files = nsmaps.export(plane, "c")
    assert sorted(files) == ["polynomial_map.c", "polynomial_map.h"]
    assert list(tmp_path.iterdir()) == [tmp_path / "new"]


def test_errors_name_what_is_accepted():
    plane = exported.random_map([[0.5, 1.0], [0.1, 0.9]])
    with pytest.raises(
        NsmapsError, match=r"the format 'pyton', did you mean 'python'.; accepted: latex, python, c, julia, matlab"
    ):
        nsmaps.export(plane, "pyton")
    with pytest.raises(NsmapsError, match="a dict cannot be exported; accepted: PolyMap, CompositeMap"):
        nsmaps.export({}, "c")
    with pytest.raises(NsmapsError, match="an exact system as 'c': its map is implicit; accepted: 'latex'"):
        nsmaps.export(toys.BouncingBall(a=0.3), "c")
    with pytest.raises(NsmapsError, match=r"the coefficients have symbols: b_0, .*accepted: numbers, as by at"):
        nsmaps.export(second_iterate(Full(degrees={"v": 3, "phi": 2})), "c")
    with pytest.raises(NsmapsError, match="the map has no piece"):
        nsmaps.export(CompositeMap(exported.NAMES, ("B",), ()), "matlab")
    with pytest.raises(NsmapsError, match="the coefficients have symbols: b_0, b_1"):
        nsmaps.export(nsmaps.iterate(Full(degrees={"x": 1}), 2, coordinates=("x",)), "c")


def test_the_header_says_what_it_is():
    text = nsmaps.export(exported.composite(), "c")["composite_map.h"]
    for part in (
        "v (in the units of the system), phi (radians)",
        nsmaps.__version__,
        "R1 (BTB): fitted on v in [0.6, 0.9]",
        "-lm",
    ):
        assert part in text


def test_names_become_identifiers():
    names = ["v", "x", "x_", "end", "INT", "", "R 1", "R+1", "1st", "\N{GREEK SMALL LETTER PHI}"]
    assert identifiers(names) == ["v", "x_", "x__2", "end_", "INT_", "x__3", "R_1", "R_1_2", "x_1st", "x__4"]


@pytest.mark.parametrize("format", ["python", "c", "julia", "matlab", "latex", "json"])
def test_awkward_names_do_no_harm(format, tmp_path):
    nsmaps.export(exported.awkward(), format, tmp_path)
    if format == "python":
        namespace = {}
        exec(next(tmp_path.glob("*.py")).read_text(), namespace)
        states = np.random.default_rng(0).random((20, 2))
        images, pieces = namespace["composite_map"](states)
        np.testing.assert_array_equal(images, exported.awkward().first_return(states).image)
        assert set(pieces.tolist()) == {0, -1}
    if format == "c":
        subprocess.run(["gcc", "-Wall", "-Werror", "-std=c99", "-c", "composite_map.c"], cwd=tmp_path, check=True)


def test_a_result_is_all_its_maps_and_closed_envelopes():
    whole = exported.composite()
    envelope = SimpleNamespace(coordinate="v", kind="closed form", held=np.array([[np.nan] * 2, [0.5, -0.3]]))
    numeric = SimpleNamespace(coordinate="phi", kind="numeric", held=None)
    domain = SimpleNamespace(updates=[SimpleNamespace(envelopes=(envelope, numeric))])
    result = SimpleNamespace(
        study=SimpleNamespace(domains=[SimpleNamespace(name="first", map="R1"), SimpleNamespace(name="exact", map="exact")]),
        system=toys.BouncingBall(a=0.3),
        composite=whole,
        parametric=exported.parametric(),
        second_iterate=second_iterate(whole.piece("R1").map, -0.3, 0.5),
        domains={"first": domain, "exact": domain},
    )
    stems = ["composite_map", "first_v_lower", "first_v_upper", "parametric_map", "second_iterate"]
    assert sorted(nsmaps.export(result, "python")) == [f"{stem}.py" for stem in stems]
    assert sorted(nsmaps.export(result, "latex")) == sorted(f"{stem}.tex" for stem in [*stems, "bouncingball"])
    namespace = {}
    exec(nsmaps.export(result, "python")["first_v_upper.py"], namespace)
    expected = whole.piece("R1").map([[0.7, -0.3]])[0, 0]
    assert namespace["first_v_upper"]([[0.7]])[0, 0] == pytest.approx(expected, abs=1e-15)
    nothing = SimpleNamespace(**{**vars(result), "composite": None, "parametric": None, "second_iterate": None})
    nothing.study = SimpleNamespace(domains=[])
    with pytest.raises(NsmapsError, match="nothing that can be written as 'c'"):
        nsmaps.export(nothing, "c")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a run."""
    folder = tmp_path_factory.mktemp("export")
    (folder / "ball.yaml").write_text(STUDY)
    answer = CliRunner().invoke(app, ["run", str(folder / "ball.yaml"), "--out", str(folder / "run"), "--quiet"])
    assert answer.exit_code == 0, answer.output
    return folder / "run"


def test_the_command_writes_beside_the_run(run):
    answer = CliRunner().invoke(app, ["export", str(run), "--to", "json"])
    assert answer.exit_code == 0, answer.output
    written = [Path(line) for line in answer.stdout.splitlines()]
    assert {path.name for path in written} >= {"composite_map.json", "second_iterate.json"}
    assert all(path.parent == run / "export" for path in written)
    read = nsmaps.read_map(run / "export" / "composite_map.json")
    kept = nsmaps.read_result(run)
    states = np.random.default_rng(0).uniform([0, 0], [1, 6], (100, 2))
    assert read.first_return(states).image.tobytes() == kept.composite.first_return(states).image.tobytes()
    assert nsmaps.read_map(run / "export" / "second_iterate.json").alpha == kept.second_iterate.alpha


@pytest.mark.parametrize("format", ["latex", "python", "c", "julia", "matlab"])
def test_the_command_knows_every_format_and_a_folder(run, format, tmp_path):
    answer = CliRunner().invoke(app, ["export", str(run), "--to", format, "--out", str(tmp_path / "out")])
    assert answer.exit_code == 0, answer.output
    assert sorted(answer.stdout.split()) == sorted(map(str, (tmp_path / "out").iterdir()))


def test_bad_commands_end_with_two(run, tmp_path):
    answer = CliRunner().invoke(app, ["export", str(run), "--to", "fortran"])
    assert answer.exit_code == 2
    assert "the format 'fortran'; accepted: latex, python, c, julia, matlab, json" in answer.output
    answer = CliRunner().invoke(app, ["export", str(tmp_path), "--to", "c"])
    assert answer.exit_code == 2
    assert "holds no result.json" in answer.output
    assert CliRunner().invoke(app, ["export", str(run)]).exit_code == 2


@pytest.mark.parametrize("first", ["import nsmaps.export.write", "import nsmaps.export", "nsmaps.read_map", "nsmaps.export"])
def test_the_name_is_a_function_however_it_came_in(first):
    """`nsmaps.export` is a room and a function, whatever was imported before."""
    program = f"import nsmaps; {first}; print(nsmaps.export(nsmaps.PolyMap.reset(('x',), {{}}), 'json')[:1])"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout == "{\n"
