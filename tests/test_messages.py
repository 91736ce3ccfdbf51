"""The error messages, read from the sources: each says what is wrong, and what is expected or the way out.

Tests of a function compare a message by its code in `messages.toml`, which is held against the sources and the tests here.
`python tests/test_messages.py` prints the messages.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import CodeType
from typing import NamedTuple

from messages import SIGN, TEXTS, message
from pydantic_core._pydantic_core import list_all_errors

from nsmaps import errors

ROOT = Path(__file__).parents[1]
KINDS = {name for name, value in vars(errors).items() if isinstance(value, type) and issubclass(value, errors.NsmapsError)}
FILES = sorted([*(ROOT / "nsmaps").rglob("*.py"), *(ROOT / "plugins").rglob("*.py")])
#: what can be done: what is expected or what there is; or a reason that comes from elsewhere, at the end
WAY_OUT = re.compile(r"; expected|expected in|\bthere (is|are)\b|did you mean|near_match|install|; name |\{[^{}]*\}\)?$")
FINDINGS = ("ProofError", "CheckError")  #: results of a search or a check, which state what was found


class Message(NamedTuple):
    """A message with expressions in braces for what is filled in, and the line of a file that raises it."""

    kind: str
    text: str
    place: str

    @property
    def fault(self) -> str:
        """What is wrong, without what is expected."""
        return self.text.partition("; expected")[0]


def text_of(node: ast.expr) -> str:
    """A literal with its expressions in braces."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(each.value if isinstance(each, ast.Constant) else f"{{{ast.unparse(each.value)}}}" for each in node.values)
    return f"{{{ast.unparse(node)}}}"


def messages(file: Path) -> list[Message]:
    """The messages of the errors of nsmaps that a file raises."""
    source = file.read_text(encoding="utf-8")
    found = []
    for node in ast.walk(ast.parse(source)) if "Error(" in source else ():
        call = node.exc if isinstance(node, ast.Raise) else None
        if isinstance(call, ast.Call) and call.args and ast.unparse(call.func) in KINDS:
            found.append(Message(ast.unparse(call.func), text_of(call.args[0]), f"{file.relative_to(ROOT)}:{node.lineno}"))
    return found


RAISED = [each for file in FILES for each in messages(file)]


def test_the_messages_are_read() -> None:
    assert len(RAISED) > 500
    assert {each.kind for each in RAISED} >= KINDS - {"StudyError", "ConditionError"}


def test_each_message_is_written_once() -> None:
    written = [each.text for each in RAISED if not each.text.startswith("{")]
    assert {text for text in written if written.count(text) > 1} == set()


def test_each_message_says_what_is_expected_or_the_way_out() -> None:
    silent = [each for each in RAISED if each.kind not in FINDINGS and not WAY_OUT.search(each.text)]
    assert silent == []


def test_a_message_begins_small_and_is_no_sentence() -> None:
    """It stands after a place in a file, or before another reason."""
    found = [each for each in RAISED if each.text[0].isupper() or each.text.endswith(".")]
    assert {each.text.split()[0] for each in found} <= {"Conley", "names"}


CLAUSE = re.compile(r"\{\w+\}|\.\.\.|^\^|\$$|['\"]|[;:,()\[\]] ?|\bexpected\b|\.(?=\w)|\. |\d+")  #: between clauses


def strings(code: CodeType) -> Iterator[str]:
    """The strings of a compiled module."""
    for each in code.co_consts:
        yield from (each,) if isinstance(each, str) else strings(each) if isinstance(each, CodeType) else ()


@cache
def said() -> list[str]:
    """The strings of the sources by folder, each in a line, and the messages of pydantic."""
    by_folder = {Path(): {each["message_template_python"] for each in list_all_errors()}}
    for file in FILES:
        found = strings(SourceFileLoader("", str(file)).get_code(""))
        by_folder.setdefault(file.parent, set()).update(each.strip() for each in found)
    return ["\n".join(("", *found, "")) for found in by_folder.values()]


def is_joined(words: list[str], lines: str, begin: str = "") -> bool:
    """Whether words are put together from lines: the end of one, whole ones, and the beginning of one."""
    parts = ((" ".join(words[:k]), words[k:]) for k in range(1, len(words)))
    return any(
        f"{begin}{first}\n" in lines and (f"\n{' '.join(rest)}" in lines or is_joined(rest, lines, "\n")) for first, rest in parts
    )


@cache
def calls() -> dict[str, list[tuple[str, ast.Call]]]:
    """The calls in the tests that compare messages, by function, each with its file."""
    found: dict[str, list[tuple[str, ast.Call]]] = {"message": [], "raises": [], "warns": []}
    for file in (ROOT / "tests").rglob("*.py"):
        source = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(source)) if "message(" in source or "match=" in source else ():
            name = getattr(node.func, "attr", getattr(node.func, "id", "")) if isinstance(node, ast.Call) else ""
            if name in found and file != Path(__file__):
                found[name].append((f"{file.name}:{node.lineno}", node))
    return found


def literals(node: ast.AST) -> Iterator[str]:
    """The texts of an expression, without those that a call of `message` gets."""
    if isinstance(node, ast.Constant) and re.search("[a-zA-Z]{2}", str(node.value)):
        yield node.value
    if not (isinstance(node, ast.Call) and ast.unparse(node.func) == "message"):
        yield from (text for each in ast.iter_child_nodes(node) for text in literals(each))


def test_tests_compare_messages_by_their_codes() -> None:
    compared = [(place, k) for name in ("raises", "warns") for place, call in calls()[name] for k in call.keywords]
    assert len(compared) > 400
    assert [(place, text) for place, k in compared if k.arg == "match" for text in literals(k.value)] == []


def test_each_code_is_used_and_has_an_expression_that_fits_no_other() -> None:
    """A text with something in each hole stands for the messages of a code."""
    samples = {code: SIGN.sub("x", text) for code, text in TEXTS.items()}
    taken = []
    for place, call in calls()["message"]:
        code = ast.literal_eval(call.args[0])
        given = {
            k.arg: k.value.value if isinstance(k.value, ast.Constant) else "\0"
            for k in call.keywords
            if k.arg not in (None, "at")
        }
        fits = re.compile(message(code, **given)).search
        taken += [(place, code, other) for other, text in samples.items() if other != code and fits(text)]
    assert {ast.literal_eval(call.args[0]) for _, call in calls()["message"]} == set(TEXTS)
    assert taken == []


def test_each_text_of_the_catalogue_is_one_of_the_sources() -> None:
    """Clause by clause, of which some are put together from the strings of a folder."""
    clauses = {each.strip() for code, text in TEXTS.items() if not code.startswith("others.") for each in CLAUSE.split(text)}
    assert len(clauses) > 500
    strange = [each for each in clauses if " " in each and not any(each in lines for lines in said())]
    assert [each for each in strange if not any(is_joined(each.split(" "), lines) for lines in said())] == []


if __name__ == "__main__":
    for each in sorted(RAISED, key=lambda each: each.text):
        print(f"{each.kind}: {each.text}    [{each.place}]")
