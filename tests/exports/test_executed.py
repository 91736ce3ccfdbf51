"""Every executable export is run, and compared with the map on ten thousand points, edges among them."""

import ctypes
import json
import re
import shutil
import subprocess
from pathlib import Path

import exported
import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.coordinates import Angle
from nsmaps.exports.program import program_of
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box
from nsmaps.reduced.fit.polymap import design

CASES = exported.cases()
LARGEST = 1e-12  #: difference, relative to the largest term of a polynomial there

gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not here, so the C was not run")
node = pytest.mark.skipif(not shutil.which("node"), reason="node is not here, so the JavaScript was not run")
octave = pytest.mark.skipif(not shutil.which("octave-cli"), reason="GNU Octave is not here, so the MATLAB was not run")
every_case = pytest.mark.parametrize("name", CASES)


def largest_terms(program, states, pieces):
    """The largest term of any polynomial that a state is put into, at least 1; shape (N,)."""
    largest = np.ones(len(states))
    for k, part in enumerate(program.parts):
        rows = pieces == k if program.kind == "pieces" else np.ones(len(states), bool)
        polymap, x = part.polymap, states[rows].copy()
        for j, middle in enumerate(part.middles):
            if middle is not None and program.kind == "pieces":
                x[:, j] -= 2 * np.pi * np.round((x[:, j] - middle) / (2 * np.pi))
        for exponents, c in zip(polymap.exponents, polymap.coefficients, strict=True):
            terms = np.abs(design(exponents, polymap._scaled(x)) * c)
            largest[rows] = np.maximum(largest[rows], terms.max(axis=1))
    return largest


def compare(name, answer):
    """The largest difference of an answer of (states) -> images, pieces or None from nsmaps itself, relative to the terms."""
    result, box, own = CASES[name]
    states, program = exported.states_of(box), program_of(result, "it")
    expected, pieces = own(states) if program.kind == "pieces" else (own(states), np.zeros(len(states), int))
    images, given = answer(states)
    assert images.shape == expected.shape
    if program.kind == "pieces":
        assert given.tolist() == pieces.tolist()
        assert set(pieces.tolist()) == {-1, *range(len(program.parts))}
    assert (np.isnan(images) == np.isnan(expected)).all()
    gap = np.abs(images - expected)
    for i, output in enumerate(program.outputs):
        if isinstance(output, Angle) and program.kind == "pieces":
            gap[:, i] = np.minimum(gap[:, i], 2 * np.pi - gap[:, i])
    return float(np.nanmax(gap / largest_terms(program, states, pieces)[:, None]))


@every_case
def test_python(name, tmp_path):
    result, box, own = CASES[name]
    text = nsmaps.export(result, "python", tmp_path)
    (file,) = tmp_path.glob("*.py")
    assert file.read_text() == text
    namespace = {}
    exec(compile(text, str(file), "exec"), namespace)

    def answer(states):
        got = namespace[file.stem](states)
        return got if isinstance(got, tuple) else (got, None)

    assert compare(name, answer) < LARGEST
    if name in ("map", "line", "space", "one of a series"):  # which need no change of their coefficients
        states = exported.states_of(box)
        assert answer(states)[0].tobytes() == own(states).tobytes()


@gcc
@every_case
def test_c(name, tmp_path):
    result, _, _ = CASES[name]
    files = nsmaps.export(result, "c", tmp_path)
    program, (stem,) = program_of(result, "it"), {Path(file).stem for file in files}
    strict = ["-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-std=c99"]
    command = ["gcc", *strict, "-shared", "-fPIC", f"{stem}.c", "-o", "it.so", "-lm"]
    subprocess.run(command, cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "it.so"))

    def pointer(array):
        return ctypes.c_void_p(array.ctypes.data)

    def answer(states):
        images, pieces = np.empty((len(states), len(program.outputs))), np.full(len(states), -7, np.intc)
        more = [pointer(pieces)] if program.kind == "pieces" else []
        library[f"{stem}_batch"](ctypes.c_size_t(len(states)), pointer(states), pointer(images), *more)
        one = np.empty(len(program.outputs))
        for k in (0, 1, 200, 5000):
            library[stem](pointer(states[k].copy()), pointer(one))
            assert one.tobytes() == images[k].tobytes()
        return images, pieces

    assert compare(name, answer) < LARGEST


@gcc
def test_the_header_serves_cpp(tmp_path):
    if not shutil.which("g++"):
        pytest.skip("g++ is not here, so the header was not read as C++")
    nsmaps.export(CASES["composite"][0], "c", tmp_path)
    (tmp_path / "use.cpp").write_text(
        '#include "composite_map.h"\n#include "composite_map.h"\n'
        "int main() { double x[2] = {0.7, 0.2}; return composite_map(x, x); }\n"
    )
    subprocess.run(["gcc", "-std=c99", "-c", "composite_map.c"], cwd=tmp_path, check=True)
    subprocess.run(["g++", "-Wall", "-Werror", "use.cpp", "composite_map.o", "-lm", "-o", "use"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "use"], check=False).returncode == 0


@node
@every_case
def test_javascript(name, tmp_path):
    nsmaps.export(CASES[name][0], "javascript", tmp_path)
    (file,) = tmp_path.glob("*.js")
    script = """
        const fs = require("fs"), map = require(process.argv[1]), n = Number(process.argv[2])
        const numbers = new Float64Array(new Uint8Array(fs.readFileSync("states.bin")).buffer), rows = []
        for (let k = 0; k < numbers.length / n; ++k) {
            const answer = map.image_of([...numbers.subarray(k * n, k * n + n)])
            rows.push(...(map.piece_of ? [...answer[0], answer[1]] : answer))
        }
        fs.writeFileSync("images.bin", new Uint8Array(Float64Array.from(rows).buffer))
    """
    program = program_of(CASES[name][0], "it")

    def answer(states):
        states.astype("<f8").tofile(tmp_path / "states.bin")
        subprocess.run(["node", "-e", script, str(file), str(states.shape[1])], cwd=tmp_path, check=True)
        rows = np.fromfile(tmp_path / "images.bin").reshape(len(states), -1)
        m = len(program.outputs)
        return rows[:, :m], rows[:, m].astype(int) if program.kind == "pieces" else None

    assert compare(name, answer) < LARGEST


@octave
@every_case
def test_matlab(name, tmp_path):
    result, _, _ = CASES[name]
    nsmaps.export(result, "matlab", tmp_path)
    (file,) = tmp_path.glob("*.m")
    kind = program_of(result, "it").kind

    def answer(states):
        states.astype("<f8").tofile(tmp_path / "states.bin")
        outputs = "[images, pieces]" if kind == "pieces" else "images"
        write = "fwrite(f, pieces, 'double');" if kind == "pieces" else ""
        script = (
            f"f = fopen('states.bin'); s = fread(f, [{states.shape[1]}, Inf], 'double')'; fclose(f);"
            f"{outputs} = {file.stem}(s); f = fopen('images.bin', 'w'); fwrite(f, images, 'double'); {write} fclose(f);"
        )
        told = subprocess.run(
            ["octave-cli", "--quiet", "--no-init-file", "--eval", script],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        errors = [
            line for line in told.stderr.splitlines() if "while preparing to exit" not in line
        ]  # Octave's own, when it ends
        assert (told.returncode, errors) == (0, [])
        columns = np.fromfile(tmp_path / "images.bin").reshape(-1, len(states))
        images = columns[:-1].T if kind == "pieces" else columns.T
        return images, columns[-1].astype(int) - 1

    assert compare(name, answer) < LARGEST


@every_case
def test_julia_is_parsed_not_run(name):
    """No Julia is at hand: a grammar of it reads the module without an error, and its numbers are those of the map."""
    text = nsmaps.export(CASES[name][0], "julia")
    program = program_of(CASES[name][0], "it")
    for part in (part for part in program.parts if part.polymap.variables is None):
        block = text.split(f"const {part.name.upper()}_COEFFICIENTS = [\n")[1].split("\n]\n")[0]
        rows = [[float(c) for c in row.split(",")] for row in re.findall(r"\[(.*)\]", block)]
        np.testing.assert_array_equal(rows, part.tensor.reshape(len(part.tensor), -1))
    grammar = pytest.importorskip("tree_sitter_julia", reason="tree-sitter-julia is not here, so the Julia was not parsed")
    from tree_sitter import Language, Parser

    tree = Parser(Language(grammar.language())).parse(text.encode())
    assert not tree.root_node.has_error
    broken = Parser(Language(grammar.language())).parse(text.replace("\nend\n", "\n", 1).encode())
    assert broken.root_node.has_error


WORDS = ("TWO_PI", "linux", "M_PI", "lambda", "end", "e", "x", "I", "function", "size", "gamma", "real_sqrt")


@pytest.mark.parametrize("words", [WORDS[:4], WORDS[4:8], WORDS[8:]], ids=" ".join)
def test_coordinates_and_maps_with_words_of_languages(tmp_path, words):
    """A map that halves coordinates of these names: in C as gcc compiles it unless asked otherwise, JavaScript and Python."""
    names = (*words, Angle("pi"))
    n = len(names)
    states = np.random.default_rng(1).uniform(0.1, 0.9, (20, n))
    halves = {name: {tuple(np.eye(n, dtype=int)[k]): 0.5} for k, name in enumerate(names)}
    polymap = nsmaps.reduced.PolyMap.of_monomials(names, halves, [[0, 1]] * n)
    region = Box(coordinates=names, bounds=dict.fromkeys(names, (0.0, 1.0)))
    result = CompositeMap(names, ("B",), (Piece("wrap", region, polymap, "BB"),))
    for language in ("matlab", "julia", "latex", "python", "javascript", "c"):
        nsmaps.export(result, language, tmp_path)
    namespace = {}
    exec((tmp_path / "composite_map.py").read_text(), namespace)
    assert namespace["composite_map"](states)[0] == pytest.approx(states / 2, rel=1e-14)
    if shutil.which("gcc"):
        subprocess.run(["gcc", "-shared", "-fPIC", "composite_map.c", "-o", "it.so", "-lm"], cwd=tmp_path, check=True)
        images = np.empty_like(states)
        places = (ctypes.c_void_p(array.ctypes.data) for array in (states, images))
        ctypes.CDLL(str(tmp_path / "it.so")).composite_map_batch(ctypes.c_size_t(len(states)), *places, None)
        assert images == pytest.approx(states / 2, rel=1e-14)
    if shutil.which("node"):
        script = f"console.log(JSON.stringify(require('./composite_map.js').images({states.tolist()}).map(each => each[0])))"
        found = subprocess.run(["node", "-e", script], cwd=tmp_path, check=True, capture_output=True, text=True)
        assert np.array(json.loads(found.stdout)) == pytest.approx(states / 2, rel=1e-14)
    for name in ("TWO_PI", "polynomials", "regions", "lambda"):
        with pytest.raises(nsmaps.NsmapsError, match=message("exports.name", name=name, near=f"{name}_")):
            nsmaps.export(result, "python", name=name)
    with pytest.raises(nsmaps.NsmapsError, match=message("exports.name", near="gamma_")):
        nsmaps.export(result, "c", name="gamma")
