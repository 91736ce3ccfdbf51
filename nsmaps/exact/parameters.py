"""A system of equations with parameters, as a frozen model: what impact systems and systems with modes have in common."""

import sys
from abc import ABC
from collections.abc import Mapping
from pickle import PicklingError
from typing import Any, ClassVar, Self, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from nsmaps.complaints import refused
from nsmaps.errors import ParameterError
from nsmaps.exact.files import received

Model = TypeVar("Model", bound="ParametricSystem")


class ParametricSystem(BaseModel, ABC):
    """Equations whose float fields are parameters; other fields (a choice, a switch) are part of the formulas."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    dimensionless: ClassVar[bool] = False  #: whether states, times and parameters have no unit, which figures then say
    instead: ClassVar[Mapping[str, str]] = {}  #: what a validator accepts in place of parameters: names and descriptions

    @classmethod
    def parameter_names(cls) -> tuple[str, ...]:
        """The names of the parameters that are numbers, in the order of their fields."""
        return tuple(name for name, field in cls.model_fields.items() if field.annotation is float)

    @property
    def parameters(self) -> dict[str, float]:
        """The values of the parameters that are numbers."""
        return {name: getattr(self, name) for name in self.parameter_names()}

    def __str__(self) -> str:
        """The class with all of its fields, as pydantic's `repr`."""
        return repr(self)

    def at(self, **changes: Any) -> Self:
        """The same system with some parameters changed, validated. ParameterError for one that is not accepted."""
        return with_parameters(type(self), {**self.model_dump(), **changes})

    def __reduce__(self) -> tuple[Any, ...]:
        """How other processes are sent a system: by its class, with the class's file, and its values."""
        cls = type(self)
        if "<locals>" in cls.__qualname__:
            raise PicklingError(f"{cls.__qualname__} is made by a function; a class of a module can be sent to other processes")
        file = getattr(sys.modules.get(cls.__module__), "__file__", None)
        return received, (cls.__module__, file, cls.__qualname__, self.model_dump())


def with_parameters(cls: type[Model], parameters: Mapping[str, Any]) -> Model:
    """The system of a class with these parameters, or a ParameterError in place of pydantic's ValidationError."""
    try:
        return cls(**parameters)
    except ValidationError as error:
        raise ParameterError(refused(error, cls)) from error
