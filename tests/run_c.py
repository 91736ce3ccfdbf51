"""Programs of exact first returns in C, compiled by gcc and called."""

import ctypes
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
