"""Imports run one way, no plugin is imported, and nothing heavy is loaded before it is needed."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RANK = {
    "errors": 0,
    "arrays": 0,
    "names": 0,
    "interrupts": 0,
    "progress": 0,
    "storage": 0,
    "explain": 0.5,
    "reading": 0.5,
    "exact": 1,
    "dynamics": 1.5,  # below `reduced`, which follows orbits to tell where a map attracts
    "reduced": 2,
    "auxiliary": 3,
    "exports": 4,
    "plugins": 4,
    "testing": 4,
    "newplugin": 5,
    "study": 5,
    "figures": 5,
    "report": 5.5,
    "bench": 6,
    "__init__": 6,
    "terminal": 6,
    "commands": 6.5,
    "cli": 7,
    "__main__": 8,
}
HEAVY = ("numba", "sympy", "scipy", "matplotlib")


def imports(tree: ast.AST) -> Iterator[str]:
    """Every module that is imported, at any depth, other than for type checkers only."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            yield from (f"nsmaps.{alias.name}" for alias in node.names) if module == "nsmaps" else [module]
        yield from imports(node)


def room(module: str) -> str:
    """The room that a module or name of nsmaps belongs to; a public name belongs to the package itself."""
    name = [*module.split("."), "__init__"][1]
    return name if name in RANK else "__init__"


def upward(source: str, of: str) -> list[str]:
    """The imports of a file in room `of` that do not lead downwards."""
    found = [module for module in imports(ast.parse(source)) if module.split(".")[0] == "nsmaps"]
    return [module for module in found if room(module) != of and RANK[room(module)] >= RANK[of]]


FILES = sorted((ROOT / "nsmaps").rglob("*.py"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_imports_run_one_way(file: Path) -> None:
    parts = file.relative_to(ROOT / "nsmaps").with_suffix("").parts
    source = file.read_text(encoding="utf-8")
    assert upward(source, parts[0]) == []
    for module in imports(ast.parse(source)):
        assert not module.startswith("."), "imports name their module in full"
        assert not module.startswith(("plugins", "nsmaps_")), f"{file.name} imports the plugin {module}"


@pytest.mark.parametrize("file", sorted(ROOT.glob("plugins/**/*.py")) + sorted(ROOT.glob("tests/**/*.py")), ids=str)
def test_nothing_is_imported_from_the_folder_of_plugins(file: Path) -> None:
    assert [module for module in imports(ast.parse(file.read_text())) if module.split(".")[0] == "plugins"] == []


def test_a_wrong_direction_is_seen() -> None:
    assert upward("from nsmaps.study import run", "exact") == ["nsmaps.study"]
    assert upward("def f():\n    import nsmaps.cli", "figures") == ["nsmaps.cli"]
    assert upward("from nsmaps import load_study", "exact") != []
    assert upward("from nsmaps.reduced.region import Box", "dynamics") == ["nsmaps.reduced.region"]
    assert upward("if TYPE_CHECKING:\n    from nsmaps.study import run", "exact") == []
    assert upward("from nsmaps.exact.system import Wall", "reduced") == []


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
        "import nsmaps.figures; nsmaps.figures.NAMES",
    ],
)
def test_nothing_heavy_is_loaded(program: str) -> None:
    assert loaded_by(program) == []


def test_something_heavy_would_be_seen() -> None:
    assert loaded_by("import sympy") == ["sympy"]


def test_the_public_face_is_what_type_checkers_see() -> None:
    import nsmaps

    tree = ast.parse((ROOT / "nsmaps" / "__init__.py").read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {alias.name: node.module for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert typed == nsmaps._HOME
    assert all(vars(import_module(module))[name] is getattr(nsmaps, name) for name, module in typed.items())
    with pytest.raises(AttributeError, match="did you mean 'load_study'"):
        _ = nsmaps.load_studi
