"""A system without forcing whose impacts have a closed form."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from nsmaps import Guard, HybridSystem, PoincareSection


class Drop(HybridSystem):
    """A ball that is dropped on the floor again and again, without forcing."""

    g: float
    e: float

    states = ("x", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"x": y.v, "v": -self.g}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"F": Guard("flight", y.x, reset={"v": -self.e * y.v})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("F", ("v",))
