"""Studies of stored runs in the current grammar: keys and figures that were renamed are read under their new names."""

from typing import Any

from nsmaps.files.complaints import bare, inside


def renewed(data: Any, model: Any) -> Any:
    """The content of a study's file with current keys, figures and claims, by the names in `was` of each model."""
    if isinstance(data, list):
        return [renewed(item, inside(model, 0)) for item in data]
    if not isinstance(data, dict) or "class" in data:  # whose keys are fields of a user-defined class
        return data
    was = getattr(bare(model), "was", {})
    named = {was.get(key, key): value for key, value in data.items()}
    for key in ("figures", "require"):
        if isinstance(named.get(key), list):
            named[key] = [was.get(word, word) if isinstance(word, str) else word for word in named[key]]
    return {key: renewed(value, inside(model, str(key))) for key, value in named.items()}
