"""Compiled code that strangers can read: no number without a name, no long tuple, few arguments."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

EXACT = Path(__file__).parents[2] / "nsmaps" / "exact"
PLAIN = (0.0, 0.5, 1.0, 2.0)  #: floats that need no name
LONGEST, MOST = 4, 7  #: of a tuple that is returned, of arguments
#: past participles: words in -ed but for some nouns and verbs, and irregular ones that are nothing else
PARTICIPLE = re.compile(
    r"(?!(?:bed|embed|exceed|feed|need|proceed|seed|shed|speed|succeed)$)(?:[a-z]*ed|begun|bent|borne|bought|bound|broken|brought"
    r"|built|caught|chosen|dealt|done|drawn|driven|fallen|found|flown|fought|given|gone|grown|heard|held|hidden|hung|kept|known"
    r"|laid|led|left|lent|lost|made|meant|met|paid|risen|said|seen|sent|shown|sold|sought|spent|spoken|struck|stuck|swept|taken"
    r"|taught|thrown|told|torn|won|worn|wound|woven|written)"
)
ENTRIES = {"entry", "long_entry"}
COMPILERS = {"inner", "inlined", "fused", "allocating", *ENTRIES}  #: decorators of `exact/engine/jit.py`
#: arguments that are quantities of the motion: a kernel that takes one has units in its docstring, or its module or room does
QUANTITIES = {
    *("end", "h", "length", "max_length", "phase", "phases", "phi", "s", "step", "tau", "time", "times", "until", "when"),
    *("chatter", "flight", "gap", "impact", "motion", "passage", "speed", "state", "states", "v", "z"),
}
UNITS = re.compile(r"\b(?:[Uu]nits?|radians|longest steps|cells of the mode)\b")
SHAPE = re.compile(r"\((?:\d+ )?[A-Z0-9]\w*(?: [-+*] \w+)*(?:, [^()]*|,)\)")  #: as (N,), (N, 2), (n + 1, M)
#: formulas of compiled code and of definitions: where they stand, and the source that is cited there
SOURCES = (
    ("engine/accumulation.py", "Budd and F. Dux", "Nordmark and P. Piiroinen"),
    ("engine/constants.py", "Cody and W. Waite"),
    ("engine/flight/layout.py", "d(s) = w s + "),
    ("engine/observers.py", "Aizerman and F. R. Gantmakher"),
    ("engine/returns.py", "Taylor's theorem"),
    ("engine/steps.py", "Taylor's theorem"),
    ("modes/definitions/events/contact.py", "Nordmark and P. Piiroinen"),
    ("modes/flights/pieces.py", "Jorba"),
    ("modes/flights/pieces.py", "Biscani and D. Izzo"),
    ("modes/flights/rounding.py", "Blanes"),
    ("modes/definitions/events/sliding.py", "Filippov"),
    ("modes/enclosure/forms.py", "de Figueiredo, J. Stolfi"),
    ("noise/flight.py", "Gillespie"),
    ("noise/modes.py", "Gillespie"),
    ("noise/orbit.py", "Uhlenbeck and L. S. Ornstein", "Gillespie"),
)


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


def functions(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, set[str]]]:
    """The functions of a module that are no properties, with the names of their decorators."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            known = {ast.unparse(each) for each in node.decorator_list}
            if not known & {"property", "cached_property"}:
                yield node, known


def participles(tree: ast.Module) -> list[str]:
    """The functions whose name is a bare participle."""
    return [node.name for node, _ in functions(tree) if PARTICIPLE.fullmatch(node.name.strip("_"))]


def without_shapes(tree: ast.Module) -> list[str]:
    """The entry points of compiled code that take a part of an argument and name the shape of none in their docstring."""
    found = []
    for node, known in functions(tree):
        names = {each.arg for each in node.args.args}
        arrays = {ast.unparse(each.value) for each in ast.walk(node) if isinstance(each, ast.Subscript)} & names
        if known & ENTRIES and arrays and not SHAPE.search(ast.get_docstring(node) or ""):
            found.append(node.name)
    return found


def without_units(tree: ast.Module, room: ast.Module) -> list[str]:
    """The kernels that take quantities, and of which neither they nor their module nor its room state units."""
    if any(UNITS.search(ast.get_docstring(each) or "") for each in (tree, room)):
        return []
    kernels = [
        node for node, known in functions(tree) if known & COMPILERS and {each.arg for each in node.args.args} & QUANTITIES
    ]
    return [node.name for node in kernels if not UNITS.search(ast.get_docstring(node) or "")]


FILES = sorted(file for file in EXACT.rglob("*.py") if file.name != "constants.py")


@cache
def trees() -> list[tuple[str, ast.Module]]:
    """The modules with their names."""
    return [(str(file.relative_to(EXACT)), ast.parse(file.read_text())) for file in FILES]


def test_numbers_have_names_and_few_of_them_go_together() -> None:
    assert [(name, found) for name, tree in trees() if (found := list(complaints(tree)))] == []


def test_kernels_have_docstrings() -> None:
    kernels = [(name, *each) for name, tree in trees() for each in functions(tree) if each[1] & COMPILERS]
    assert len(kernels) > 400
    assert [(name, node.name) for name, node, _ in kernels if not ast.get_docstring(node)] == []


def test_functions_are_named_by_nouns_and_verbs() -> None:
    assert [(name, found) for name, tree in trees() if (found := participles(tree))] == []


def kinds_asked(tree: ast.Module) -> list[str]:
    """The classes of systems and of kernels that `isinstance` asks for."""
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"]
    asked = [name for call in calls for name in re.findall(r"\w+", ast.unparse(call.args[-1]))]
    return [name for name in asked if name.endswith(("System", "Kernel", "Formulas"))]


def test_no_code_asks_for_the_kind_of_a_system() -> None:
    assert [(name, found) for name, tree in trees() if (found := kinds_asked(tree))] == []
    assert kinds_asked(ast.parse("isinstance(a, str), isinstance(b, ImpactSystem | int)")) == ["ImpactSystem"]


def test_entries_state_shapes() -> None:
    assert [(name, found) for name, tree in trees() if (found := without_shapes(tree))] == []


def test_kernels_their_modules_or_rooms_state_units() -> None:
    known = dict(trees())
    rooms = {name: known[str(Path(name).with_name("__init__.py"))] for name in known}
    assert [(name, found) for name, tree in known.items() if (found := without_units(tree, rooms[name]))] == []


@pytest.mark.parametrize(("file", "sources"), [(file, sources) for file, *sources in SOURCES])
def test_formulas_cite_their_source(file: str, sources: list[str]) -> None:
    text = " ".join((EXACT / file).read_text().split())
    assert [source for source in sources if source not in text] == []


def test_the_rules_are_seen_to_be_broken() -> None:
    source = "def f(a, b, c, d, e, f, g, h):\n    return a[0], b[k + 1], 1.5 * c, d.shape[1], e[2:], f[g]"
    assert [each.split(": ")[1] for each in complaints(ast.parse(source))] != []
    assert len(list(complaints(ast.parse(source)))) == 5
    names = "\n".join(f"def {name}(): ..." for name in ("_moved", "speed", "held", "moved_point"))
    assert participles(ast.parse(names)) == ["_moved", "held"]
    entry = "@entry\ndef f(x):\n    'The first number of x{}.'\n    return x[FIRST]"
    assert without_shapes(ast.parse(entry.format(""))) == ["f"]
    assert without_shapes(ast.parse(entry.format(", shape (N,)"))) == []
    kernel, room = "@inner\ndef f(p, time):\n    'The state{}.'", ast.parse("'A room.'")
    assert without_units(ast.parse(kernel.format("")), room) == ["f"]
    assert without_units(ast.parse(kernel.format(" at a time in radians of the forcing")), room) == []
    assert without_units(ast.parse(kernel.format("")), ast.parse("'Units are those of the system.'")) == []
