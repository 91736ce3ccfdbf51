"""The boost converter in current-mode control, its output voltage held: the inductor current from clock to clock."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

from pydantic import Field

from nsmaps import PiecewiseMap
from nsmaps.exact import Coordinates


class BoostConverter(PiecewiseMap):
    """The current i at the clock: on, it rises by `rise` in a period, up to I_ref less a ramp; off, it falls alpha times as fast.

    With input voltage E, output voltage V, inductance L and clock period T, the unit of time, rise = E T/L and alpha = V/E - 1.
    The ramp begins at each clock and has m_c times the slope of the rising current. Letters: N, on throughout, as the reference
    is not met; S, switched off once; Z, off, with a current that falls to zero and remains there; F, off throughout, as the
    current is above the reference. J. H. B. Deane, IEEE Trans. Circuits Syst. I 39 (1992) 680.
    """

    units: ClassVar[Mapping[str, str]] = dict.fromkeys(("i", "I_ref", "rise"), "A")

    alpha: float = Field(gt=0, description="falling slope of the current over the rising one, V/E - 1")
    m_c: float = Field(0.0, ge=0, description="slope of the compensating ramp over that of the rising current")
    I_ref: float = Field(gt=0, description="reference current")
    rise: float = Field(1.0, gt=0, description="rise of the current in a clock period, E T/L")

    coordinates = Coordinates(("i",))

    def pieces(self, x: SimpleNamespace) -> Mapping[str, tuple[Any, Mapping[str, Any]]]:
        """On throughout, switched off once, off throughout, and at zero."""
        on = (self.I_ref - x.i) / (1 + self.m_c)  # what the current rises by
        fall = self.alpha * (self.rise - on)
        return {
            "N": (on >= self.rise, {"i": x.i + self.rise}),
            "S": ((on >= 0) & (x.i + on > fall), {"i": x.i + on - fall}),
            "F": ((on < 0) & (x.i > self.alpha * self.rise), {"i": x.i - self.alpha * self.rise}),
            "Z": (True, {"i": 0}),
        }
