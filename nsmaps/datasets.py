"""Results as xarray datasets: every array with named dimensions, a unit and a sentence."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from nsmaps.coordinates import Coordinates, is_angle
from nsmaps.errors import NsmapsError
from nsmaps.results import Result

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

Row = tuple[str, Any, str, str]  #: dimensions with blanks between them, the array, its unit, what it holds
EACH, NONE, TURNS, TIME = "see unit", "1", "turns", "time unit of the system"
AXES: Mapping[str, Mapping[str, str]] = {  #: what the axes of arrays are, by class and field; those of others are numbered
    "BifurcationCurve": {"parameters": "orbit parameter", "points": "orbit point coordinate", "multipliers": "orbit multiplier"},
    "OrbitPair": {"start": "coordinate"},
}


@runtime_checkable
class HasDataset(Protocol):
    """A result that can be had as a dataset."""

    def to_xarray(self) -> "Dataset": ...


def dataset(
    coordinates: Sequence[str], rows: Mapping[str, Row], along: Mapping[str, Any] | None = None, **about: Any
) -> "Dataset":
    """Arrays of one result as a dataset, which netCDF and zarr can hold.

    Arrays along `coordinate` have a unit for each, in the coordinate `unit`: rad of an angle, 1 of what is dimensionless.

    Args:
        rows: by name. A dimension `coordinate` is the system's coordinates.
        along: labels of other dimensions, by dimension.
        about: what else is to be known, as texts and numbers.

    Raises:
        NsmapsError: xarray is not installed.
    """
    try:
        from xarray import Dataset
    except ImportError as error:
        raise NsmapsError("xarray is not installed; expected: pip install 'nsmaps[data]'") from error
    units = ["rad" if is_angle(name) else "1" for name in coordinates]
    arrays = {
        name: (dims.split(), array, ({"units": unit} if unit else {}) | {"long_name": text})
        for name, (dims, array, unit, text) in rows.items()
    }
    labels = {dim: (dim, list(values)) for dim, values in (along or {}).items()}
    given = {"coordinate": ("coordinate", [str(name) for name in coordinates]), "unit": ("coordinate", units)}
    return Dataset(arrays, coords={**given, **labels}, attrs={name: _plain(value) for name, value in about.items()})


def datasets(part: Any, path: str, coordinates: Sequence[str]) -> "Iterator[tuple[str, Dataset]]":
    """The datasets of a result and of the results within it, by path; a slash in a name is written as a bar.

    A result that has a dataset of its own is followed by those members alone that have none. Numbers and texts become attributes.
    """
    if isinstance(part, Mapping):
        for name, item in part.items():
            yield from datasets(item, f"{path}/{str(name).replace('/', '|')}", coordinates)
    elif isinstance(part, tuple | list) and not _names(part):
        for number, item in enumerate(part):
            yield from datasets(item, f"{path}/{number}", coordinates)
    elif own := isinstance(part, HasDataset):
        yield path, part.to_xarray()
    elif any(_arrays(name, getattr(part, name)) for name in _names(part)):
        yield path, _dataset_of(part, coordinates)
    else:
        own = False
    for name in _names(part):
        member = getattr(part, name)
        if not isinstance(member, Coordinates) and (isinstance(part, Result) or not (own and isinstance(member, HasDataset))):
            yield from datasets(member, f"{path}/{name}", coordinates)


def _names(part: Any) -> tuple[str, ...]:
    """The fields of a dataclass or of a named tuple; empty of anything else."""
    if is_dataclass(part) and not isinstance(part, type):
        return tuple(each.name for each in fields(part))
    return tuple(type(part).__annotations__) if isinstance(part, tuple) and type(part) is not tuple else ()


def _arrays(field: str, value: Any) -> dict[str, Any]:
    """The arrays that a field is, or is a tuple of, by name."""
    if isinstance(value, np.ndarray):
        return {field: value}
    several = type(value) is tuple and all(isinstance(item, np.ndarray) for item in value)
    return {f"{field}_{number}": item for number, item in enumerate(value)} if several else {}


def _dataset_of(part: Any, coordinates: Sequence[str]) -> "Dataset":
    """The arrays that are fields of a result, their axes as in AXES; complex numbers have an axis more, `part`."""
    kind, rows, about = type(part).__name__, dict[str, Row](), dict[str, Any]()
    for field in _names(part):
        value = getattr(part, field)
        for name, array in _arrays(field, value).items():
            dims = AXES.get(kind, {}).get(name, " ".join(f"{kind}_{name}_{axis}" for axis in range(array.ndim)))
            if np.iscomplexobj(array):
                array, dims = np.stack([array.real, array.imag], axis=-1), f"{dims} part"
            rows[name] = dims, array, "", f"{field} of {kind}"
        if isinstance(value, bool | int | float | str):
            about[field] = _plain(value)
    return dataset(coordinates, rows).assign_attrs(about)


def tree(parts: Mapping[str, Any], coordinates: Sequence[str], **about: Any) -> "DataTree":
    """The datasets of several results by path, with what else is to be known at the root. Errors as `dataset`."""
    root = dataset((), {}, **about).drop_dims("coordinate")
    from xarray import DataTree

    found = dict(each for path, part in parts.items() for each in datasets(part, path, coordinates))
    return DataTree.from_dict({"/": root, **found})


def _plain(value: Any) -> Any:
    """What netCDF takes for an attribute: a switch as 0 or 1, a name as text, names as one text."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str):  # a name of an angle too
        return str(value)
    return " ".join(map(str, value)) if isinstance(value, tuple) else value
