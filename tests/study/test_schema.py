"""The JSON Schema of studies: what editors check and complete by."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from make_schema import SCHEMA, text
from messages import message
from ruamel.yaml import YAML

from nsmaps.errors import NsmapsError, StudyError
from nsmaps.study.reading.reader import load_study
from nsmaps.study.schema import table_of
from nsmaps.study.store.archive import resolved

ROOT = Path(__file__).parents[2]
STUDIES = sorted(ROOT.glob("plugins/*/studies/*.yaml"))
MODELINE = re.compile(r"# yaml-language-server: \$schema=(\S+)\n")


@cache
def validator() -> Any:
    """What finds errors by the schema."""
    return pytest.importorskip("jsonschema").Draft202012Validator(json.loads(SCHEMA.read_text()))


def complaints(study: str) -> list[str]:
    """Where a text is no study, by the schema alone."""
    return sorted({error.json_path for error in validator().iter_errors(YAML(typ="safe").load(study))})


def test_the_file_is_that_of_the_grammar() -> None:
    assert SCHEMA.read_text(encoding="utf-8") == text(), "run python tests/make_schema.py"
    pytest.importorskip("jsonschema").Draft202012Validator.check_schema(json.loads(text()))


def test_every_key_says_what_it_means() -> None:
    made = json.loads(SCHEMA.read_text())
    parts: dict[str, dict[str, Any]] = {"": made, **made["$defs"]}
    rows = {f"{name}.{key}": row for name, part in parts.items() for key, row in part.get("properties", {}).items()}
    assert [key for key, row in rows.items() if "description" not in row] == []
    assert made["properties"]["system"]["description"].startswith("an installed system, or `path/to/mine.py:Class`")
    assert made["$defs"]["DomainSection"]["properties"]["max_updates"]["description"] == (
        "largest number of updates N (whole number >= 1; default: 11)"
    )


def test_a_key_has_one_meaning_in_the_schema_the_command_line_and_errors(tmp_path: Path) -> None:
    made = json.loads(SCHEMA.read_text())
    of_slices = {key.name: str(key) for key in table_of("slices").keys}
    assert of_slices == {key: row["description"] for key, row in made["$defs"]["SliceSection"]["properties"].items()}
    assert str(table_of("slices")).endswith(f"\n  axis: {of_slices['axis']}")
    assert [line[0] for line in str(table_of("partition")).splitlines() if line and line[0] != " "] == ["p", "I"]  # paragraphs
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="section", name="basin", near="basins")):
        table_of("basin")
    (tmp_path / "line.yaml").write_text("system: vi_pair\nslices: [{axis: {v: {from: 0, to: 1, points: 3}}}]\n")
    with pytest.raises(StudyError, match=message("study.key-missing", name="at", meaning=of_slices["at"].partition(" (")[0])):
        load_study(tmp_path / "line.yaml")


@pytest.mark.parametrize("file", STUDIES, ids=lambda file: file.stem)
def test_shipped_studies_are_valid_and_name_the_schema(file: Path) -> None:
    source = file.read_text()
    assert complaints(source) == []
    named = MODELINE.match(source)
    assert named, "the first line is the modeline of editors"
    assert (file.parent / named[1]).resolve() == SCHEMA
    assert complaints(resolved(load_study(file))) == [], "a run's study.yaml is valid too"


@pytest.mark.parametrize(
    ("bad", "where"),
    [
        ("orbit: []", "$.orbit"),
        ("grid: {v: {from: 0, to: 1}}", "$.grid.v"),
        ("orbits: [{start: {v: 1}, n_returns: many}]", "$.orbits[0].n_returns"),
        ("figures: [word]", "$.figures[0]"),
        ("morse_sets: {box: {v: [0, 1, 2]}}", "$.morse_sets.box.v"),
        ("require: [covering]", "$.require[0]"),
    ],
)
def test_what_is_wrong_is_seen_where_it_is(bad: str, where: str) -> None:
    assert complaints("system: vi_pair\n") == []
    assert complaints(f"system: vi_pair\n{bad}\n") == [where]
    assert complaints(bad)[0] == "$", "no system"
