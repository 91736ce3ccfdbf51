"""A system: a return map with parameters as a frozen model, the base of impact systems, systems with modes and maps."""

import hashlib
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from inspect import cleandoc, getsource, isabstract
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo, ModelPrivateAttr

from nsmaps.arrays import Floats
from nsmaps.coordinates import Coordinates
from nsmaps.errors import ParameterError, SystemDefinitionError, check_known
from nsmaps.exact.kernel import Kernel
from nsmaps.exact.returnmap import ExactMap, ReturnMap, is_foreign, letters_of
from nsmaps.exact.systems.files import Transferable
from nsmaps.files.complaints import refused
from nsmaps.parallel import fingerprint

Model = TypeVar("Model", bound="System")


class _Unmarked(type):
    """The type of `_Constant`."""

    def __instancecheck__(cls, value: object) -> bool:
        return not isinstance(value, (FieldInfo, ModelPrivateAttr))


class _Constant(metaclass=_Unmarked):
    """Any value, of sympy or numpy too, that is not one of pydantic's descriptions of a field."""


class System(BaseModel, Transferable, ReturnMap):
    """A return map whose float fields are parameters; other fields (a choice, a switch) are part of the formulas.

    A name with a value but without an annotation, as `k = 2.0`, is a constant of the class. A map that is known by itself
    inherits from it with two definitions: `coordinates`, the names of its coordinates, of which an `Angle` lives on the
    circle, and `first_return(states, derivative=False)`, which gives `Returns.of_map(...)` of finite states, shape (N, n).
    """

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        validate_default=True,
        ignored_types=(_Constant,),
    )

    dimensionless: ClassVar[bool] = False  #: True if states, times and parameters have no unit, which figures then state
    units: ClassVar[Mapping[str, str]] = {}  #: of coordinates and parameters by name, and of `time`, `displacement`, `velocity`
    instead: ClassVar[Mapping[str, str]] = {}  #: alternatives to parameters that a validator accepts: names and descriptions
    observables: ClassVar[Mapping[str, Mapping[str, Any]]] = {}  #: quantities by name, by the keys of `nsmaps.Observable`

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Refuse a constant with the name of a field, which would remain as it was."""
        super().__init_subclass__(**kwargs)
        fields = {name for base in cls.__mro__[1:] for name in getattr(base, "__pydantic_fields__", {})}
        for name in vars(cls):
            if name in fields and name not in vars(cls).get("__annotations__", {}):
                raise SystemDefinitionError(
                    f"{cls.__name__}.{name} is a parameter of its base, and has no annotation here; expected: "
                    f"`{name}: float = ...`"
                )

    @property
    def is_integrated(self) -> bool:
        """True if flights are integrated numerically, which nothing certifies."""
        return False

    @property
    def map_name(self) -> str:
        """What its return map is called: "integrated map" or "exact map"."""
        return "integrated map" if self.is_integrated else "exact map"

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """The coordinates of the class, given as names, as `Coordinates`; a docstring that has the parameters, for `help`."""
        described = [f"    {name}: {field.description}" for name, field in cls.model_fields.items() if field.description]
        if described and (text := vars(cls).get("__doc__")):
            cls.__doc__ = "\n".join([cleandoc(text), "", "Parameters:", *described])
        names = vars(cls).get("coordinates")
        if isinstance(names, Sequence):
            cls.coordinates = Coordinates(names)  # type: ignore[assignment, method-assign]
        elif not (isabstract(cls) or hasattr(cls, "coordinates")):
            raise SystemDefinitionError(f'{cls.__name__} has no `coordinates`; expected: names, as `coordinates = ("x", "y")`')

    wanted: ClassVar[str] = (
        "an object of a class that inherits from nsmaps.System, whose fields are its parameters, or, where parameters vary, a "
        "function of these that gives the map"
    )

    if TYPE_CHECKING:

        @property
        def coordinates(self) -> Coordinates: ...

    @property
    def section_letters(self) -> tuple[str, ...]:
        """The letters with which words begin; "" where that may be any."""
        return ("",)

    @property
    def letters(self) -> tuple[str, ...]:
        """The letters of which words consist; none of a map without words."""
        return letters_of(self)

    def period(self) -> Any:
        """Period of the forcing, in the system's time; None where there is no forcing."""
        return None

    @classmethod
    @lru_cache(maxsize=256)
    def parameter_names(cls) -> tuple[str, ...]:
        """The names of the numerical parameters, in the order of their fields."""
        return tuple(name for name, field in cls.model_fields.items() if field.annotation is float)

    @property
    def parameters(self) -> dict[str, float]:
        """The values of the numerical parameters."""
        return {name: getattr(self, name) for name in self.parameter_names()}

    def direction(self, rates: Mapping[str, float]) -> Floats:
        """The rates at which the parameters change, shape (P,), of those given by name; the others do not change.

        Raises:
            ParameterError: a name is not one of a numerical parameter, or a rate is not a finite number.
        """
        names, cls = self.parameter_names(), type(self).__name__
        for name, rate in rates.items():
            check_known(f"{cls}: unknown parameter", name, names, ParameterError)
            if not np.isfinite(rate):
                raise ParameterError(f"{cls}: the rate of {name!r} is {rate}; expected: a finite number")
        return np.array([float(rates.get(name, 0.0)) for name in names])

    def check_formulas(self) -> None:
        """Refuse formulas that give no map at the parameters, with an NsmapsError: none of a map without formulas."""

    def __str__(self) -> str:
        """The class with all of its fields, as pydantic's `repr`."""
        return repr(self)

    def at(self, **changes: Any) -> Self:
        """The same system with some parameters changed, validated. ParameterError for an invalid one."""
        return with_parameters(type(self), {**self.model_dump(), **changes})


class ExactSystem(System, ExactMap):
    """A system whose map is compiled from formulas of its class."""

    __slots__ = ("_results",)  # what was made from the system, by name

    if TYPE_CHECKING:
        _results: ClassVar[dict[str, Any]]  # of an object; fields of a model would be arguments

    @abstractmethod
    def _compile(self) -> Kernel:
        """The compiled map at the parameters of the system."""

    @classmethod
    @abstractmethod
    def formulas(cls) -> dict[str, Any]:
        """The formulas of the class by name, all that its map follows from."""

    def check_formulas(self) -> None:
        """Refuse formulas that give no map at the parameters, with an NsmapsError; without compiling machine code."""
        self._kernel()

    @property
    def is_integrated(self) -> bool:
        """True if flights are integrated numerically, which nothing certifies."""
        return bool(self._kernel().integrated)

    def _kernel(self) -> Any:
        """The compiled map, made once."""
        return self._once("kernel", self._compile)

    def _once(self, name: str, make: Callable[[], Any]) -> Any:
        """What was made under a name from the system, which does not change."""
        try:
            return self._results[name]
        except AttributeError:
            object.__setattr__(self, "_results", {})
        except KeyError:
            pass
        return self._results.setdefault(name, make())


def map_name(system: System, of: str = "exact") -> str:
    """What a system's own map, `exact` in studies, is called, or another map, such as `composite`."""
    return system.map_name if of == "exact" else f"{of} map"


def choices_of(system: System) -> dict[str, Any]:
    """The values of the fields that are not numbers, by name."""
    return {name: getattr(system, name) for name in type(system).model_fields if name not in system.parameter_names()}


def with_parameters(cls: type[Model], parameters: Mapping[str, Any]) -> Model:
    """The system of a class with these parameters, or a ParameterError in place of pydantic's ValidationError."""
    try:
        return cls(**parameters)
    except ValidationError as error:
        raise ParameterError(refused(error, cls)) from None


@fingerprint.register
def _(system: System) -> str:
    """The identity of a system includes the source of its class, which may have been edited."""
    own = [cls for cls in type(system).__mro__ if issubclass(cls, System) and is_foreign(cls)]
    return f"{hashlib.sha256(''.join(map(_source, own)).encode()).hexdigest()}({system!r})"


def _source(cls: type) -> str:
    """The source of a class; "" of one that was not read from a file."""
    try:
        return getsource(cls)
    except (OSError, TypeError):
        return ""
