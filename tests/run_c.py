"""Programs of exact first returns in C, compiled by gcc and called, and in JavaScript, run by node."""

import ctypes
import json
import subprocess

import numpy as np

import nsmaps

STRICT = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-march=native", "-fno-tree-slp-vectorize"]


def pointer(array):
    """An array as an argument."""
    return ctypes.c_void_p(array.ctypes.data)


class Program:
    """The program of a system as a library."""

    def __init__(self, system, folder, name="exact", level="-O3"):
        nsmaps.export(system, "c", folder, name=name)
        command = ["gcc", *STRICT, level, "-shared", "-fPIC", f"{name}.c", "-o", f"{name}.so", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        self.library, self.name, self.n = ctypes.CDLL(str(folder / f"{name}.so")), name, len(system.coordinates)
        getattr(self.library, f"{name}_outcome").restype = ctypes.c_char_p
        fields = [("outcome", ctypes.c_int), ("image", ctypes.c_double * self.n), ("turns", ctypes.c_int64)]
        fields += [("time", ctypes.c_double), ("code", ctypes.c_int64), ("derivative", ctypes.c_double * self.n**2)]
        self.function = getattr(self.library, f"{name}_of")
        self.function.restype = type("Return", (ctypes.Structure,), {"_fields_": fields})

    def of(self, state, chatter=1e-12, derivative=True):
        """The return of one state."""
        return self.function(pointer(state.copy()), ctypes.c_double(chatter), ctypes.c_bool(derivative))

    def batch(self, states):
        """Images, outcomes and codes of states."""
        rows, n = np.ascontiguousarray(states), len(states)
        images, outcomes, codes = np.empty((n, self.n)), np.empty(n, np.intc), np.empty(n, np.int64)
        self.library[f"{self.name}_batch"](ctypes.c_size_t(n), *map(pointer, (rows, images, outcomes, codes)))
        return images, outcomes, codes

    def word(self, code):
        """The word of a code."""
        text = ctypes.create_string_buffer(60)
        length = self.library[f"{self.name}_word"](ctypes.c_int64(code), text, ctypes.c_size_t(60))
        assert length == len(text.value)
        return text.value.decode()

    def outcome(self, number):
        """The name of an outcome."""
        return getattr(self.library, f"{self.name}_outcome")(int(number)).decode()


RUN = """const map = require("./exact.js"), fs = require("fs"), n = Number(process.argv[1])
const numbers = new Float64Array(fs.readFileSync("states.bin").buffer.slice(0))
const found = Array.from({length: numbers.length / n}, (_, k) => map.of(numbers.slice(k * n, (k + 1) * n), true))
const rows = found.flatMap(each => [...each.image, ...each.derivative.flat(), each.time, each.turns])
fs.writeFileSync("found.bin", Float64Array.from(rows))
console.log(JSON.stringify(found.map(each => [each.outcome, map.word(each.code)])))"""


def run_node(system, states, folder):
    """Outcomes and words of states by the program in JavaScript, and its numbers row by row: image, derivative, time, turns."""
    nsmaps.export(system, "javascript", folder, name="exact")
    np.ascontiguousarray(states).tofile(folder / "states.bin")
    command = ["node", "-e", RUN, str(states.shape[1])]
    found = json.loads(subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout)
    outcomes, words = zip(*found, strict=True)
    return outcomes, words, np.fromfile(folder / "found.bin").reshape(len(states), -1)


def compare_node(system, states, folder):
    """The program in JavaScript against first returns: the same outcomes and words, and numbers to the last bits."""
    outcomes, words, numbers = run_node(system, states, folder)
    own, n = system.first_return(states, derivative=True), states.shape[1]
    assert list(outcomes) == [nsmaps.Outcome(int(each)).name for each in own.outcome]
    assert list(words) == own.words.tolist()
    known = own.outcome == nsmaps.Outcome.returned
    expected = np.column_stack([own.image, own.derivative.reshape(-1, n * n), own.time, own.turns.sum(axis=1)])[known]
    assert len(expected) > len(states) / 4
    return numbers[known], expected
