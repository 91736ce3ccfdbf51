"""An impact system in reversed time, whose first return leads back along the orbits of the system.

At an impact the speeds before and after it change places, and phases run backwards: a state (v, phi) of the system, with the
speed u after the impact, is the state (u, -phi) of the reversed one.
"""

from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.exact.systems.system import ImpactSystem


def reversed_system(system: ImpactSystem) -> ImpactSystem:
    """The system in reversed time.

    Its first return is the inverse of the system's on all images of states that neither rest nor chatter completely, for then
    every impact and every flight has one past.

    Raises:
        NsmapsError: flights are integrated, an impact law is not linear in the speed, or an impact takes all speed.
    """
    from nsmaps.exact.flows.formulas import is_linear
    from nsmaps.exact.flows.tables import formulas_of

    cls = type(system)
    if cls.flight() == "acceleration":
        raise NsmapsError(f"{cls.__name__} in reversed time: its flights are integrated; expected: a displacement in closed form")
    if not all(is_linear(law) for law in formulas_of(system).laws):
        raise NsmapsError(f"{cls.__name__} in reversed time: an impact law is not linear in the speed; expected: a restitution")
    if lost := [wall for wall in system.letters if not restitution(system, wall) > 0]:
        raise NsmapsError(
            f"{cls.__name__} in reversed time: an impact on {lost[0]} leaves no speed; expected: a restitution above 0"
        )
    return _class(cls).model_construct(**{name: getattr(system, name) for name in cls.model_fields})


def restitution(system: ImpactSystem, wall: str) -> float:
    """The speed after an impact of speed one."""
    return float(system.rebound(1.0, wall))


def to_reversed(system: ImpactSystem, states: Floats) -> Floats:
    """States (N, 2) of a system as states of the reversed one."""
    return np.column_stack([states[:, 0] * restitution(system, system.letters[0]), -states[:, 1]])


def of_reversed(system: ImpactSystem, states: Floats) -> Floats:
    """States (N, 2) of the reversed system as states of the system."""
    return np.column_stack([states[:, 0] / restitution(system, system.letters[0]), -states[:, 1]])


@lru_cache(maxsize=64)
def _class(cls: type[ImpactSystem]) -> type[ImpactSystem]:
    """The class of a system in reversed time."""

    def displacement(self: Any, t: Any, hit: SimpleNamespace) -> Any:
        return cls.displacement(self, -t, SimpleNamespace(t=-hit.t, z=hit.z, w=-hit.w))

    def rebound(self: Any, speed: Any, wall: str) -> Any:
        return speed / cls.rebound(self, 1, wall)

    body = {"displacement": displacement, "rebound": rebound, "__module__": __name__, "__qualname__": f"Reversed{cls.__name__}"}
    return type(f"Reversed{cls.__name__}", (cls,), body)
