"""A system as a function of one or two of its parameters, which can be sent to other processes."""

from dataclasses import dataclass
from typing import Any, Generic, Protocol, Self, TypeVar


class Adjustable(Protocol):
    """A map whose parameters can be changed, such as a `System` or the `CompleteChatter` of one."""

    def at(self, **changes: Any) -> Self:
        """The map with some parameters changed."""
        ...


AnySystem = TypeVar("AnySystem", bound=Adjustable, covariant=True)


@dataclass(frozen=True, slots=True)
class Along(Generic[AnySystem]):
    """A system as a function of one or two of its parameters: a `map_of` of sweeps that can be sent to other processes."""

    system: AnySystem
    parameter: str
    second: str | None = None

    def __call__(self, *values: float) -> AnySystem:
        """The system with this value of each parameter."""
        names = [name for name in (self.parameter, self.second) if name is not None]
        if len(values) != len(names):
            raise TypeError(f"{len(values)} values of {' and '.join(names)}; expected: {len(names)}")
        return self.system.at(**{name: float(value) for name, value in zip(names, values, strict=True)})
