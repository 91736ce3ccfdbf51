"""Studies of stored runs in the current grammar: keys and figures that were renamed are read under their new names."""

from typing import Any

from nsmaps.complaints import bare, inside


def renewed(data: Any, model: Any) -> Any:
    """The content of a study's file, each key of a model, and each figure, under the name that the model's `was` gives it."""
    if isinstance(data, list):
        return [renewed(item, inside(model, 0)) for item in data]
    if not isinstance(data, dict):
        return data
    was = getattr(bare(model), "was", {})
    named = {was.get(key, key): value for key, value in data.items()}
    if isinstance(named.get("figures"), list):
        named["figures"] = [was.get(name, name) if isinstance(name, str) else name for name in named["figures"]]
    return {key: renewed(value, inside(model, str(key))) for key, value in named.items()}
