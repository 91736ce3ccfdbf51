"""Results as xarray datasets: every array with named dimensions, a unit and a sentence."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from nsmaps.errors import NsmapsError
from nsmaps.exact.impacts import Outcome, angle_mask

if TYPE_CHECKING:
    from xarray import Dataset, DataTree

Row = tuple[str, Any, str, str]  #: dimensions with blanks between them, the array, its unit, what it holds
EACH, NONE, TURNS, TIME = "see unit", "1", "turns", "time unit of the system"
OUTCOMES = f"{'; '.join(f'{outcome.value} {outcome.name}' for outcome in Outcome)}"


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
        raise NsmapsError("xarray is not installed; accepted: pip install 'nsmaps[data]'") from error
    units = ["rad" if angle else "1" for angle in angle_mask(coordinates)]
    arrays = {name: (dims.split(), array, {"units": unit, "long_name": text}) for name, (dims, array, unit, text) in rows.items()}
    labels = {dim: (dim, list(values)) for dim, values in (along or {}).items()}
    given = {"coordinate": ("coordinate", [str(name) for name in coordinates]), "unit": ("coordinate", units)}
    return Dataset(arrays, coords={**given, **labels}, attrs={name: _plain(value) for name, value in about.items()})


def tree(parts: "Mapping[str, HasDataset]", **about: Any) -> "DataTree":
    """The datasets of several results by path, with what else is to be known at the root. Errors as `dataset`."""
    made = {path: part.to_xarray() for path, part in parts.items()}
    root = dataset((), {}, **about).drop_dims("coordinate")
    from xarray import DataTree

    return DataTree.from_dict({"/": root, **made})


def _plain(value: Any) -> Any:
    """What netCDF takes for an attribute: a switch as 0 or 1, names as one text."""
    if isinstance(value, bool):
        return int(value)
    return " ".join(map(str, value)) if isinstance(value, tuple) else value
