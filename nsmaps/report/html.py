"""HTML as a tree, so that every text is escaped and every element closed; plain data as tables."""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from typing import Any
from xml.etree.ElementTree import Element

EXACT = 1e15  #: below which a float that is whole is written so
ONE = 5e-4  #: distance from 1 below which a number is written as that distance
LONGEST = 300  #: letters of a text that are shown
LONG = 40  #: letters from which the text of a cell is broken into lines
WIDEST = 9  #: most columns of a table made of rows with parts
SEVERAL = 4  #: entries of a list that are shown; of a longer one, such as the boxes of all updates, its length and its range
GREEK = {  #: letters by the names of quantities, such as phi and Gamma
    (name if letter.islower() else name.capitalize()): letter
    for letter in "αβγδεζηθικλμνξοπρστυφχψωΓΔΘΛΞΠΣΥΦΨΩ"
    for name in [unicodedata.name(letter).split()[-1].lower().replace("lamda", "lambda")]
}
VERBATIM = ("pre", "style", "title")  #: elements whose text stays as it is


def tag(name: str, /, *children: "Element | str", **attributes: str) -> Element:
    """An element; `class_` is written class, `data_label` data-label."""
    element = Element(name, {key.rstrip("_").replace("_", "-"): value for key, value in attributes.items()})
    for child in children:
        if isinstance(child, Element):
            element.append(child)
        elif len(element):
            element[-1].tail = (element[-1].tail or "") + child
        else:
            element.text = (element.text or "") + child
    return element


def table(head: Sequence[str], rows: Sequence[Sequence["Element | str"]], **attributes: str) -> Element:
    """A table with a head, whose first column names the rows, in a box of its own that scrolls where the page is narrow."""
    body = []
    for first, *others in rows:
        cells = [tag("td", cell, data_label=label) for label, cell in zip(head[1:], others, strict=True)]
        for cell in cells:
            if len(cell.text or "") > LONG:
                cell.set("class", "long")
        body.append(tag("tr", tag("th", first, scope="row"), *cells))
    top = tag("thead", tag("tr", *(tag("th", label, scope="col") for label in head)))
    return tag("div", tag("table", top, tag("tbody", *body), **attributes), class_="scroll", tabindex="0")


def typeset(element: Element, names: Iterable[str]) -> None:
    """Write Greek letters for the names of quantities that are called so, and the signs of products and errors, in place."""
    letters = {name: GREEK[name] for name in {*names, "pi"} if name in GREEK}
    word = re.compile(rf"\b({'|'.join(letters)})\b")

    def set_text(text: str | None) -> str | None:
        if text is None:
            return None
        return re.sub(r"(?<=[\d\]]) x (?=\w)", " × ", word.sub(lambda found: letters[found[1]], text)).replace("+-", "±")

    for child in element:
        if child.tag not in VERBATIM:
            child.text = set_text(child.text)
            typeset(child, names)
        child.tail = set_text(child.tail)


def folded(title: str, *children: "Element | str", **attributes: str) -> Element:
    """What a reader opens who wants it; paper shows it open."""
    return tag("details", tag("summary", title), *children, **attributes)


def formatted(value: Any) -> str:
    """A plain value as a reader likes it: four digits, a short list with commas, a long one by its length and range."""
    if value is None or (isinstance(value, list) and not value):  # a NumPy number is compared with [] as an array
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        whole = value.is_integer() and abs(value) < EXACT
        near = not whole and abs(value - 1) < ONE  # as an R2, of which four digits would say that it is 1
        return f"{value:.0f}" if whole else f"1 {'+' if value > 1 else '-'} {abs(value - 1):.2g}" if near else f"{value:.4g}"
    if isinstance(value, list | tuple):
        known = [item for item in value if isinstance(item, int | float)]
        if len(value) > SEVERAL:
            between = f"{formatted(min(known))} to {formatted(max(known))}" if known else f"the last {formatted(value[-1])}"
            return f"{len(value)} values, {between}"
        return ", ".join(f"({formatted(item)})" if isinstance(item, list | tuple) else formatted(item) for item in value)
    text = str(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ... ({len(text)} letters, whole in result.json)"


def tables(data: Any, level: int = 3, name: str = "") -> list[Element]:
    """Nested plain data as tables under headings: what has one set of keys is one table."""
    heading = [tag(f"h{min(level, 6)}", name.replace("_", " "))] if name else []
    if isinstance(data, Mapping) and not data:
        return [*heading, tag("p", "none")]
    single = {key: _rows(value) for key, value in data.items()} if isinstance(data, Mapping) else {}
    if len(single) > 1 and all(len(rows) == 1 for rows in single.values()):  # a table each would be long
        data = {key: rows[0][1] for key, rows in single.items()}
    if rows := _rows(data):
        texts = [key for key in rows[0][1] if any(_sentences(row[key]) for _, row in rows)]
        columns = [key for key in rows[0][1] if key not in texts]
        notes = [tag("p", f"{first}: {'; '.join(row[key])}", class_="soft") for key in texts for first, row in rows if row[key]]
        head = ["", *(str(key).replace("_", " ") for key in columns)]
        return [*heading, table(head, [[first, *(formatted(row[key]) for key in columns)] for first, row in rows]), *notes]
    if isinstance(data, list) and _nested(data):
        data = {str(number): item for number, item in enumerate(data, 1)}
    if not isinstance(data, Mapping):
        return [*heading, tag("p", formatted(data))]
    plain = {key: value for key, value in data.items() if not _nested(value)}
    elements = (
        [table(["", "value"], [[str(key).replace("_", " "), formatted(value)] for key, value in plain.items()])] if plain else []
    )
    for key, value in data.items():
        if key not in plain:
            elements += tables(value, level + 1, str(key))
    return [*heading, *elements]


def _rows(data: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """The rows of one table, named; none where the data are not rows of plain values under the same keys."""
    named = data.items() if isinstance(data, Mapping) else enumerate(data, 1) if isinstance(data, list) else ()
    pairs = [(str(name), row) for name, row in named]
    rows = [(name, _flat(row)) for name, row in pairs if isinstance(row, Mapping)]
    same = len(rows) == len(pairs) and len({tuple(row) for _, row in rows}) == 1
    return rows if same and not any(_nested(value) for _, row in rows for value in row.values()) else []


def _flat(row: Mapping[str, Any]) -> Mapping[str, Any]:
    """A row with the parts of its mappings as values of its own, such as `low kind`, unless there would be too many."""
    parts = {key: value.items() if isinstance(value, Mapping) else [("", value)] for key, value in row.items()}
    flat = {f"{key} {name}".rstrip(): value for key, inner in parts.items() for name, value in inner}
    return flat if len(flat) <= WIDEST else row


def _sentences(value: Any) -> bool:
    """Whether a value is a list of texts too long for a cell, as warnings are: they stand below the table."""
    return isinstance(value, list) and any(isinstance(item, str) and len(item) > LONG for item in value)


def _nested(value: Any) -> bool:
    return isinstance(value, Mapping) or (isinstance(value, list) and bool(value) and isinstance(value[0], Mapping))
