"""Prose, messages and names use the terms of the field: a table of private words, and where each of them still stands."""

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted((ROOT / "nsmaps").rglob("*.py"))
WRITTEN = (page for page in sorted(ROOT.glob("docs/**/*.md")) if page.parent.name[0] != "_")  #: by hand, not for the site
PAGES = [ROOT / "README.md", *WRITTEN, *sorted(ROOT.glob("plugins/*/README.md"))]
STUDIES = sorted(ROOT.glob("plugins/**/*.yaml"))
SYSTEMS = sorted(ROOT.glob("plugins/**/*.py"))

#: phrase, as a regular expression that ignores case -> what to write in its place
PHRASES = {
    r"\b(told|tells?|telling)\b": "report, state, show or distinguish",
    r"\bastray\b": "leaves the domain of the map",
    r"\bkeeps? returning\b": "completes all returns",
    r"\bsettle[sd]?\b": "converged",
    r"\btrapped\b": "forward invariant",
    r"\baccepted:|\b(is|are) accepted\b": "expected: ...",
    r"\bswarms?\b": "Taylor set, or set of states",
    r"\blegs?\b": "itinerary",
    r"\btrails?\b": "branch",
    r"\bnobody\b": "no one, or a sentence that needs no person",
    r"\bat hand\b": "available",
    r"\bone's own\b": "user-defined",
    r"(?<!there )(?<!is there )\b(is|are|was|were) no (?!longer|more|less|other|later|earlier)": "is not a ...",
    r"(?<!there )\b(is|are) none\b": "is not one, or there is none",
    r"\b(is|are|was|were|be) said\b": "is stated, or is reported",
    r"\b(go|goes|going|gone|went) on\b": "continue or resume",
    r"\bborne\b": "determined by the data",
    r"\bfor ever\b": "for all times, permanently or indefinitely",
    r"\b(as it stands|as they stand)\b": "unchanged",
    r"\ba line each\b|\bin a line\b": "on one line",
    r"\b(raced|races|contestants?)\b": "benchmark, solver",
    r"\bstrangers?\b": "third party",
    r"\bmend(s|ed|ing)?\b": "correct",
    r"\bnothing of it\b": "a sentence with its subject",
    r"\b(rigorous(ly)?|guarantee[sd]?)\b": "proved, enclosed, estimated or sampled: see docs/explanation/numerics.md",
}
ANY = re.compile("|".join(f"(?:{phrase})" for phrase in PHRASES), re.IGNORECASE)

#: what stands beside the word "proved"
CERTIFIED = re.compile(r"proof\.md|not[- ]proved|`proof`|proof:|nsmaps prove|verify|kinds-of-bounds")

#: name of a function, class, argument, field or variable -> what names it better
NAMES = {
    "made": "what it is: result, states, table, ...",
    "told": "report, error, message, lines or progress",
    "tell": "report",
    "swarm": "states, or taylor_set",
    "legs": "itinerary",
    "trail": "branch",
    "ending": "attractor",
    "most": "max_points, max_length, ...",
    "longest": "max_period",
    "apart": "min_distance",
    "keep": "checkpoint",
    "within": "bounds or region",
    "hold": "min_returns",
    "toward": "direction",
    "rest": "remainder, others or remaining",
}


@dataclass(frozen=True)
class Place:
    """A piece of text of a file, and the line on which it begins."""

    file: Path
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file.relative_to(ROOT)}:{self.line}"


def blank(match: re.Match[str]) -> str:
    """As many line ends as a match has, so that lines keep their numbers."""
    return "\n" * match[0].count("\n") or " "


def prose(page: str) -> str:
    """A page without its blocks, inline code, formulas and targets of links."""
    page = re.sub(r"^```.*?^```[ ]*$", blank, page, flags=re.MULTILINE | re.DOTALL)
    page = re.sub(r"\]\([^)\s]*\)", blank, page)
    return re.sub(r"(`+)(?:(?!\1).)+?\1|\$[^$\n]+\$", blank, page, flags=re.DOTALL)


def comments(source: str) -> Iterator[tuple[int, str]]:
    """The comments of a Python file, if what begins with a # may have a private phrase."""
    if not any(ANY.search(prose(line[mark.start() :])) for line in source.splitlines() for mark in re.finditer("#", line)):
        return
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


@lru_cache(1)
def nodes(source: str) -> list[ast.AST]:
    """The nodes of a Python file."""
    return list(ast.walk(ast.parse(source)))


def docstrings(nodes: list[ast.AST]) -> set[int]:
    """The identities of those of a module's nodes that are docstrings."""
    bodies = [node for node in nodes if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)]
    return {id(node.body[0].value) for node in bodies if node.body and isinstance(node.body[0], ast.Expr)}


def labels_removed(text: str) -> str:
    """A docstring without the names of the arguments that it explains."""
    return re.sub(r"^\s*\w+(, \w+)*: ", "", text, flags=re.MULTILINE)


def texts(file: Path) -> Iterator[Place]:
    """The comments, docstrings and messages (literals of more than one word) of a Python file."""
    source = file.read_text(encoding="utf-8")
    found = docstrings(nodes(source))
    for line, text in comments(source):
        yield Place(file, line, prose(text))
    for node in nodes(source):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and (id(node) in found or " " in node.value.strip()):
            yield Place(file, node.lineno, prose(labels_removed(node.value)))


def names(file: Path) -> Iterator[Place]:
    """The names that a Python file defines: functions, classes, arguments, fields and variables."""
    for node in nodes(file.read_text(encoding="utf-8")):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name != "of":  # `of` as the name of a constructor
            yield Place(file, node.lineno, node.name.strip("_"))
        elif isinstance(node, ast.arg):
            yield Place(file, node.lineno, node.arg.strip("_"))
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield Place(file, node.lineno, node.id.strip("_"))


def said_by(study: Path) -> Iterator[Place]:
    """The comments and titles of a study."""
    for number, line in enumerate(study.read_text(encoding="utf-8").splitlines(), 1):
        if match := re.search(r"(?:^|\s)#\s(.*)|\b(?:title|shows|reason):\s*(.*)", line):
            yield Place(study, number, match[1] or match[2])


def phrases(places: Iterator[Place]) -> Iterator[str]:
    """A line for each private phrase in some texts: where it is and what to write."""
    for place in places:
        for phrase, instead in PHRASES.items() if ANY.search(place.text) else ():
            for match in re.finditer(phrase, place.text, re.IGNORECASE):
                line = place.line + place.text.count("\n", 0, match.start())
                yield f"{place.file.relative_to(ROOT)}:{line}: {match[0]!r}; write: {instead}"


def private_names(places: Iterator[Place]) -> Iterator[str]:
    """A line for each private name among some: where it is and what names it better."""
    for place in places:
        if place.text in NAMES:
            yield f"{place}: the name {place.text!r}; better: {NAMES[place.text]}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages_use_the_terms_of_the_field(page: Path) -> None:
    assert list(phrases(iter([Place(page, 1, prose(page.read_text(encoding="utf-8")))]))) == []


@pytest.mark.parametrize("study", STUDIES, ids=lambda study: study.name)
def test_studies_use_the_terms_of_the_field(study: Path) -> None:
    assert list(phrases(said_by(study))) == []


@pytest.mark.parametrize("file", [*MODULES, *SYSTEMS], ids=lambda file: str(file.relative_to(ROOT)))
def test_code_uses_the_terms_of_the_field(file: Path) -> None:
    assert [*phrases(texts(file)), *private_names(names(file))] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_proved_is_what_a_certificate_proves(page: Path) -> None:
    """A paragraph of another page that calls a bound proved refers to certificates, or states what is not proved."""
    if page.name in ("proof.md", "numerics.md", "study.md"):
        return
    said = re.split(r"\n\s*\n|\n(?=[-|#])", page.read_text(encoding="utf-8"))
    assert [part for part in said if re.search(r"\bproved\b", part) and not CERTIFIED.search(part)] == []


def test_private_words_are_found_where_they_are(tmp_path: Path) -> None:
    file = ROOT / "tests" / "sample.py"
    assert prose("a `told` b\n```\ntold\n```\n[x](told.md) told") == "a   b\n\n\n\n[x  told"
    found = list(phrases(iter([Place(file, 3, "first\nis told; there is no other")])))
    assert found == ["tests/sample.py:4: 'told'; write: report, state, show or distinguish"]
    source = tmp_path / "module.py"
    source.write_text(
        '"""Nobody."""\n\n\ndef made(most: int) -> str:\n    """It tells."""\n'
        '    rest = "told"\n    return rest + "is told so"  # settled\n'
    )
    assert [(place.line, place.text) for place in names(source)] == [(4, "made"), (4, "most"), (6, "rest")]
    assert sorted(place.text for place in texts(source)) == ["# settled", "It tells.", "Nobody.", "is told so"]


def arguments_of_no_function(source: str) -> list[tuple[str, str]]:
    """The names in the sections `Args` of docstrings that the signature of their function lacks, each with the function's."""
    found = []
    for node in ast.walk(ast.parse(source)) if "Args:" in source else ():
        text = ast.get_docstring(node) if isinstance(node, ast.FunctionDef) else None
        if not isinstance(node, ast.FunctionDef) or not text or "Args:" not in text:
            continue
        given = ast.walk(node.args)
        names = {each.arg for each in given if isinstance(each, ast.arg)}
        entries = re.findall(r"^    (\w+(?:, \w+)*):", text.split("Args:")[1].split("\n\n")[0], re.MULTILINE)
        found += [(node.name, name) for entry in entries for name in entry.split(", ") if name not in names]
    return found


def test_docstrings_explain_the_arguments_that_a_function_has() -> None:
    source = 'def f(a, b):\n    """Text.\n\n    Args:\n        a, c: one.\n        b: another.\n    """\n'
    assert arguments_of_no_function(source) == [("f", "c")]
    files = sorted((ROOT / "nsmaps").rglob("*.py"))
    assert len(files) > 500
    assert {str(file): wrong for file in files if (wrong := arguments_of_no_function(file.read_text(encoding="utf-8")))} == {}
