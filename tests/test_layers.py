"""Imports run one way, no plugin is imported, and nothing heavy is loaded before it is needed."""

import ast
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from messages import message
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from nsmaps.lazy import stated_names

ROOT = Path(__file__).parents[1]
RANK = {
    "errors": -0.1,
    "interrupts": 0,
    "progress": 0,
    "lazy": 0.1,
    "arrays": 0,
    "files": 0.5,
    "coordinates": 0.5,
    "results": 0.6,
    "parallel": 0.7,
    "continuation": 0.8,
    "verify": 0.8,  # shares nothing with the rooms whose results it verifies
    "exact": 1,
    "dynamics": 1.5,  # below `reduced`, which follows orbits to tell where a map attracts
    "reduced": 2,
    "enclosures": 2.5,
    "symbolic": 2.7,
    "auxiliary": 3,
    "cells": 3.5,
    "proof": 3.7,
    "exports": 4,
    "plugins": 4,
    "testing": 4,
    "estimation": 4.3,
    "figures": 4.5,
    "study": 5,
    "report": 5.5,
    "explore": 5.7,
    "bench": 6,
    "__init__": 6,
    "cli": 7,
    "__main__": 8,
}
MODES = ("definitions", "tables", "flights", "march", "blocks", "paths")  #: rooms of `exact/modes`, in the order of imports
ROOMS = tuple(f"nsmaps.{name}" for name, home in stated_names(ROOT / "nsmaps" / "__init__.pyi").items() if home == "nsmaps")
FACES = {"nsmaps", *ROOMS}  #: packages with public names of their modules
HEAVY = ("numba", "sympy", "scipy", "matplotlib")


def statements(tree: ast.AST, typed: bool = False) -> Iterator[tuple[ast.AST, bool]]:
    """The statements of a tree, at any depth, each with whether only type checkers read it."""
    for node in ast.iter_child_nodes(tree):
        below = typed or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test))
        if isinstance(node, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield node, below
            yield from statements(node, below)


@cache
def import_statements(source: str | Path) -> tuple[tuple[ast.Import | ast.ImportFrom, bool], ...]:
    """The statements of a source, or of a file, that import, each with whether only type checkers read it."""
    text = source if isinstance(source, str) else source.read_text(encoding="utf-8")
    found = statements(ast.parse(text))
    return tuple((node, typed) for node, typed in found if isinstance(node, ast.Import | ast.ImportFrom))


def imports(source: str | Path) -> Iterator[str]:
    """Every module that a source, or a file, imports, at any depth, other than for type checkers only."""
    for node in (node for node, typed in import_statements(source) if not typed):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        else:
            module = "." * node.level + (node.module or "")
            yield from (f"nsmaps.{alias.name}" for alias in node.names) if module == "nsmaps" else [module]


def room(module: str) -> str:
    """The room that a module or name of nsmaps belongs to; a public name belongs to the package itself."""
    name = [*module.split("."), "__init__"][1]
    return name if name in RANK else "__init__"


def upward(source: str | Path, of: str) -> list[str]:
    """The imports of a source, or of a file, in room `of` that do not lead downwards."""
    found = [module for module in imports(source) if module.split(".")[0] == "nsmaps"]
    return [module for module in found if room(module) != of and RANK[room(module)] >= RANK[of]]


FILES = sorted((ROOT / "nsmaps").rglob("*.py"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_imports_run_one_way(file: Path) -> None:
    parts = file.relative_to(ROOT / "nsmaps").with_suffix("").parts
    assert upward(file, parts[0]) == []
    for module in imports(file):
        assert not module.startswith("."), "imports name their module in full"
        assert not module.startswith(("plugins", "nsmaps_")), f"{file.name} imports the plugin {module}"


@pytest.mark.parametrize(
    "file", [file for file in FILES if "modes" in file.parts[:-1]], ids=lambda file: str(file.relative_to(ROOT))
)
def test_rooms_of_systems_with_modes_are_in_order(file: Path) -> None:
    of = file.parent.name
    later = MODES[MODES.index(of) + 1 :] if of in MODES else ()
    for module in imports(file):
        assert not module.startswith(tuple(f"nsmaps.exact.modes.{room}" for room in later))


def test_rooms_are_small() -> None:
    count = Counter(str(file.parent.relative_to(ROOT)) for file in FILES if file.stem != "__init__")
    assert max(count.values()) <= 10, count.most_common(3)


@pytest.mark.parametrize("file", sorted(ROOT.glob("plugins/**/*.py")) + sorted(ROOT.glob("tests/**/*.py")), ids=str)
def test_nothing_is_imported_from_the_folder_of_plugins(file: Path) -> None:
    assert [module for module in imports(file) if module.split(".")[0] == "plugins"] == []


def test_a_wrong_direction_is_seen() -> None:
    assert upward("from nsmaps.study import run", "exact") == ["nsmaps.study"]
    assert upward("def f():\n    import nsmaps.cli.cli", "figures") == ["nsmaps.cli.cli"]
    assert upward("from nsmaps import load_study", "exact") != []
    assert upward("from nsmaps.reduced.conditions.region import Box", "dynamics") == ["nsmaps.reduced.conditions.region"]
    assert upward("if TYPE_CHECKING:\n    from nsmaps.study import run", "exact") == []
    assert upward("from nsmaps.exact.systems.system import Wall", "reduced") == []


def loaded_by(program: str) -> list[str]:
    """The heavy packages that a python which runs a program has loaded when it ends."""
    wrapped = (
        "import atexit, runpy, sys; "
        f"atexit.register(lambda: print([m for m in {HEAVY!r} if m in sys.modules], file=sys.stderr)); "
    )
    done = subprocess.run([sys.executable, "-c", wrapped + program], capture_output=True, text=True, check=True)
    return list(ast.literal_eval(done.stderr.strip().splitlines()[-1]))


@pytest.mark.parametrize(
    "program",
    [
        "import nsmaps; dir(nsmaps)",
        "sys.argv = ['nsmaps', '--help']; runpy.run_module('nsmaps', run_name='__main__')",
        "sys.argv = ['nsmaps', 'run', '--help']; runpy.run_module('nsmaps', run_name='__main__')",
        "sys.argv = ['nsmaps', '--version']; runpy.run_module('nsmaps', run_name='__main__')",
        "import nsmaps.plugins; nsmaps.plugins.system_names()",
        "import nsmaps_vi_pair",
        "sys.argv = ['nsmaps', 'systems']; runpy.run_module('nsmaps', run_name='__main__')",
        "import nsmaps.figures",
        "import nsmaps.study.reading.reader",
    ],
)
def test_nothing_heavy_is_loaded(program: str) -> None:
    assert loaded_by(program) == []


def test_programs_keep_linear_algebra_to_one_core() -> None:
    """What the environment says to NumPy is read when it is loaded, which must not be before the program sets it."""
    script = (
        "import os, runpy, sys; import nsmaps.cli.cli; assert 'numpy' not in sys.modules\n"
        "try: runpy.run_module('nsmaps', run_name='__main__')\n"
        "except SystemExit: print(os.environ['OPENBLAS_NUM_THREADS'], 'numpy' in sys.modules)"
    )
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    command = [sys.executable, "-c", script, "show", "nowhere"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.splitlines()[-1] == "1 True"


def test_something_heavy_would_be_seen() -> None:
    assert loaded_by("import sympy") == ["sympy"]


def test_the_public_face_is_what_type_checkers_see() -> None:
    import nsmaps

    assert len(nsmaps.__all__) <= 75
    assert len(ROOMS) >= 10
    stubs = [name for name in ("nsmaps", *ROOMS) if (ROOT / name.replace(".", "/") / "__init__.pyi").exists()]
    for package in map(import_module, stubs):
        homes = stated_names(Path(str(package.__file__)).with_suffix(".pyi"))
        assert dir(package) == sorted(homes)
        for name, module in homes.items():
            home = getattr(import_module(module), name)
            assert getattr(package, name) == home, f"{package.__name__}.{name}"
    with pytest.raises(AttributeError, match=message("errors.attribute", name="load_studi", near="load_study")):
        _ = nsmaps.load_studi


def imported(file: Path, modules: set[str]) -> set[str]:
    """The modules of nsmaps that a file imports, at any depth, in functions and for type checkers too, with their packages."""
    found = set()
    for node, _ in import_statements(file):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & modules
        elif (node.module or "").startswith("nsmaps"):
            found |= {name if (name := f"{node.module}.{alias.name}") in modules else str(node.module) for alias in node.names}
    packages = {str(parent).replace("/", ".") for name in found for parent in Path(name.replace(".", "/")).parents}
    return (found - {"nsmaps"}) | (packages & modules - FACES)  # public names of nsmaps are imported when first asked for


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """The sets of nodes, of more than one, that can all be reached from each other."""
    names = sorted(graph)
    rows = [(names.index(a), names.index(b)) for a in names for b in graph[a] if b in graph]
    adjacency = csr_array((np.ones(len(rows)), tuple(zip(*rows, strict=True))), shape=(len(names), len(names)))
    _, labels = connected_components(adjacency, connection="strong")
    groups = [[name for name, label in zip(names, labels, strict=True) if label == k] for k in set(labels)]
    return [group for group in groups if len(group) > 1]


def test_no_module_imports_itself_by_way_of_others(tmp_path: Path) -> None:
    """Types count: what is only annotated stands below what annotates it, too."""
    modules = {".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file for file in FILES}
    graph = {name: imported(file, set(modules)) for name, file in modules.items()}
    assert sum(map(len, graph.values())) > 2000
    assert circles(graph) == []
    (tmp_path / "type.py").write_text("if TYPE_CHECKING:\n    from nsmaps.study import run\ndef f():\n    import nsmaps.errors")
    assert imported(tmp_path / "type.py", set(modules)) == {"nsmaps.study.run", "nsmaps.errors"}


def test_a_circle_is_seen() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]
