"""Results: dataclasses whose arrays declare their axes once, and which are stored, drawn and turned into datasets by that."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Self, TypeVar, overload

import numpy as np

from nsmaps.arrays import Floats, Storable, brief
from nsmaps.coordinates import is_angle
from nsmaps.errors import NsmapsError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray
    from xarray import Dataset, DataTree

T = TypeVar("T")
COORDINATE = "coordinate"  #: the axis of the coordinates of a state, each with a unit of its own
BY = "by"  #: the axis of the coordinates by which a derivative is taken
NONE, TURNS, TIME, RETURNS = "1", "turns", "time unit of the system", "returns"  #: units that do not depend on names
ARRAY = "array"  #: the key of a declaration in the metadata of a dataclass's field


__all__ = ["Result", "array", "array_property"]


@dataclass(frozen=True, slots=True)
class Declaration:
    """What an array of a result holds."""

    axes: tuple[str, ...]  #: names of the axes, from first to last
    text: str  #: what it holds, in words
    unit: str = ""  #: empty: of the quantities on the axis `coordinate`, or of the parameter that names the array
    name: str = ""  #: the field or property with the name of the parameter whose values label the axis of this array


def array(axes: str, text: str, unit: str = "", *, name: str = "") -> Mapping[str, Declaration]:
    """The metadata of a field that is an array, with blanks between the names of its axes.

    It stands in the class of the result as `states: Floats = field(metadata=array("value coordinate", "last states"))`.

    Args:
        axes: such as `value start coordinate`; `coordinate` stands for the coordinates of the result, and `...` for any number of
            axes, which in a dataset are `axis_0`, `axis_1`, ...
        text: what it holds.
        unit: of its numbers; empty where it follows from a coordinate or a parameter.
        name: the field of the result with the name of a parameter, if this array has its values: in a dataset the axis then has
            the parameter's name, and these values as labels.
    """
    return {ARRAY: Declaration(tuple(axes.split()), text, unit, name)}


class ArrayProperty(Generic[T]):
    """A property of a result that is an array computed from others, declared as by `array`."""

    def __init__(self, compute: Callable[[Any], T], declaration: Declaration) -> None:
        self.compute, self.declaration, self.__doc__ = compute, declaration, compute.__doc__

    @overload
    def __get__(self, result: None, owner: type) -> Self: ...
    @overload
    def __get__(self, result: object, owner: type) -> T: ...
    def __get__(self, result: object | None, owner: type) -> Self | T:
        """The array of a result, or the property of its class."""
        return self if result is None else self.compute(result)


def array_property(axes: str, text: str, unit: str = "", *, name: str = "") -> Callable[[Callable[[Any], T]], ArrayProperty[T]]:
    """The decorator of a method whose array a dataset of the result has, too; arguments as of `array`."""
    return lambda compute: ArrayProperty(compute, Declaration(tuple(axes.split()), text, unit, name))


class Result(Storable):
    """A result of an analysis, a frozen dataclass; its arrays are declared by `array` and `array_property`.

    A class with a picture names the module that draws it: `sheets(result)` gives the sheets of the whole figure, and a function
    with the module's own name draws one panel on an Axes. A field `units` has those of coordinates and parameters, by name.
    """

    __slots__ = ()
    picture: ClassVar[str] = ""  #: such as `nsmaps.figures.parameters.bifurcation_diagram`
    leading: ClassVar[tuple[str, ...]] = ()  #: names of the first of the axes that `...` stands for, such as ("value",)

    def summary(self) -> str:
        """The numbers that matter in a sentence, which is what is printed; empty: its fields are printed."""
        return ""

    def __repr__(self) -> str:
        """The class with its summary, or with its fields."""
        text = self.summary()
        return f"{type(self).__name__}({text})" if text else brief(self)

    def __str__(self) -> str:
        """The summary, or the class with its fields."""
        return self.summary() or brief(self)

    def plot(self, ax: "Axes | None" = None, **options: Any) -> "Axes | Figure":
        """The picture of the result: the whole figure, or one panel drawn on `ax`.

        Nothing is shown, and no global state is changed; a notebook displays the figure that is returned. `options` are those of
        the panel's function, or the `width` of the figure in inches.

        Raises:
            NsmapsError: there is no picture of results of this class, or this one has nothing that can be drawn.
        """
        if not self.picture:
            raise NsmapsError(f"there is no picture of {type(self).__name__}; expected: one of its arrays, drawn by matplotlib")
        return import_module("nsmaps.figures.plot").plot(self, ax, **options)

    def to_xarray(self) -> "Dataset":
        """The declared arrays as an xarray dataset with named axes, labels and units; numbers and texts are its attributes.

        Raises:
            NsmapsError: xarray is not installed.
        """
        return dataset_of(self)

    def _repr_html_(self) -> str:
        """The arrays of the result in a notebook: name, axes with their lengths, and what each holds."""
        rows = [
            f"<tr><td>{escape(name)}</td><td>{escape(_shape(self, declared, value))}</td><td>{escape(declared.text)}</td></tr>"
            for name, declared, value in declared_arrays(self)
        ]
        return f"<p>{escape(str(self))}</p><table>{''.join(rows)}</table>"


def shares_text(names: Iterable[str], shares: Iterable[float]) -> str:
    """Shares by name in per cent, those of zero left out, such as `BB 62.5 %, BTB 37.5 %`."""
    return ", ".join(f"{name} {100 * share:.3g} %" for name, share in zip(names, shares, strict=True) if share)


def range_text(name: str, values: Floats) -> str:
    """The number and the range of values, such as `101 values of d from 0.2 to 0.3`."""
    if not len(values):
        return f"no value of {name}"
    return f"{len(values)} values of {name} from {np.min(values):.6g} to {np.max(values):.6g}"


def frequent(names: "NDArray[np.str_]", max_names: int = 6) -> str:
    """The most frequent names that are not empty, such as `1:1/T, C and 3 more`."""
    found, counts = np.unique(names[names != ""], return_counts=True)
    listed = found[np.argsort(-counts, kind="stable")].tolist()
    return ", ".join(listed[:max_names]) + (f" and {len(listed) - max_names} more" if len(listed) > max_names else "") or "none"


def _shape(result: Any, declared: Declaration, value: Any) -> str:
    shape = np.shape(value)
    return ", ".join(f"{axis} {count}" for axis, count in zip(axes_of(result, declared, len(shape)), shape, strict=True))


def axes_of(result: Any, declared: Declaration, count: int) -> tuple[str, ...]:
    """The names of the axes of an array of a result with this number of axes."""
    if "..." not in declared.axes:
        return declared.axes
    place = declared.axes.index("...")
    unnamed = count - len(declared.axes) + 1
    free = (*result.leading, *(f"axis_{number}" for number in range(unnamed)))[:unnamed]
    return (*declared.axes[:place], *free, *declared.axes[place + 1 :])


def declared_arrays(result: Any) -> Iterator[tuple[str, Declaration, Any]]:
    """The arrays of a result that are not None: name, declaration, array; parts of a tuple by number, of a mapping by name."""
    for each in fields(result):
        if ARRAY in each.metadata and (value := getattr(result, each.name)) is not None:
            value = value._asdict() if isinstance(value, tuple) and hasattr(value, "_asdict") else value
            if isinstance(value, Mapping):
                for name, item in value.items():
                    yield name, replace(each.metadata[ARRAY], axes=_own_axes(name, each.metadata[ARRAY], np.ndim(item))), item
            elif isinstance(value, tuple):
                first, *others = each.metadata[ARRAY].axes
                for number, item in enumerate(value):
                    yield f"{each.name}_{number}", replace(each.metadata[ARRAY], axes=(f"{first}_{number}", *others)), item
            else:
                yield each.name, each.metadata[ARRAY], value
    for base in reversed(type(result).__mro__):
        for name, member in vars(base).items():
            if isinstance(member, ArrayProperty):
                yield name, member.declaration, getattr(result, name)


def _own_axes(name: str, declared: Declaration, count: int) -> tuple[str, ...]:
    """The names of the axes of an array of a mapping, those that `...` stands for by its name."""
    known = tuple(axis for axis in declared.axes if axis != "...")
    return *known, *(f"{name}_{number}" for number in range(count - len(known)))


def dataset_of(result: Any) -> "Dataset":
    """The declared arrays of a result as a dataset, which netCDF and zarr can hold; see `Result.to_xarray`.

    Arrays along `coordinate` have a unit for each, in the variable `unit`: rad of an angle, 1 of what is dimensionless.
    """
    dataset_type = _xarray().Dataset
    found = list(declared_arrays(result))
    names = {each.axes[0]: str(getattr(result, each.name)) for _, each, _ in found if each.name}
    labels = {names[each.axes[0]]: value for _, each, value in found if each.name}
    variables, used = {}, set[str]()
    for name, declared, value in found:
        value = np.asarray(value)
        axes = axes_of(result, declared, value.ndim)
        if np.iscomplexobj(value):
            axes, value = (*axes, "part"), np.stack([value.real, value.imag], axis=-1)
        used |= {names.get(axis, axis) for axis in axes}
        if not declared.name:
            unit = declared.unit or ("see unit" if COORDINATE in axes else "")
            about = {"units": unit} if unit else {}
            variables[name] = ([names.get(axis, axis) for axis in axes], value, about | {"long_name": declared.text})
    coordinates: dict[str, Any] = {
        name: (name, value, {"units": unit_of(result, name)}) for name, value in labels.items() if name in used
    }
    if COORDINATE in used:
        own = list(result.coordinates)
        coordinates |= {COORDINATE: [str(name) for name in own], "unit": (COORDINATE, [unit_of(result, name) for name in own])}
        coordinates |= {BY: coordinates[COORDINATE]} if BY in used else {}
    about = {
        each.name: plain(getattr(result, each.name))
        for each in fields(result)
        if isinstance(getattr(result, each.name), bool | int | float | str)
    }
    return dataset_type(variables, coords=coordinates, attrs=about)


def unit_of(result: Any, name: str) -> str:
    """The unit of a coordinate or parameter of a result: rad of an angle, else that of its `units`, or 1."""
    units: Mapping[str, str] = getattr(result, "units", {})
    return "rad" if is_angle(name) else units.get(name, NONE)


def _xarray() -> Any:
    try:
        return import_module("xarray")
    except ImportError as error:
        raise NsmapsError("xarray is not installed; expected: pip install 'nsmaps[data]'") from error


def plain(value: Any) -> Any:
    """What netCDF takes for an attribute: a switch as 0 or 1, a name as text, names as one text."""
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str):  # a name of an angle too
        return str(value)
    return " ".join(map(str, value)) if isinstance(value, tuple) else value


def datasets(part: Any, path: str) -> "Iterator[tuple[str, Dataset]]":
    """The datasets of a result and of the results within it, by path; a slash in a name is written as a bar."""
    if isinstance(part, Mapping):
        for name, item in part.items():
            yield from datasets(item, f"{path}/{str(name).replace('/', '|')}")
    elif isinstance(part, tuple | list) and not hasattr(part, "_fields"):
        for number, item in enumerate(part):
            yield from datasets(item, f"{path}/{number}")
    elif isinstance(part, Result) and is_dataclass(part):
        if any(declared_arrays(part)):
            yield path, part.to_xarray()
        for each in fields(part):
            yield from datasets(getattr(part, each.name), f"{path}/{each.name}")


def tree(parts: Mapping[str, Any], **about: Any) -> "DataTree":
    """The datasets of several results by path, with what else is to be known at the root. Errors as `Result.to_xarray`."""
    xarray = _xarray()
    root = xarray.Dataset(attrs={name: plain(value) for name, value in about.items()})
    found = dict(each for path, part in parts.items() for each in datasets(part, path))
    return xarray.DataTree.from_dict({"/": root, **found})


def units_of(return_map: object) -> dict[str, str]:
    """The units that a system states for coordinates and parameters, by name; "1" under the name "" if it is dimensionless."""
    units = dict(getattr(return_map, "units", {}))
    return units | ({"": NONE} if getattr(return_map, "dimensionless", False) else {})
