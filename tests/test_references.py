"""The literature: every entry is complete and names modules that are there."""

import re
from importlib.util import find_spec
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
ENTRIES = dict(
    re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", (DOCS / "references.bib").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
)


def test_there_are_entries():
    assert len(ENTRIES) > 30


@pytest.mark.parametrize("key", ENTRIES)
def test_an_entry_is_complete_and_names_modules_that_are_there(key):
    fields = dict(re.findall(r"^  (\w+) = \{(.*)\},$", ENTRIES[key], re.MULTILINE))
    assert {"author", "title", "keywords", "annote"} <= set(fields)
    assert re.fullmatch(r"\d{4}", fields.get("year", "")) or "howpublished" in fields
    assert {"journal", "publisher", "school", "howpublished"} & set(fields)
    assert all(text.count("{") == text.count("}") for text in fields.values())
    for module in re.findall(r"`([a-z]+(?:\.[a-z_]+)*)`", fields["annote"]):
        assert find_spec(f"nsmaps.{module}"), f"{key}: there is no nsmaps.{module}"
