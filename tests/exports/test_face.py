"""The public face of exports: what is returned and written, what is refused, and the command."""

import doctest
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import exported
import numpy as np
import pytest
import systems
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError
from nsmaps.exports.exportables import held_by
from nsmaps.exports.program import identifiers
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.symbolic.curve_iterates import second_iterate

STUDY = f"""\
system: {Path(systems.__file__)}:BouncingBall
parameters: {{a: 0.2, r: 0.5}}
grid:
  v: {{from: 0.05, to: 0.5, points: 21}}
  phi: {{from: 0.2, to: 1.2, points: 21}}
families: {{low: [BB]}}
composite:
  - {{name: all, box: {{v: [0, 1], phi: [0, 2*pi]}}, family: low, fit: {{full: {{v: 2, phi: 2}}}}}}
domains:
  - {{name: fitted, map: all, box: {{v: [0.1, 0.3], phi: [0.2, 1]}}, max_updates: 1}}
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
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="language", name="pyton", near="python")):
        nsmaps.export(plane, "pyton")
    with pytest.raises(NsmapsError, match=message("exports.class", result="dict")):
        nsmaps.export({}, "c")
    with pytest.raises(NsmapsError, match=message("exports.implicit", system="BouncingBall", language="matlab")):
        nsmaps.export(systems.BouncingBall(a=0.3), "matlab")
    with pytest.raises(NsmapsError, match=message("exports.symbols", symbols=re.compile("b_0, .*"))):
        nsmaps.export(second_iterate(PolynomialFit(degrees={"v": 3, "phi": 2})), "c")
    with pytest.raises(NsmapsError, match=message("exports.no-piece")):
        nsmaps.export(CompositeMap(exported.NAMES, ("B",), ()), "matlab")
    with pytest.raises(NsmapsError, match=message("exports.symbols", symbols="b_0, b_1")):
        nsmaps.export(nsmaps.symbolic.symbolic_iterate(PolynomialFit(degrees={"x": 1}), 2, coordinates=("x",)), "c")


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
    names = ["v", "x", "x_", "end", "INT", "", "R 1", "R/1", "1st", "\N{GREEK SMALL LETTER PHI}"]
    assert identifiers(names) == ["v", "x_", "x__2", "end_", "INT_", "x__3", "R_1", "R_1_2", "x_1st", "x__4"]
    assert identifiers(["R1", "R1+", "R1'", "R1*", "R+1"]) == ["R1", "R1_plus", "R1_prime", "R1_star", "R_plus_1"]


@pytest.mark.parametrize("language", ["python", "c", "julia", "matlab", "javascript", "latex", "json"])
def test_awkward_names_do_no_harm(language, tmp_path):
    nsmaps.export(exported.awkward(), language, tmp_path)
    if language == "python":
        namespace = {}
        exec(next(tmp_path.glob("*.py")).read_text(), namespace)
        states = np.random.default_rng(0).random((20, 2))
        images, pieces = namespace["composite_map"](states)
        np.testing.assert_allclose(images, exported.awkward().first_return(states).image, rtol=1e-14, atol=1e-15)
        assert set(pieces.tolist()) == {0, -1}
    if language == "c":
        subprocess.run(["gcc", "-Wall", "-Werror", "-std=c99", "-c", "composite_map.c"], cwd=tmp_path, check=True)


def a_result():
    """What a run holds, with a domain that is not forward invariant."""
    whole = exported.composite()
    envelope = SimpleNamespace(coordinate="v", kind="closed form", held=np.array([[np.nan] * 2, [0.5, -0.3]]))
    numeric = SimpleNamespace(coordinate="phi", kind="numeric", held=None)
    update = SimpleNamespace(number=3, envelopes=(envelope, numeric))
    about = {
        "of": "fitted map R1",
        "forward_invariant": False,
        "converged": False,
        "reason": "one worst-case step leaves the box",
    }
    domain = SimpleNamespace(coordinates=exported.NAMES, updates=[update], **about)
    sections = [SimpleNamespace(name="first", map="R1"), SimpleNamespace(name="exact", map="exact")]
    chosen = SimpleNamespace(domain="first")
    return SimpleNamespace(
        study=SimpleNamespace(name="mine", title="A title", domains=sections, second_iterate=chosen),
        system=systems.BouncingBall(a=0.3),
        composite=whole,
        parametric_map=exported.parametric(),
        second_iterate=second_iterate(whole.piece("R1").map, -0.3, 0.5),
        domains={"first": domain, "exact": domain},
    )


def test_a_result_is_all_its_maps_and_closed_envelopes():
    result = a_result()
    whole = result.composite
    stems = ["composite_map", "first_v_lower", "first_v_upper", "parametric_map", "second_iterate"]
    assert sorted(nsmaps.export(result, "python")) == [f"{stem}.py" for stem in stems]
    assert sorted(nsmaps.export(result, "latex")) == sorted(f"{stem}.tex" for stem in [*stems, "bouncingball"])
    namespace = {}
    exec(nsmaps.export(result, "python")["first_v_upper.py"], namespace)
    expected = whole.piece("R1").map([[0.7, -0.3]])[0, 0]
    assert namespace["first_v_upper"]([[0.7]])[0, 0] == pytest.approx(expected, abs=1e-15)
    nothing = SimpleNamespace(**{**vars(result), "composite": None, "parametric_map": None, "second_iterate": None})
    nothing.study = SimpleNamespace(name="nothing", title="", domains=[])
    with pytest.raises(NsmapsError, match=message("exports.nothing", language="matlab")):
        nsmaps.export(nothing, "matlab")
    assert sorted(nsmaps.export(nothing, "c")) == ["bouncingball.c", "bouncingball.h"]


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
    read = nsmaps.load_map(run / "export" / "composite_map.json")
    kept = nsmaps.read_result(run)
    states = np.random.default_rng(0).uniform([0, 0], [1, 6], (100, 2))
    assert read.first_return(states).image.tobytes() == kept.composite.first_return(states).image.tobytes()
    assert nsmaps.load_map(run / "export" / "second_iterate.json").alpha == kept.second_iterate.alpha


@pytest.mark.parametrize("language", ["latex", "python", "c", "julia", "matlab", "javascript"])
def test_the_command_knows_every_format_and_a_folder(run, language, tmp_path):
    answer = CliRunner().invoke(app, ["export", str(run), "--to", language, "--out", str(tmp_path / "out")])
    assert answer.exit_code == 0, answer.output
    assert sorted(answer.stdout.split()) == sorted(map(str, (tmp_path / "out").iterdir()))
    *_, domain = nsmaps.read_result(run).domains.values()
    numeric = [each.coordinate for each in domain.updates[-1].envelopes if each.kind == "numeric"]
    assert numeric, "the study has an envelope without a closed form, or this tests nothing"
    for name in numeric:
        line = f"not written: fitted_{name}_lower and fitted_{name}_upper: the envelope of {name} has no closed form"
        assert line in answer.stderr


def test_the_command_writes_the_iterate_of_a_piece(run, tmp_path):
    """The iterate of the command, run, is the piece applied twice, under a name of its own."""
    answer = CliRunner().invoke(app, ["export", str(run), "--to", "python", "--iterate", "2", "--out", str(tmp_path)])
    assert answer.exit_code == 0, answer.output
    assert answer.stdout.strip() == str(tmp_path / "all_iterate_2.py")
    text = (tmp_path / "all_iterate_2.py").read_text()
    assert "The iterate 2 of the piece all, all coordinates." in text
    assert "System: BouncingBall, a = 0.2, r = 0.5" in text
    namespace = {}
    exec(text, namespace)
    piece, states = nsmaps.read_result(run).composite.piece("all").map, np.array([[0.2, 0.6], [0.3, 0.9]])
    np.testing.assert_allclose(namespace["all_iterate_2"](states), piece(piece(states)), rtol=0, atol=1e-12)
    for more, why in (
        (["--to", "c", "--iterate", "2", "--piece", "al"], "al"),
        (["--to", "c", "--piece", "all"], "expected: --iterate N --piece all"),
        (["--to", "d", "--iterate", "2"], "no language 'd'"),
    ):
        answer = CliRunner().invoke(app, ["export", str(run), *more])
        assert answer.exit_code == 2
        assert why in answer.stderr


FORMATS = ["latex", "python", "c", "julia", "matlab", "javascript", "json"]


@pytest.mark.parametrize("language", FORMATS)
def test_every_format_says_what_a_second_iterate_is_of(run, language, tmp_path):
    """The study, the parameters, the piece, the domain with its verdict, the order, and the values held."""
    nsmaps.export(nsmaps.read_result(run), language, tmp_path)
    text = "\n".join(path.read_text() for path in sorted(tmp_path.glob("second_iterate.*")))
    domain = nsmaps.read_result(run).domains["fitted"]
    low, high = domain.updates[-1].box[1].tolist()
    verdict = "forward invariant and" if domain.forward_invariant else "NOT forward invariant and"
    told = [
        "piece all",
        "a = 0.2, r = 0.5",
        f"Domain fitted, of the fitted map all: {verdict}",
        domain.reason,
        "first the curve at the largest",
    ]
    for part in [*told, f"phi_min = {low}", f"phi_max = {high}", "updates[-1].box"]:
        assert (part.replace("_", "\\_") if language == "latex" else part) in text
    assert ("CAUTION: " in text) is not (domain.forward_invariant and domain.converged)


@pytest.mark.parametrize("language", FORMATS)
def test_a_domain_that_is_not_trapped_is_exported_with_a_caution(language):
    texts = nsmaps.export(a_result(), language)
    for name, text in texts.items():
        if name.partition(".")[0] in ("first_v_lower", "second_iterate") and not name.endswith(".c"):
            assert "CAUTION: as the domain is not forward invariant" in text
            assert "NOT forward invariant and NOT converged; one worst-case step leaves the box." in text
    assert sum("CAUTION" in text for text in texts.values()) == 3


@pytest.mark.parametrize("language", FORMATS)
def test_a_name_is_that_of_file_and_function(language, tmp_path):
    twice, thrice = (nsmaps.symbolic.symbolic_iterate(exported.line(), n) for n in (2, 3))
    nsmaps.export(twice, language, tmp_path, name="line_twice")
    nsmaps.export(thrice, language, tmp_path, name="line_thrice")
    assert {path.stem for path in tmp_path.iterdir()} == {"line_twice", "line_thrice"}
    if language == "python":
        namespace = {}
        exec((tmp_path / "line_twice.py").read_text(), namespace)
        states = np.array([[0.1], [0.7]])
        np.testing.assert_allclose(namespace["line_twice"](states), exported.line()(exported.line()(states)), atol=1e-14)
    if language == "c":  # both in one program
        (tmp_path / "main.c").write_text(
            '#include "line_twice.h"\n#include "line_thrice.h"\n#include <stdio.h>\n'
            "int main(void) { double x[1] = {0.1}, a[1], b[1]; line_twice(x, a); line_thrice(x, b); "
            'printf("%.17g %.17g", a[0], b[0]); return 0; }\n'
        )
        build = ["gcc", "-Wall", "-Werror", "-std=c99", "main.c", "line_twice.c", "line_thrice.c", "-lm", "-o", "main"]
        subprocess.run(build, cwd=tmp_path, check=True)
        seen = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.split()
        f = lambda x: 3.2 * x * (1 - x)  # noqa: E731
        assert [float(x) for x in seen] == pytest.approx([f(f(0.1)), f(f(f(0.1)))], abs=1e-14)


def test_a_name_that_is_none_is_refused():
    for name in ("two words", "2nd", "while", "require", ""):
        with pytest.raises(NsmapsError, match=message("exports.name")):
            nsmaps.export(exported.line(), "c", name=name)
    with pytest.raises(NsmapsError, match=message("exports.name-of-all")):
        nsmaps.export(a_result(), "c", name="mine")


def test_why_something_is_not_written_is_said():
    first, exact = held_by(a_result()).skipped
    assert first.startswith("first_phi_lower and first_phi_upper: the envelope of phi has no closed form; its curves cross")
    assert exact == "the envelopes of domain exact: they are of the map 'exact'; expected: of one piece"


def test_the_call_explains_itself():
    """help(nsmaps.export) shows the call, and its examples are true."""
    assert list(inspect.signature(nsmaps.export).parameters) == ["result", "language", "path", "name"]
    assert "Args:" in inspect.getdoc(nsmaps.export)
    (test,) = (each for each in doctest.DocTestFinder().find(nsmaps.export, "export", globs={}) if each.examples)
    assert doctest.DocTestRunner().run(test) == (0, 5)  # the last two, of a run that is not there, are skipped


def test_bad_commands_end_with_two(run, tmp_path):
    answer = CliRunner().invoke(app, ["export", str(run), "--to", "fortran"])
    assert answer.exit_code == 2
    assert "no language 'fortran'; expected: latex, python, c, julia, matlab, javascript, json" in answer.output
    answer = CliRunner().invoke(app, ["export", str(tmp_path), "--to", "c"])
    assert answer.exit_code == 2
    assert "contains no result.json" in answer.output
    assert CliRunner().invoke(app, ["export", str(run)]).exit_code == 2


def test_the_name_is_a_function_however_it_came_in():
    """`nsmaps.export` is the function, whatever was imported before, each time of the package anew."""
    program = (
        "import sys\nfor first in sys.argv[1:]:\n for name in [each for each in sys.modules if each.split('.')[0] == 'nsmaps']:\n"
        "  del sys.modules[name]\n import nsmaps\n exec(first)\n"
        " print(nsmaps.export(nsmaps.reduced.PolyMap.reset(('x',), {}), 'json')[:1])"
    )
    firsts = ["import nsmaps.exports.write", "nsmaps.export"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", program, *firsts], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout == "{\n" * 2
