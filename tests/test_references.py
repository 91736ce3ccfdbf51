"""The literature: every entry is on the page, every key of the page is an entry, and every module named is there."""

import re
from importlib.util import find_spec
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
ENTRIES = dict(
    re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", (DOCS / "references.bib").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
)
PAGE = (DOCS / "reference" / "literature.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `(\w+)` \| (.*) \| (.*) \|$", PAGE, re.MULTILINE)


def test_the_page_and_the_file_list_the_same_works():
    assert len(ENTRIES) > 30
    assert sorted(key for key, _, _ in ROWS) == sorted(ENTRIES)


@pytest.mark.parametrize("key", ENTRIES)
def test_an_entry_is_complete(key):
    fields = dict(re.findall(r"^  (\w+) = \{(.*)\},$", ENTRIES[key], re.MULTILINE))
    assert {"author", "title"} <= set(fields)
    assert re.fullmatch(r"\d{4}", fields.get("year", "")) or "howpublished" in fields
    assert {"journal", "publisher", "school", "howpublished"} & set(fields)
    assert all(text.count("{") == text.count("}") for text in fields.values())


@pytest.mark.parametrize(("key", "work", "where"), ROWS, ids=[key for key, _, _ in ROWS])
def test_a_row_names_the_author_of_its_entry_and_modules_that_are_there(key, work, where):
    author = re.search(r"author = \{([^,]*),", ENTRIES[key])[1]
    plain = author.replace(r"M{\"u}ller", "Müller")
    assert work.startswith(plain)
    for module in re.findall(r"`([a-z]+(?:\.[a-z_]+)*)`", where):
        assert find_spec(f"nsmaps.{module}"), f"{key}: there is no nsmaps.{module}"
