"""The JSON Schema of studies, with the analyses that other packages have installed."""

import json

from nsmaps.plugins import ANALYSIS, class_names, class_of


def with_installed(text: str) -> str:
    """The schema that nsmaps ships, with a property for each installed analysis of another package."""
    names = class_names(ANALYSIS)
    if not names:
        return text
    schema = json.loads(text)
    for name in names:
        own = class_of(ANALYSIS, name).model_json_schema(by_alias=True)
        schema["$defs"] |= own.pop("$defs", {})
        schema["properties"][name] = own
    return json.dumps(schema, indent=1, ensure_ascii=False) + "\n"
