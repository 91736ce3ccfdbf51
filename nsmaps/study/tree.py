"""Results as plain data and back: dataclasses, named tuples and specs of nsmaps as JSON, their arrays apart under readable names.

Only classes of nsmaps are ever made from a file, and a file's text is never evaluated.
"""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Angle

KIND = "$"  #: the key that marks what is not plain JSON
ROOMS = ("exact", "dynamics", "reduced", "auxiliary", "study")  #: whose classes a file may name
SYMBOLIC = {f"nsmaps.auxiliary.{name}" for name in ("compose", "formula", "iterate")}  #: whose fields are sympy's, made anew
Arrays = dict[str, NDArray[Any]]


def encode(value: Any, path: str, arrays: Arrays) -> Any:
    """The value as JSON; its arrays are put into `arrays` under their path in it, such as `domains/fitted/boxes`."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int) or type(value) is str:
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else {KIND: "float", "value": str(value)}
    if isinstance(value, Angle):
        return {KIND: "angle", "value": str(value)}
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return {KIND: "array", "value": path}
    if isinstance(value, list | tuple) and not _is_ours(type(value)):
        items = [encode(item, f"{path}/{_label(item, number)}", arrays) for number, item in enumerate(value)]
        return items if isinstance(value, list) else {KIND: "tuple", "value": items}
    if isinstance(value, Mapping):
        pairs = [[encode(k, "", arrays), encode(v, f"{path}/{k}", arrays)] for k, v in value.items()]
        return {KIND: "dict", "value": pairs}
    return {KIND: _class_path(value)} | {k: encode(v, f"{path}/{k}", arrays) for k, v in _members(value).items()}


def decode(data: Any, arrays: Mapping[str, NDArray[Any]]) -> Any:
    """The value of an encoded one."""
    if isinstance(data, list):
        return [decode(item, arrays) for item in data]
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
        return tuple(decode(item, arrays) for item in data["value"])
    if kind == "dict":
        return {decode(key, arrays): decode(value, arrays) for key, value in data["value"]}
    return _class(kind)(**{key: decode(value, arrays) for key, value in data.items() if key != KIND})


def _label(item: Any, number: int) -> str:
    """An item's own name, where it has one, else its number."""
    name = _members(item).get("name") if is_dataclass(item) else None
    return name if isinstance(name, str) else str(number)


def _members(value: Any) -> dict[str, Any]:
    if isinstance(value, BaseModel):
        return dict(value)
    if isinstance(value, tuple):  # a named one
        return dict(zip(type(value).__annotations__, value, strict=True))
    return {field.name: getattr(value, field.name) for field in fields(value)}


def _class_path(value: Any) -> str:
    cls = type(value)
    if not (_is_ours(cls) and cls.__module__.startswith("nsmaps.")):
        name = f"{cls.__module__}.{cls.__name__}"
        raise NsmapsError(f"{name} cannot be kept in a file; accepted: results and specs of nsmaps")
    return f"{cls.__module__}:{cls.__qualname__}"


def _class(path: str) -> Any:
    module, _, name = path.partition(":")
    room = module.removeprefix("nsmaps.").partition(".")[0]
    accepted = module.startswith("nsmaps.") and room in ROOMS and module not in SYMBOLIC
    found = getattr(import_module(module), name, None) if accepted else None
    if not (isinstance(found, type) and _is_ours(found) and found.__module__ == module):
        raise NsmapsError(f"a result's file names the class {path!r}; accepted: results and specs of nsmaps")
    return found


def _is_ours(cls: type) -> bool:
    return is_dataclass(cls) or issubclass(cls, BaseModel) or (issubclass(cls, tuple) and cls.__module__.startswith("nsmaps."))
