"""The linked forms of entries that wheels contain: named by their code, complete, and with the same results as without them."""

import lzma
import os
import pickle
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import exported
import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from numba.core.registry import CPUDispatcher, cpu_target

import nsmaps
from nsmaps.enclosures.ranges_kernel import Pieces, conclude
from nsmaps.exact.compiling import compiled, kept, linked
from nsmaps.exact.compiling.libraries import EntryCompiler, LongEntryCompiler
from nsmaps.exact.engine.jit import entry, long_entry
from nsmaps.reduced.composite import compiled as callers

CODEGEN = cpu_target.target_context.codegen()


def entries():
    """Every compiled function of the package that is an entry, by module and name."""
    found = {}
    for module in pkgutil.walk_packages(nsmaps.__path__, "nsmaps."):
        if module.name.startswith(
            ("nsmaps.exact.", "nsmaps.enclosures.", "nsmaps.reduced.", "nsmaps.dynamics.", "nsmaps.proof.")
        ):
            for value in vars(import_module(module.name)).values():
                if isinstance(value, CPUDispatcher) and value._compiler.pipeline_class in (EntryCompiler, LongEntryCompiler):
                    found[value.py_func.__module__, value.py_func.__name__] = value
    return found


@pytest.mark.thorough
def test_every_entry_is_made(tmp_path):
    """All that a wheel contains, some minutes."""
    command = [sys.executable, Path(__file__).with_name("make_entries.py"), str(tmp_path / "made")]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, capture_output=True)
    made = [pickle.loads(lzma.decompress(path.read_bytes())) for path in (tmp_path / "made").iterdir()]
    assert {(about[0].modname, about[0].qualname) for _, _, _, about in made} == set(entries())


def test_the_name_tells_versions_but_not_the_processor(monkeypatch):
    cache = next(iter(entries().values()))._cache
    name = cache._name((), CODEGEN, shipped=True)
    monkeypatch.setattr(CODEGEN, "_tm_features", "+other")
    assert cache._name((), CODEGEN, shipped=True) == name
    monkeypatch.setattr(numba, "__version__", "0.0")
    assert cache._name((), CODEGEN, shipped=True) != name


STARTS = [[0.7, 0.2], [0.8, 1.0], [1.3, 2.0], [0.05, 5.0]]
RUN = f"""
import sys
from pathlib import Path
from exported import composite
from nsmaps.exact.compiling import compiled, linked
linked.FOLDER = Path(sys.argv[1])
compiled.missing.append(lambda: print("compiles"))
print(composite().orbits({STARTS}, 40).image.tobytes().hex())
"""


def test_results_are_the_same_with_and_without(tmp_path, monkeypatch):
    """Compiled here where there is no linked form, or a damaged one, and from the form in a program of its own."""
    made, missing = tmp_path / "made", []
    monkeypatch.setattr(linked, "written_to", made)
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path)
    monkeypatch.setattr(compiled, "missing", [lambda: missing.append("compiles")])
    monkeypatch.setattr(callers, "orbits", long_entry(callers.orbits.py_func))
    without = exported.composite().orbits(STARTS, 40).image.tobytes().hex()
    assert missing == ["compiles"]
    (form,) = made.iterdir()
    assert form.name.startswith("orbits-")
    environment = {**os.environ, "NSMAPS_CACHE_DIR": str(tmp_path / "empty"), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", RUN, made], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [without]
    _, simplified, scalar, _ = pickle.loads(lzma.decompress(form.read_bytes()))
    assert not scalar
    code = str(llvm.parse_bitcode(simplified))
    assert "alloca double" not in code  # simplified when it was made, not at each user's
    assert " x double>" not in code  # for every processor, whatever vectors that of the builder has
    form.write_bytes(form.read_bytes()[:-100])
    monkeypatch.setattr(linked, "FOLDER", made)
    assert linked.read(form.name) is None
    assert linked.read("none.xz") is None


def test_code_without_vectors_is_not_optimised_again(tmp_path, monkeypatch):
    rng, made = np.random.default_rng(1), tmp_path / "made"
    shapes = [field.shape for field in Pieces.room(9, 2)]
    pieces = Pieces(*(rng.integers(0, 3, shape) if len(shape) == 1 else rng.random(shape) for shape in shapes))

    def concluded():
        bounds, at = np.tile([np.inf, -np.inf], (3, 1)), np.tile([np.inf, -np.inf], (3, 2, 2, 1))
        entry(conclude.py_func)(pieces, np.zeros((3, 2)), bounds, at)
        return bounds.tobytes(), at.tobytes()

    monkeypatch.setattr(linked, "written_to", made)
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path)
    without = concluded()
    (form,) = made.iterdir()
    *_, scalar, _ = pickle.loads(lzma.decompress(form.read_bytes()))
    assert scalar
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path / "empty")
    monkeypatch.setattr(linked, "FOLDER", made)
    monkeypatch.setattr(linked, "optimise", None)
    assert concluded() == without
