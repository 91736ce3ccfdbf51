"""Izhikevich's neuron: two equations and a reset (IEEE Trans. Neural Networks 14 (2003) 1569)."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from pydantic import Field

from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection


class Neuron(HybridSystem):
    """Membrane potential v in mV and recovery u, in ms: v' = 0.04 v^2 + 5 v + 140 - u + current, u' = a (b v - u).

    At v = peak, a spike, v becomes c and u becomes u + d.
    """

    a: float = Field(0.02, gt=0, description="rate of recovery, 1/ms")
    b: float = Field(0.2, description="sensitivity of the recovery to v")
    c: float = Field(-65, description="v after a spike, mV")
    d: float = Field(8, description="increase of u by a spike")
    current: float = Field(10, description="current of synapses, or injected")
    peak: float = Field(30, description="v of a spike, mV")

    states = ("v", "u")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        """Between spikes."""
        return {"rest": {"v": y.v**2 / 25 + 5 * y.v + 140 - y.u + self.current, "u": self.a * (self.b * y.v - y.u)}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        """A spike S."""
        return {"S": Guard("rest", self.peak - y.v, reset={"v": self.c, "u": y.u + self.d})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        """Just before a spike: the recovery."""
        return PoincareSection("S", ("u",))
