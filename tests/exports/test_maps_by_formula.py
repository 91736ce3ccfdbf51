"""Maps given by formulas in every language: run on ten thousand states, the images are those of the compiled map."""

import ctypes
import shutil
import subprocess

import given
import numpy as np
import pytest

import nsmaps
from nsmaps.exports.programs.moving import moving_script

gcc = pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not here, so the C was not run")
node = pytest.mark.skipif(not shutil.which("node"), reason="node is not here, so the JavaScript was not run")
of_each = pytest.mark.parametrize("return_map", given.MAPS, ids=lambda return_map: type(return_map).__name__.lower())


def compare(return_map, answer):
    """The images and pieces of an answer of (states) against those of the compiled map, to the last bits."""
    box = np.array(given.MAPS[return_map], float)
    states = np.random.default_rng(8).uniform(*box.T, (10_000, len(box)))
    states[:4, 0] = [0.0, 2 * np.pi, np.nextafter(0, -1), np.nan]
    images, pieces = answer(states)
    expected = return_map.first_return(states)
    letters = np.array([*return_map.letters, ""])[pieces]
    assert letters.tolist() == expected.words.tolist()
    assert set(letters) >= set(return_map.letters)
    assert (np.isnan(images) == np.isnan(expected.image)).all()
    away = np.abs(return_map.coordinates.difference(images, expected.image)) / (1 + np.abs(expected.image))
    assert np.nanmax(away) <= 4e-15


@of_each
def test_python(return_map):
    namespace = {}
    exec(nsmaps.export(return_map, "python"), namespace)
    compare(return_map, namespace[type(return_map).__name__.lower()])


@gcc
@of_each
def test_c(return_map, tmp_path):
    nsmaps.export(return_map, "c", tmp_path, name="it")
    strict = ["-O2", "-Wall", "-Wextra", "-Werror", "-pedantic", "-std=c99"]
    subprocess.run(["gcc", *strict, "-shared", "-fPIC", "it.c", "-o", "it.so", "-lm"], cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "it.so"))

    def answer(states):
        images, pieces = np.empty_like(states), np.empty(len(states), np.intc)
        pointers = (ctypes.c_void_p(each.ctypes.data) for each in (states, images, pieces))
        library.it_batch(ctypes.c_size_t(len(states)), *pointers)
        return images, pieces

    compare(return_map, answer)


@node
@of_each
def test_javascript(return_map, tmp_path):
    nsmaps.export(return_map, "javascript", tmp_path, name="it")
    script = """
        const fs = require("fs"), map = require("./it.js"), n = Number(process.argv[1])
        const numbers = new Float64Array(new Uint8Array(fs.readFileSync("states.bin")).buffer), rows = []
        for (let k = 0; k < numbers.length / n; ++k) {
            const [image, piece] = map.image_of([...numbers.subarray(k * n, k * n + n)])
            rows.push(...image, piece)
        }
        fs.writeFileSync("images.bin", new Uint8Array(Float64Array.from(rows).buffer))
    """

    def answer(states):
        states.astype("<f8").tofile(tmp_path / "states.bin")
        subprocess.run(["node", "-e", script, str(states.shape[1])], cwd=tmp_path, check=True)
        rows = np.fromfile(tmp_path / "images.bin").reshape(len(states), -1)
        return rows[:, :-1], rows[:, -1].astype(int)

    compare(return_map, answer)


class Tent(nsmaps.PiecewiseMap):
    """Slopes a/4 and -a, or a squared and -a."""

    a: float
    squared: bool = False
    coordinates = ("x",)

    def pieces(self, x):
        rise = self.a**2 if self.squared else self.a / 4
        return {"L": (x.x <= 0, {"x": rise * x.x + 1}), "R": (True, {"x": 1 - self.a * x.x})}


@node
def test_a_script_follows_a_parameter_in_which_its_numbers_are_affine(tmp_path):
    def write(system):
        return nsmaps.export(system, "javascript", name="tent")

    script = moving_script(Tent(a=1.5), "a", 1.1, 1.9, "tent", write)
    (tmp_path / "tent.js").write_text(f"{script}\nconsole.log([-1, 0.5].map(x => tent.at(1.7).image_of([x])[0][0]).join())")
    found = subprocess.run(["node", "tent.js"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert [float(each) for each in found.split(",")] == pytest.approx([1 - 1.7 / 4, 1 - 1.7 / 2], rel=1e-15)
    assert moving_script(Tent(a=1.5, squared=True), "a", 1.1, 1.9, "tent", write) is None


@of_each
def test_other_languages_and_data(return_map, tmp_path):
    """MATLAB and Julia are written, and JSON is read back as the composite map of the formulas."""
    assert "function" in nsmaps.export(return_map, "matlab")
    assert "module " in nsmaps.export(return_map, "julia")
    nsmaps.export(return_map, "json", tmp_path, name="it")
    read = nsmaps.load_map(tmp_path / "it.json")
    compare(return_map, lambda states: (read.first_return(states).image, read.piece_of(states)))


def test_latex_has_the_cases_with_symbols_of_parameters():
    text = nsmaps.export(given.Circle(), "latex")
    assert r"\section*{The map Circle}" in text
    assert r"Parameters: $\omega = 0.7$, $k = 1.6$." in text
    cases = r"k \sin^{3}{\left(\phi \right)} + \omega + \phi & \text{otherwise} \\"
    assert r"\[ \phi_{k+1} = \begin{cases}" in text
    assert cases in text
