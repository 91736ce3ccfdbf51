"""Compiled code that strangers can read: no number without a name, no long tuple, few arguments."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

EXACT = Path(__file__).parents[2] / "nsmaps" / "exact"
#: rooms of `exact`, and modules, that do not comply yet: a line goes when they do, and none is added
LATER = (
    "compiling",
    "enclosure",
    "modes/enclosure",
    "modes/flights",
    "modes/march",
    "modes/paths",
    "modes/tables/memory.py",
    "noise/driven.py",
    "noise/modes.py",
    "observables/mode_slopes.py",
    "observables/motions.py",
)
PLAIN = (0.0, 0.5, 1.0, 2.0)  #: floats that need no name
LONGEST, MOST = 4, 7  #: of a tuple that is returned, of arguments


def complaints(tree: ast.Module) -> Iterator[str]:
    """The places of a module that break the rules, with their lines."""
    named = {each for node in tree.body if _names_a_constant(node) for each in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and node not in named and isinstance(node.value, float) and node.value not in PLAIN:
            yield f"{node.lineno}: the number {node.value!r} has no name"
        if isinstance(node, ast.Subscript) and not ast.unparse(node.value).endswith(("shape", "Literal")):
            parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            if any(_has_a_number(part) for part in parts if not isinstance(part, ast.Slice)):
                yield f"{node.lineno}: the position {ast.unparse(node)} has no name"
        if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple) and len(node.value.elts) > LONGEST:
            yield f"{node.lineno}: {len(node.value.elts)} values are returned"
        if isinstance(node, ast.FunctionDef) and len(node.args.args + node.args.kwonlyargs) > MOST:
            yield f"{node.lineno}: {node.name} takes {len(node.args.args)} arguments"


def _has_a_number(position: ast.expr) -> bool:
    """True if a position has an integer in it; those of functions, of comparisons and of positions within it are no positions."""
    if isinstance(position, ast.Call | ast.Compare | ast.Subscript):
        return False
    if isinstance(position, ast.Constant):
        return type(position.value) is int
    return any(_has_a_number(part) for part in ast.iter_child_nodes(position) if isinstance(part, ast.expr))


def _names_a_constant(node: ast.stmt) -> bool:
    """True for an assignment to names in capital letters, where a comment can give the reason."""
    if not isinstance(node, ast.Assign):
        return False
    names = [each for target in node.targets for each in ast.walk(target) if isinstance(each, ast.Name)]
    return all(each.id.isupper() for each in names)


def later(file: Path) -> bool:
    """True for a module that does not comply yet."""
    name = str(file.relative_to(EXACT))
    return any(name == each or name.startswith(f"{each}/") for each in LATER)


FILES = sorted(file for file in EXACT.rglob("*.py") if file.name != "constants.py")


@pytest.mark.parametrize("file", [file for file in FILES if not later(file)], ids=lambda file: str(file.relative_to(EXACT)))
def test_numbers_have_names_and_few_of_them_go_together(file: Path) -> None:
    assert list(complaints(ast.parse(file.read_text()))) == []


@pytest.mark.parametrize("room", LATER)
def test_the_list_of_modules_that_do_not_comply_yet_can_only_shrink(room: str) -> None:
    files = [file for file in FILES if later(file) and str(file.relative_to(EXACT)).startswith(room)]
    assert any(list(complaints(ast.parse(file.read_text()))) for file in files), f"{room} complies: take it off the list"


def test_the_rules_are_seen_to_be_broken() -> None:
    source = "def f(a, b, c, d, e, f, g, h):\n    return a[0], b[k + 1], 1.5 * c, d.shape[1], e[2:], f[g]"
    assert [each.split(": ")[1] for each in complaints(ast.parse(source))] != []
    assert len(list(complaints(ast.parse(source)))) == 5
