"""Writes nsmaps/study/schema.json: the grammar of studies from its models.

To be run after these were changed: python tests/make_schema.py
"""

import json
from pathlib import Path
from typing import Any

from nsmaps.study.schema import key_tables
from nsmaps.study.study import Study

SCHEMA = Path(__file__).parents[1] / "nsmaps" / "study" / "schema.json"


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
    for table in key_tables(Study).values():
        model = definitions[table.model.__name__] if table.of else made
        for key in table.keys:
            model["properties"][key.name]["description"] = str(key)
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


def text() -> str:
    """The file's text."""
    return json.dumps(schema(), indent=1, ensure_ascii=False).replace('"gt":', '"exclusiveMinimum":') + "\n"


if __name__ == "__main__":
    SCHEMA.write_text(text(), encoding="utf-8")
