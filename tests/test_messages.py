"""The catalogue of error messages, read from the sources: each says what is wrong, and what is expected or the way out.

Tests of a function compare the beginning of a message, which says which error it is; what follows is compared here, for all.
`python tests/test_messages.py` prints the catalogue.
"""

import ast
import re
from pathlib import Path
from typing import NamedTuple

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


CATALOGUE = [message for file in FILES for message in messages(file)]


def test_the_catalogue_is_read() -> None:
    assert len(CATALOGUE) > 500
    assert {message.kind for message in CATALOGUE} >= KINDS - {"StudyError", "ConditionError"}


def test_each_message_is_written_once() -> None:
    written = [message.text for message in CATALOGUE if not message.text.startswith("{")]
    assert {text for text in written if written.count(text) > 1} == set()


def test_each_message_says_what_is_expected_or_the_way_out() -> None:
    silent = [message for message in CATALOGUE if message.kind not in FINDINGS and not WAY_OUT.search(message.text)]
    assert silent == []


def test_a_message_begins_small_and_is_no_sentence() -> None:
    """It stands after a place in a file, or before another reason."""
    found = [message for message in CATALOGUE if message.text[0].isupper() or message.text.endswith(".")]
    assert {message.text.split()[0] for message in found} <= {"Conley", "names"}


if __name__ == "__main__":
    for message in sorted(CATALOGUE, key=lambda message: message.text):
        print(f"{message.kind}: {message.text}    [{message.place}]")
