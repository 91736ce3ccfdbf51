"""Results as plain data and back: dataclasses, named tuples and specs of nsmaps as JSON, their arrays under readable names.

Only classes of nsmaps and of the modules of a study's own analyses are instantiated, and no text of a file is evaluated.
"""

import math
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from nsmaps.arrays import Storable
from nsmaps.coordinates import Angle, Coordinates, is_angle
from nsmaps.errors import NsmapsError
from nsmaps.reduced.conditions.region import Region, as_condition
from nsmaps.study.reading.head import Head

KIND = "$"  #: the key of the kind of a value that is not plain JSON
Arrays = dict[str, NDArray[Any]]
OURS: Mapping[str, str] = {"nsmaps": "nsmaps"}
OF_FILE = re.compile(r"_[0-9a-f]{12}$")  #: what follows the name of a file in that of its module, see `nsmaps.plugins`


def encode(value: Any, path: str, arrays: Arrays) -> Any:
    """The value as JSON; its arrays are added to `arrays` under their path, such as `domains/fitted/boxes`."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int) or type(value) is str:
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {KIND: "float", "value": str(value)}
    if is_angle(value):
        return {KIND: "angle", "value": str(value)}
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return {KIND: "array", "value": path}
    if isinstance(value, list | tuple) and not is_ours(type(value)):
        items = [encode(item, f"{path}/{_label(item, number)}", arrays) for number, item in enumerate(value)]
        return items if isinstance(value, list) else {KIND: "tuple", "value": items}
    if isinstance(value, Mapping):
        pairs = [[encode(k, "", arrays), encode(v, f"{path}/{k}", arrays)] for k, v in value.items()]
        return {KIND: "dict", "value": pairs}
    if isinstance(value, Region) and type(value).__module__.partition(".")[0] not in OURS:
        value = as_condition(value)  # of a class that files do not name the condition is stored
    return {KIND: _stored_name(value)} | {k: encode(v, f"{path}/{k}", arrays) for k, v in _members(value).items()}


def decode(data: Any, arrays: Mapping[str, NDArray[Any]], trusted: Mapping[str, str] = OURS) -> Any:
    """The value that `encode` turned into `data`; `trusted` are the modules and packages of which it may have classes."""
    if isinstance(data, list):
        return [decode(item, arrays, trusted) for item in data]
    if not isinstance(data, dict):
        return data
    kind = data[KIND]
    if kind == "float":
        return float(data["value"])
    if kind == "angle":
        return Angle(data["value"])
    if kind == "array":
        return arrays[data["value"]]
    if kind == "tuple":
        return tuple(decode(item, arrays, trusted) for item in data["value"])
    if kind == "dict":
        return {decode(key, arrays): decode(value, arrays, trusted) for key, value in data["value"]}
    cls = stored_class(kind, trusted)
    return cls(**{key: decode(value, arrays, trusted) for key, value in data.items() if key != KIND})


def _label(item: Any, number: int) -> str:
    """The name of an item, or its number if it has none."""
    name = _members(item).get("name") if is_dataclass(item) else None
    return name if isinstance(name, str) else str(number)


def _members(value: Any) -> dict[str, Any]:
    if isinstance(value, Coordinates):
        return {name: list(texts) for name, texts in value.plain.items()}
    if isinstance(value, BaseModel):
        return {name: each for name, each in value if name not in getattr(value, "unstored", ())}
    if isinstance(value, tuple):  # a named tuple
        return dict(zip(type(value).__annotations__, value, strict=True))
    return {field.name: getattr(value, field.name) for field in fields(value)}


def _stored_name(value: Any) -> str:
    cls = type(value)
    if isinstance(value, Storable) or _is_named_tuple(cls):
        return f"{OF_FILE.sub('', cls.__module__)}:{cls.__qualname__}"
    raise NsmapsError(f"{cls.__module__}.{cls.__name__} cannot be stored in a file; expected: results and specs of nsmaps")


def stored_class(stored: str, trusted: Mapping[str, str] = OURS) -> Any:
    """The class of a stored name: its module, a colon and its own; only what is `Storable` and named tuples are instantiated."""
    module, _, name = stored.rpartition(":")
    if module in trusted or module.partition(".")[0] in trusted:
        cls = None
        with suppress(ModuleNotFoundError):  # of an earlier version
            cls = getattr(import_module(trusted.get(module, module)), name, None)
        if isinstance(cls, type) and (_is_named_tuple(cls) or (issubclass(cls, Storable) and cls.from_files)):
            return cls
    raise NsmapsError(f"a result's file names the class {stored!r}; expected: results and specs of nsmaps")


def modules_of(study: Head) -> dict[str, str]:
    """The packages and modules of whose classes a result of the study may be: nsmaps, and those of its analyses.

    The module of a file is known by the name of the file.
    """
    modules = [kind.__module__ for kind in study.others().values()]
    return (
        dict(OURS)
        | {OF_FILE.sub("", name): name for name in modules}
        | {name.partition(".")[0]: name.partition(".")[0] for name in modules if "." in name}
    )


def is_ours(cls: type) -> bool:
    """Whether a class is a dataclass, a pydantic model or a named tuple of nsmaps."""
    return is_dataclass(cls) or issubclass(cls, BaseModel) or _is_named_tuple(cls)


def _is_named_tuple(cls: type) -> bool:
    return issubclass(cls, tuple) and cls.__module__.startswith("nsmaps.") and hasattr(cls, "_fields")
