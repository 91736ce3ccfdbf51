"""The voltage-mode controlled buck converter: two linear circuits, switched by a ramp."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class BuckConverter(HybridSystem):
    """C v' = i - v/R, L i' = u E - v in SI units; u = 1 while a1 (v - Vref) is below a ramp from gamma to upper of period T_r.

    The ramp is the state q in [0, 1]. There is no latch: within a ramp it may switch any number of times.
    E. Fossas, G. Olivar, IEEE Trans. Circuits Syst. I 43 (1996) 13.
    """

    units: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("v", "Vref", "gamma", "upper", "E"), "V"),
        "i": "A",
        "R": "Ω",
        "C": "F",
        "L": "H",
        **dict.fromkeys(("T_r", "time"), "s"),
    }

    R: float = Field(22, gt=0, description="load, Ohm")
    C: float = Field(47e-6, gt=0, description="capacity, F")
    L: float = Field(20e-3, gt=0, description="inductance, H")
    a1: float = Field(8.4, gt=0, description="gain")
    Vref: float = Field(11.3, description="reference, V")
    gamma: float = Field(3.8, description="lower end of the ramp, V")
    upper: float = Field(8.2, description="upper end of the ramp, V")
    T_r: float = Field(400e-6, gt=0, description="period of the ramp, s")
    E: float = Field(gt=0, description="input voltage, V")

    states = ("v", "i", "q")
    horizon = 1.0

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Switch off and on."""
        off = {"v": (y.i - y.v / self.R) / self.C, "i": -y.v / self.L, "q": 1 / self.T_r}
        return {"off": off, "on": {**off, "i": (self.E - y.v) / self.L}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """On (N) and off (F), by the control voltage above the ramp, and when the ramp falls."""
        low = self.a1 * (y.v - self.Vref) - self.gamma
        above = low - (self.upper - self.gamma) * y.q
        return {
            "N at the fall": Guard(("on", "off"), 1 - y.q, to="on", reset={"q": 0}, where=(-low,)),
            "F at the fall": Guard(("on", "off"), 1 - y.q, to="off", reset={"q": 0}, where=(low,)),
            "N": Guard("off", above, to="on"),
            "F": Guard("on", -above, to="off"),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Where the ramp falls: voltage and current."""
        return PoincareSection(("N at the fall", "F at the fall"), ("v", "i"))
