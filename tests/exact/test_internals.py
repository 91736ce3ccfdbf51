"""A numba without any of the names that are used beside its public ones compiles all the same."""

import os
import subprocess
import sys

import numpy as np
import pytest

import nsmaps
from nsmaps.exact.compiling import internals

MODULES = (
    *("caching", "codegen", "compiler", "dispatcher", "environment", "registry", "runtime", "serialize"),
    *("typed_passes", "untyped_passes"),
)
WITHOUT = """
import importlib, sys
import numba
found = importlib.import_module

def without(name, package=None):
    if name == "numba.core." + module:
        raise ImportError(name)
    return found(name, package)

importlib.import_module = without
"""
FUNCTIONS = """
for module in sys.argv[1:]:
    for name in [name for name in sys.modules if name.startswith("nsmaps")]:
        del sys.modules[name]
    from nsmaps.exact.compiling import internals
    from nsmaps.exact.compiling.compiled import njit
    from nsmaps.exact.compiling.digest import code_of
    assert internals.absent and all(name.startswith("numba.core." + module) for name in internals.absent)
    half = njit(part=True, nogil=True, no_cpython_wrapper=True, _nrt=False)(lambda x: x / 2)
    whole = njit(part=False, cache=True, long=True)(lambda x: half(x) + half(3 * x))
    print(module, whole(5.0), len(code_of(whole)))
"""
ORBITS = """
module = sys.argv[1]
import nsmaps
from nsmaps.exact.compiling import internals
assert internals.absent
print(nsmaps.load_system("lozi").orbits([[0.1, 0.2], [0.3, -0.4]], 30, derivative=True).derivative.tobytes().hex())
"""


def printed(program: str, *arguments: str, folder: os.PathLike[str]) -> str:
    """What a program prints, with kernels of its own."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", WITHOUT + program, *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


@pytest.mark.thorough
def test_functions_are_compiled_without_any_of_the_modules(tmp_path):
    assert not internals.absent
    assert printed(FUNCTIONS, *MODULES, folder=tmp_path).splitlines() == [f"{module} 10.0 64" for module in MODULES]


def test_orbits_are_the_same_without(tmp_path):
    orbits = nsmaps.load_system("lozi").orbits([[0.1, 0.2], [0.3, -0.4]], 30, derivative=True)
    assert np.isfinite(orbits.derivative).all()
    assert printed(ORBITS, "codegen", folder=tmp_path).strip() == orbits.derivative.tobytes().hex()
