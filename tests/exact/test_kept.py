"""Compiled code is kept under all that it depends on, known to be whole when it is read, and is made again where it is not."""

import math
import os
import re
import subprocess
import sys
import warnings
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, NamedTuple

import llvmlite
import numba
import numpy as np
import pytest
import sympy as sp
from messages import message
from numba.core.registry import CPUDispatcher

from nsmaps.exact.compiling import compiled, digest, kept, libraries
from nsmaps.exact.compiling.compiled import njit
from nsmaps.exact.compiling.digest import code_of
from nsmaps.exact.engine import march, returns
from nsmaps.exact.engine.blocks.batch import orbits
from nsmaps.exact.engine.flight import flow, layout
from nsmaps.exact.systems import flow as flows
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall
from nsmaps.reduced.adaptive import kernel as strips
from nsmaps.reduced.composite import kernel as pieces

ONE, TABLE = 1.0, np.array([1.0, 2.0])


class Dropped(ImpactSystem):
    """A ball on a floor, whose impact law and horizon are those of the base class."""

    r: float = 0.5

    def walls(self) -> dict[str, Wall]:
        return {"B": Wall(at=0, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi

    def displacement(self, t: Any, hit: Any) -> Any:
        return hit.z + hit.w * (t - hit.t) - (t - hit.t) ** 2 / 2


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of compiled code, and a memory that is empty before and after."""
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path)
    flows._kernel.cache_clear()
    kept._warn.cache_clear()
    yield tmp_path
    flows._kernel.cache_clear()


def named() -> str:
    """What the kernel of `Dropped` is called now."""
    flows._kernel.cache_clear()
    digest._description.cache_clear()
    return Dropped()._kernel().name


def test_defaults_of_the_base_class_are_those_of_the_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [named()]

    def law_and_horizon() -> tuple[float, float]:
        names.append(named())
        table = Dropped()._kernel().table
        return table[layout.RESTITUTION], table[layout.HORIZON]

    assert law_and_horizon() == (0.5, pytest.approx(2000 * math.pi, rel=1e-15))
    monkeypatch.setattr(ImpactSystem, "rebound", lambda self, speed, wall: self.r * speed / 2)
    assert law_and_horizon() == (0.25, pytest.approx(2000 * math.pi, rel=1e-15))
    monkeypatch.setattr(ImpactSystem, "horizon", 500.0)
    assert law_and_horizon() == (0.25, pytest.approx(1000 * math.pi, rel=1e-15))
    assert len(set(names)) == 3


def test_options_are_written_alike_in_every_process() -> None:
    """A set of several is written in another order in each, and its functions would be compiled by each."""
    functions = [value for value in vars(strips).values() if isinstance(value, CPUDispatcher)]
    options = [option for each in functions for option in each.targetoptions.values()]
    assert {"contract": True, "nsz": True} in options
    assert not [option for option in options if isinstance(option, set) and len(option) > 1]


@pytest.mark.parametrize(("module", "what"), [(march, "ROUNDING"), (returns, "NO_SPEED"), (layout, "BEGIN"), (flow, "linear")])
def test_another_engine_has_another_key(module: Any, what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Constants and functions of any of its files: those that compiled entries and parts of long runs are kept under."""
    before, code = named(), code_of(orbits)
    changed = njit()(lambda t, row, at, z, w: 0.0) if module is flow else 2 * getattr(module, what) + 1
    for where in (flow, march, returns):
        if what in vars(where):
            monkeypatch.setattr(where, what, changed)
    assert named() != before
    assert code_of(orbits) != code
    digest._description.cache_clear()


def compilers_changed(monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    """Another version of what compiles, or another setting of it."""
    at = {"numba": numba, "llvmlite": llvmlite, "numpy": np}
    if what in at:
        monkeypatch.setattr(at[what], "__version__", "0.0")
    elif what == "python":
        monkeypatch.setattr(sys, "version", "0.0")
    else:
        monkeypatch.setattr(numba.config, what, not vars(numba.config)[what])


COMPILERS = ["numba", "llvmlite", "numpy", "python", *compiled.SETTINGS]


@pytest.mark.parametrize("what", COMPILERS)
def test_what_compiles_is_part_of_both_keys(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    before, file = named(), compiled._file_name("m", "f", "code", "(int64,)", ("cpu", "+avx"))
    compilers_changed(monkeypatch, what)
    assert compiled._file_name("m", "f", "code", "(int64,)", ("cpu", "+avx")) != file
    assert named() != before


def test_processor_types_and_code_are_part_of_the_key_of_a_compiled_function() -> None:
    one = compiled._file_name("m", "f", "code", "(int64,)", ("cpu", "+avx"))
    others = [
        ("code", "(int64,)", ("cpu", "+avx2")),
        ("code", "(float64,)", ("cpu", "+avx")),
        ("other", "(int64,)", ("cpu", "+avx")),
    ]
    assert len({one, *(compiled._file_name("m", "f", *other) for other in others)}) == 4


@njit(cache=True)
def inner(x):
    return x + ONE


@njit(cache=True)
def outer(x):
    return inner(x) + TABLE[0]


@njit(cache=True, error_model="numpy")
def divided(x):
    return inner(x) + TABLE[0]


def test_the_code_of_a_function_is_that_of_all_that_it_calls_with_their_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    told = [code_of(outer)]
    changes = {"ONE": 2.0, "TABLE": np.array([1.0, 3.0]), "inner": njit(cache=True)(lambda x: x * ONE)}
    for name, value in changes.items():
        digest._description.cache_clear()
        monkeypatch.setitem(globals(), name, value)
        told.append(code_of(outer))
    digest._description.cache_clear()
    assert len(set(told)) == 4
    assert code_of(divided) != code_of(outer)


ADDS = "@njit(cache=True)\ndef f(x):\n    return {} + 10"
GIVES = "@njit(cache=True)\ndef one(x):\n    return {}"
#: a file with a function that calls a function, that of a module, reads a constant or an enumeration; and what it calls
CHANGES = [
    ("from called import one\n" + ADDS.format("one(x)"), GIVES),
    ("import called\n" + ADDS.format("called.one(x)"), GIVES),
    ("import called\n" + ADDS.format("called.ONE"), "ONE = {}"),
    ("from called import One\n" + ADDS.format("One.one"), "from enum import IntEnum\nclass One(IntEnum):\n    one = {}"),
]


def test_a_changed_constant_is_met_by_new_code(folder: Path, tmp_path: Path) -> None:
    """Numba's own cache answers 11 twice: the texts of the files that call are the same."""
    source = tmp_path / "source"
    source.mkdir()
    head = "from nsmaps.exact.compiling.compiled import njit\n"
    for k, (caller, _) in enumerate(CHANGES):
        (source / f"caller{k}.py").write_text(f"{head}{caller.replace('called', f'called{k}')}\n")
    for value in (1, 2):
        for k, (_, called) in enumerate(CHANGES):
            (source / f"called{k}.py").write_text(f"{head}{called.format(value)}\n")
        paths = os.pathsep.join([str(source), *sys.path])
        environment = {**os.environ, "PYTHONPATH": paths, "NSMAPS_CACHE_DIR": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
        code = "from importlib import import_module; print(*(import_module(f'caller{k}').f(0) for k in range(4)))"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        assert done.stdout.split() == [str(value + 10)] * 4


def test_the_key_is_the_same_in_every_process() -> None:
    lines = "from nsmaps.reduced.composite.kernel import orbits", "from nsmaps.exact.compiling.digest import code_of"
    program = "; ".join([*lines, "print(code_of(orbits))"])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "PYTHONHASHSEED": "1"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout == f"{code_of(pieces.orbits)}\n"


def files(folder: Path) -> dict[str, bytes]:
    """Of compiled code; beside each stands a note of how long it took."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix == ".bin"}


def test_code_that_is_kept_is_used_again_and_what_is_broken_is_made_again(folder: Path) -> None:
    assert njit(cache=True)(inner.py_func)(1.0) == 2.0
    (name,) = whole = files(folder)
    for content in (b"", whole[name][:-1], whole[name][:40] + b"x" + whole[name][41:]):
        (folder / name).write_bytes(content)
        again = njit(cache=True)(inner.py_func)
        assert again(1.0) == 2.0
        assert sum(again.stats.cache_hits.values()) == 0
        assert list(files(folder)) == [name]
    used = njit(cache=True)(inner.py_func)
    assert used(1.0) == 2.0
    assert sum(used.stats.cache_hits.values()) == 1


def test_a_folder_that_cannot_be_written_is_told_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path / "file" / "kernels")
    with pytest.warns(RuntimeWarning, match=message("exact.not-kept", folder=re.compile(r".*kernels"), reason="Not a directory")):
        assert njit(cache=True)(inner.py_func)(1.0) == 2.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert njit(cache=True)(inner.py_func)(2.0) == 3.0


def pipeline(folder: Path, text: str) -> str:
    """The digest of a module with this text."""
    (folder / "pipeline.py").write_text(text)
    spec = spec_from_file_location("pipeline", folder / "pipeline.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    digest.code_of_module.cache_clear()
    return digest.code_of_module(module)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('linkage = "linkonce_odr"', 'linkage = "internal"'),
        ("library = Part\n", "library = Entry\n"),
        ("not in UNUSED", "in UNUSED"),
        ("self._optimize_final_module()", "pass"),
        ("types.unliteral", "types.literal"),
    ],
)
def test_an_edited_pipeline_is_part_of_the_key(old: str, new: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """How parts are linked, the passes of their compiler, and how entries are put together; but not comments."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    text = Path(libraries.__file__).read_text(encoding="utf-8")
    assert text.count(old) == 1
    before = pipeline(tmp_path, text)
    assert before in compiled.compilers()
    assert pipeline(tmp_path, f"# a comment\n{text}") == before
    assert pipeline(tmp_path, text.replace(old, new)) != before
    digest.code_of_module.cache_clear()


def test_stored_code_is_read_after_the_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    """A function whose code another process has stored in the meantime is not compiled here."""
    function = njit(cache=True)(lambda x: x + 1.0)
    assert function(1.0) == 2.0
    again = njit(cache=True)(function.py_func)
    stored, claimed = compiled.read, []
    monkeypatch.setattr(compiled, "read", lambda name: stored(name) if claimed else None)
    monkeypatch.setattr(compiled, "claim", lambda name: claimed.append(name))
    assert again(1.0) == 2.0
    assert len(claimed) == 1
    assert again.stats.cache_hits


CLAIM = """
import sys, time
from nsmaps.exact.compiling import kept
kept.claim("code")
print("claimed", flush=True)
sys.stdin.readline()
kept.release("code")
"""


@pytest.fixture
def other(folder: Path) -> "subprocess.Popen[str]":
    """Another process that has claimed the code, until it is sent a line."""
    pytest.importorskip("fcntl")
    environment = {**os.environ, "NSMAPS_CACHE_DIR": str(folder), "PYTHONPATH": os.pathsep.join(sys.path)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "env": environment}
    process = subprocess.Popen([sys.executable, "-c", CLAIM], **pipes)
    assert process.stdout.readline() == "claimed\n"
    yield process
    process.kill()
    process.communicate()


@pytest.mark.parametrize("end", ["release", "kill"])
def test_one_process_compiles_while_another_waits(end: str, other: Any, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    looks: list[float] = []

    def look(seconds: float) -> None:
        looks.append(seconds)
        if len(looks) == 3:
            other.kill() if end == "kill" else print(file=other.stdin, flush=True)
        other.wait() if len(looks) >= 3 else None

    monkeypatch.setattr(kept, "sleep", look)
    kept.claim("code")
    assert kept.CLAIMED["code"] is not None
    assert len(looks) == 3
    kept.release("code")
    assert not list(folder.glob("*.lock"))


def test_patience_ends(other: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "PATIENCE", 0.0)
    kept.claim("code")
    assert kept.CLAIMED.pop("code") is None


def test_where_nothing_can_be_locked_each_process_compiles_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr(kept, "_folder", lambda: tmp_path / "file" / "folder")
    kept.claim("code")
    assert kept.CLAIMED["code"] is None
    kept.release("code")
    assert not kept.CLAIMED


def test_a_compilation_that_failed_can_be_repeated_and_holds_nobody_up() -> None:
    function = njit(cache=True)(lambda x: x.nothing)
    for _ in range(2):
        with pytest.raises(numba.TypingError):
            function(1.0)
        assert not kept.CLAIMED


def test_a_named_tuple_of_another_module_has_another_key() -> None:
    """A stored function is read back with the class of its arguments, which must be found where it was."""
    fields = [("a", float)]
    here, there = (NamedTuple("Pair", fields) for _ in range(2))
    there.__module__ = "somewhere.else"
    one, other = (compiled._type_text(numba.typeof((kind(1.0), 2))) for kind in (here, there))
    assert one != other
    assert "somewhere.else" in other
