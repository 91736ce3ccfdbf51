"""Writes nsmaps/study/schema.json: the grammar of studies from its models, what each key means from the study reference.

To be run after either was changed: python tests/make_schema.py
"""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nsmaps.study.study import Study

ROOT = Path(__file__).parents[1]
SCHEMA = ROOT / "nsmaps" / "study" / "schema.json"
REFERENCE = ROOT / "docs" / "reference" / "study.md"
ROW = re.compile(r"^\| (?P<keys>[^|]+) \| (?P<type>[^|]+) \| (?P<default>[^|]+) \| (?P<meaning>[^|]*)\|$", re.MULTILINE)
VALUES = {
    "parameter": "a parameter of the system",
    "from": "the first value",
    "to": "the last value",
    "points": "how many values, equally spaced, both ends included",
}


def schema() -> dict[str, Any]:
    """The JSON Schema of a study's file."""
    made = Study.model_json_schema(by_alias=True)
    definitions = made["$defs"]
    for part in (made, *definitions.values()):
        part["description"] = part["description"].split("\n\n")[0].replace("\n", " ")
        for properties in part.get("properties", {}).values():
            properties.pop("title", None)
            _unnulled(properties)
    definitions["PieceSection"]["properties"]["polynomial"] = {"anyOf": [{"$ref": "#/$defs/TabulatedMap"}, {"type": "string"}]}
    for name in ("Span", "Side", "Sweep"):
        for key, properties in definitions[name]["properties"].items():
            properties["description"] = VALUES[key]
    for section, key, meaning in meanings(REFERENCE.read_text(encoding="utf-8")):
        model = _model(made, section)
        if key in model["properties"]:
            model["properties"][key]["description"] = meaning
    definitions["Side"] = {"anyOf": [{"type": "number"}, {"type": "string"}, definitions["Side"]]}
    made["additionalProperties"] = {
        "type": "object",
        "required": ["analysis"],
        "description": "A further section of a kind, or an analysis of a file or module.",
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "A study of nsmaps"}
    return head | {key: value for key, value in made.items() if key != "title"}


def _unnulled(properties: dict[str, Any]) -> None:
    """Take out that a key may stand without a value: nobody means it, and an editor tells of the wrong place."""
    kinds = [kind for kind in properties.get("anyOf", ()) if kind != {"type": "null"}]
    if len(kinds) == 1:
        del properties["anyOf"]
        properties.pop("default", None)
        properties.update(kinds[0])


def meanings(reference: str) -> Iterator[tuple[str, str, str]]:
    """Section, key and meaning of every row of the reference's tables of keys; the section of the first is empty."""
    for heading, text in re.findall(r"^##+ (Keys|In [^\n]*)\n(.*?)(?=^##)", reference, re.MULTILINE | re.DOTALL):
        section = "" if heading == "Keys" else heading.split()[-1].strip("`")
        for row in ROW.finditer(text):
            meaning = f"{row['meaning'].strip()} ({row['type'].strip()}; default: {row['default'].strip()})"
            for key in re.findall(r"`(\w+)`", row["keys"]):
                yield section, key, re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", meaning).replace("; default: required", "; required")


def _model(made: dict[str, Any], section: str) -> dict[str, Any]:
    """The part of the schema for a section: what a property of that name refers to."""
    if not section:
        return made
    holders = [made, *made["$defs"].values()]
    holders = [each["properties"][section] for each in holders if section in each.get("properties", {})]
    refers = [{*re.findall(r"#/\$defs/(\w+)", json.dumps(each))} - {"Instance"} for each in holders]
    (name,) = next(names for names in refers if names)
    model = made["$defs"][name]
    entries = {*re.findall(r"#/\$defs/(\w+)", json.dumps(model.get("items", {})))} - {"Instance"}
    return made["$defs"][entries.pop()] if entries else model


def text() -> str:
    """The file's text."""
    return json.dumps(schema(), indent=1, ensure_ascii=False).replace('"gt":', '"exclusiveMinimum":') + "\n"


if __name__ == "__main__":
    SCHEMA.write_text(text(), encoding="utf-8")
