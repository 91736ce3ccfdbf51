"""What an observable is: a formula of each impact, each instant of the flights or each return, and how its values are joined."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from nsmaps.arrays import Storable
from nsmaps.errors import NsmapsError
from nsmaps.files.complaints import refused


class Observable(BaseModel, Storable):
    """A quantity that is summed along an orbit: over its impacts, over the time of its flights, or over the returns of a map.

    A formula of an impact has the impact speed `v` just before it, `v_after`, the `place` of the wall; in a system with modes
    the states just before an event by their names, and just after it with `_after` behind the name. A formula of a flight has
    `place` and `velocity`, or the states. Either has the phase `phi` of the forcing (radians) and the time `t` since the phase
    was zero. A formula of a return of a map without motions has the coordinates by their names, angles in [0, 2 pi), and those of
    the image with `_after` behind the name, angles continued from the state. All have the parameters of the system, and the
    functions sqrt, exp, log, sin, cos, tan, sinh, cosh, tanh, their inverses (asin, atanh, ...), erf and abs.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str = Field(min_length=1, description="what it is called in results")
    formula: str = Field(description="of an impact, of an instant of a flight, or of a return of a map")
    of: Literal["impacts", "flights", "returns"] | None = Field(
        default=None, description="summed over impacts, integrated over flights, summed over the returns of a map; else the first"
    )
    at: Annotated[tuple[str, ...], BeforeValidator(lambda value: (value,) if isinstance(value, str) else value)] = Field(
        default=(),
        description="letters of the impacts that count, modes of flights, or letters of the pieces of a map; all if omitted",
    )
    per: str = Field(
        default="",
        description="a formula of the same kind: the mean is the quotient of both sums; `1` for per impact",
    )
    largest: bool = Field(default=False, description="the largest value takes the place of the sum")
    scale: float = Field(default=1.0, description="factor of the values, as from dimensionless to physical units")
    unit: str = Field(default="", description="of the values times the scale")

    @model_validator(mode="after")
    def _joined_in_one_way(self) -> Self:
        if self.largest and self.per:
            raise ValueError(f"{self.name!r} is the largest value of its formula, and has `per`; expected: one of the two")
        return self

    @property
    def formulas(self) -> tuple[str, ...]:
        """Its formula, and that by which its sum is divided, if any."""
        return (self.formula, self.per) if self.per else (self.formula,)


ObservableLike: TypeAlias = str | Observable | Mapping[str, Any]  #: the name of one that the system has, one, or its keys


def with_distinct_names(observables: Iterable[Observable]) -> tuple[Observable, ...]:
    """Observables as they are; NsmapsError if there is none, or if a name occurs twice."""
    found = tuple(observables)
    names = [one.name for one in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None or not found:
        what = "there is no observable" if twice is None else f"two observables are named {twice!r}"
        raise NsmapsError(f"{what}; expected: one or more, each with a name of its own")
    return found


def observable_of(keys: Mapping[str, Any]) -> Observable:
    """An observable by its keys; NsmapsError in place of pydantic's ValidationError."""
    try:
        return Observable(**keys)
    except ValidationError as error:
        raise NsmapsError(refused(error, Observable)) from error
