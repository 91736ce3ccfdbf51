"""The code keeps within the limits of its size: lines of code and signatures, which are those that somebody has to read.

Counted are the lines of a module other than blank ones, comments, imports and docstrings.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LIMITS = {
    ("nsmaps/exact",): 14_300,
    ("nsmaps/study", "nsmaps/figures", "nsmaps/report"): 10_000,
    ("nsmaps", "plugins"): 56_000,
}  #: lines of code and signatures in folders


def _uncounted(tree: ast.Module) -> Iterator[ast.stmt]:
    """The imports and docstrings of a module."""
    documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, documented) and ast.get_docstring(node, clean=False) is not None:
            yield node.body[0]


def size(source: str) -> int:
    """The number of lines of code and signatures in a module."""
    left_out = {line for node in _uncounted(ast.parse(source)) for line in range(node.lineno, (node.end_lineno or 0) + 1)}
    lines = [line.strip() for line in source.splitlines()]
    return sum(bool(line) and line[0] != "#" and number not in left_out for number, line in enumerate(lines, 1))


@pytest.mark.parametrize(("folders", "limit"), LIMITS.items(), ids=lambda given: str(given))
def test_code_keeps_within_its_limits(folders: tuple[str, ...], limit: int) -> None:
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")]
    assert 0 < sum(size(file.read_text(encoding="utf-8")) for file in files) <= limit


def test_code_and_signatures_are_counted() -> None:
    counted = "LIMIT = 3  # of lines\n\ndef within(\n    lines,\n):\n    return lines <= LIMIT\n"
    others = '"""A module.\n\nIts text."""\n\n# a comment\nfrom math import (\n    pi,\n)\n\ndef of():\n    """The number."""\n'
    assert (size(counted), size(others), size(others + counted)) == (5, 1, 6)
