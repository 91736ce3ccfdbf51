"""A map or closed form as a JSON document, which `nsmaps.load_map` reads back."""

import json
from collections.abc import Sequence

from nsmaps.exports.document import document
from nsmaps.exports.headers import described
from nsmaps.exports.program import Exportable


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The document, by file name."""
    provenance = {"about": [*about, *described(result)]}
    return {f"{name}.json": json.dumps(document(result) | provenance, indent=1, allow_nan=False) + "\n"}
