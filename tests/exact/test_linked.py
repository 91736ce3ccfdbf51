"""The linked forms of entries that are shipped: of the code that there is, complete, and the same results without them."""

import lzma
import os
import pickle
import pkgutil
import subprocess
import sys
from importlib import import_module

import exported
import numba
import pytest
from numba.core.registry import CPUDispatcher, cpu_target

import nsmaps
from nsmaps.exact.compiling import compiled, kept, linked
from nsmaps.exact.compiling.compiled import _Kept
from nsmaps.exact.compiling.libraries import EntryCompiler, LongEntryCompiler
from nsmaps.exact.engine.jit import entry
from nsmaps.reduced.composite import compiled as callers

CODEGEN = cpu_target.target_context.codegen()
MADE = linked.FOLDER / "versions.txt"
OTHER = "entries were shipped for other versions or another platform"
same_versions = pytest.mark.skipif(MADE.read_text().split() != [*linked.versions(CODEGEN)], reason=OTHER)


def entries():
    """Every compiled function of the package that is an entry, by module and name."""
    found = {}
    for module in pkgutil.walk_packages(nsmaps.__path__, "nsmaps."):
        if module.name.startswith(("nsmaps.exact.", "nsmaps.reduced.", "nsmaps.dynamics.", "nsmaps.proof.")):
            for value in vars(import_module(module.name)).values():
                if isinstance(value, CPUDispatcher) and value._compiler.pipeline_class in (EntryCompiler, LongEntryCompiler):
                    found[value.py_func.__module__, value.py_func.__name__] = value
    return found


def shipped():
    """The files with the module, the name and the signature of each."""
    for path in sorted(linked.FOLDER.glob("*.xz")):
        _, _, (description, _, signature, *_) = pickle.loads(lzma.decompress(path.read_bytes()))
        yield path, description.modname, description.qualname, signature


@same_versions
def test_shipped_entries_are_those_of_the_code():
    """Otherwise `python tests/exact/make_entries.py` makes them anew; until then they are not used."""
    known = entries()
    for path, module, name, signature in shipped():
        cache = known[module, name]._cache
        assert isinstance(cache, _Kept)
        assert cache._name(signature.args, CODEGEN, shipped=True) == path.name, f"{name} has been changed since it was made"


@same_versions
def test_every_entry_is_shipped():
    names = {(module, name) for _, module, name, _ in shipped()}
    assert not set(entries()) - names


def test_the_name_tells_versions_but_not_the_processor(monkeypatch):
    cache = next(iter(entries().values()))._cache
    name = cache._name((), CODEGEN, shipped=True)
    monkeypatch.setattr(CODEGEN, "_tm_features", "+other")
    assert cache._name((), CODEGEN, shipped=True) == name
    monkeypatch.setattr(numba, "__version__", "0.0")
    assert cache._name((), CODEGEN, shipped=True) != name


STARTS = [[0.7, 0.2], [0.8, 1.0], [1.3, 2.0], [0.05, 5.0]]
RUN = f"""
from exported import composite
from nsmaps.exact.compiling import compiled
compiled.missing.append(lambda: print("compiles"))
print(composite().orbits({STARTS}, 40).image.tobytes().hex())
"""


@same_versions
def test_results_are_the_same_with_and_without(tmp_path, monkeypatch):
    """From the shipped form in a program of its own, and compiled here where that is damaged, which is as if there were none."""
    shipped, damaged, missing = linked.FOLDER, tmp_path / "damaged", []
    damaged.mkdir()
    monkeypatch.setattr(linked, "FOLDER", damaged)
    for path in shipped.glob("orbits-*.xz"):
        (damaged / path.name).write_bytes(path.read_bytes()[:-100])
        assert linked.read(path.name) is None
    assert linked.read("none.xz") is None
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path)
    monkeypatch.setattr(compiled, "missing", [lambda: missing.append("compiles")])
    monkeypatch.setattr(callers, "orbits", entry(callers.orbits.py_func))
    without = exported.composite().orbits(STARTS, 40).image.tobytes().hex()
    assert missing == ["compiles"]
    environment = {**os.environ, "NSMAPS_CACHE_DIR": str(tmp_path / "empty"), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", RUN], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == [without]
