"""Studies of stored runs as today's: a key that has another name now is read under that."""

from typing import Any

from nsmaps.complaints import bare, inside


def renewed(data: Any, model: Any) -> Any:
    """What a study's file says, each key of a model under the name that its `was` gives it."""
    if isinstance(data, list):
        return [renewed(item, inside(model, 0)) for item in data]
    if not isinstance(data, dict):
        return data
    was = getattr(bare(model), "was", {})
    named = {was.get(key, key): value for key, value in data.items()}
    return {key: renewed(value, inside(model, str(key))) for key, value in named.items()}
