"""Nonlinear systems with modes with independent references of 30 digits, and these references."""

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from nsmaps_hopper import Hopper
from nsmaps_neuron import Neuron
from nsmaps_relief_valve import ReliefValve, ReliefValveLift
from nsmaps_rimless_wheel import RimlessWheel

from nsmaps import Guard, HybridSystem, Outcome, PoincareSection

DATA = Path(__file__).parent / "data" / "nonlinear"


class Alpazur(HybridSystem):
    """The forced Alpazur oscillator, between its switches to the second mode."""

    k: float
    g1: float
    g2: float
    B1: float
    B2: float
    V0: float
    V: float
    omega: float

    states = ("v1", "v2")

    def period(self):
        return 2 * sp.pi / self.omega

    def modes(self, t, y):
        rate = -self.k * y.v1 - y.v2 + self.V0 + self.V * sp.cos(self.omega * t)
        both = {"1": (self.g1, self.B1), "2": (self.g2, self.B2)}
        return {mode: {"v1": rate, "v2": y.v1 + (1 - g) * y.v2 - y.v2**3 / 3 + B} for mode, (g, B) in both.items()}

    def guards(self, t, y):
        return {"A": Guard("1", y.v2 + 1, to="2"), "B": Guard("2", -y.v2 - sp.Rational(1, 10), to="1")}

    def section(self, t, y):
        return PoincareSection("A", ("v1", "phi"))


class StrobedAlpazur(Alpazur):
    """The same, once a period."""

    def guards(self, t, y):
        return {**super().guards(t, y), "S": Guard(("1", "2"), -sp.sin(self.omega * t))}

    def section(self, t, y):
        return PoincareSection("S", ("v1", "v2"))


class ImpactDamper(HybridSystem):
    """Two masses with cubic springs, the second between stops of the first: the impact Duffing oscillator of PWSDDE-cont."""

    mu: float
    zeta: float
    xi: float
    f: float
    omega: float
    e: float
    eta1: float
    eta2: float

    states = ("x1", "v1", "x2", "v2")

    def period(self):
        return 2 * sp.pi / self.omega

    def modes(self, t, y):
        link = 2 * self.xi * (y.v1 - y.v2) + self.f**2 * (y.x1 - y.x2) + self.eta2 * (y.x1 - y.x2) ** 3
        force = sp.cos(self.omega * t) - 2 * self.zeta * y.v1 - y.x1 - self.eta1 * y.x1**3
        return {"free": {"x1": y.v1, "v1": force - self.mu * link, "x2": y.v2, "v2": link}}

    def guards(self, t, y):
        mean = (y.v1 + self.mu * y.v2) / (1 + self.mu)
        impact = {name: (1 + self.e) * mean - self.e * speed for name, speed in (("v1", y.v1), ("v2", y.v2))}
        apart = y.x1 - y.x2
        return {"P": Guard("free", 1 - apart, reset=impact), "N": Guard("free", 1 + apart, reset=impact)}

    def section(self, t, y):
        return PoincareSection("P", ("x1", "v1", "v2", "phi"))


class PendulumBeforeStop(HybridSystem):
    """A driven pendulum that hits a stop."""

    zeta: float
    F: float
    omega: float
    stop: float
    r: float

    states = ("th", "w")

    def period(self):
        return 2 * sp.pi / self.omega

    def modes(self, t, y):
        return {"swing": {"th": y.w, "w": self.F * sp.cos(self.omega * t) - 2 * self.zeta * y.w - sp.sin(y.th)}}

    def guards(self, t, y):
        return {"I": Guard("swing", self.stop - y.th, reset={"w": -self.r * y.w})}

    def section(self, t, y):
        return PoincareSection("I", ("w", "phi"))


class Runner(Hopper):
    """The hopper of any energy: height and speed at the apex."""

    def section(self, t, y):
        return PoincareSection("A", ("y", "vx"), states={"x": 0})


class BallWithDrag(HybridSystem):
    """A ball with quadratic drag on a vibrating table."""

    Gamma: float
    r: float
    k: float

    states = ("y", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"fly": {"y": y.v, "v": -1 - self.k * y.v * sp.Abs(y.v)}}

    def guards(self, t, y):
        table, speed = self.Gamma * sp.sin(t), self.Gamma * sp.cos(t)
        return {"I": Guard("fly", y.y - table, reset={"v": speed - self.r * (y.v - speed)})}

    def section(self, t, y):
        return PoincareSection("I", ("v", "phi"), side="after")


SYSTEMS = {
    "N1 I": ReliefValve,
    "N1 M": ReliefValveLift,
    "N2 A": Alpazur,
    "N2 S": StrobedAlpazur,
    "N3": Neuron,
    "N3 arr": Neuron,
    "N4": ImpactDamper,
    "N5": PendulumBeforeStop,
    "N5w": RimlessWheel,
    "N6": Runner,
    "N6 E": Hopper,  # orbits and bifurcations, at an energy
    "N7": BallWithDrag,
}
FILES = ("N1", "N2", "N3", "N4", "N5", "N5w", "N6", "N7")
RENAMED = {"I": "current", "alpha0_deg": "angle"}  #: parameters by their names in the references
SILENT = {
    "N1 I": "M",
    "N3": "T",
    "N5": "M",
    "N7": "T",
}  #: letters of events at which nothing changes, which the class does not have


@cache
def reference(file):
    """The references of a file."""
    return json.loads((DATA / f"{file}.json").read_text(encoding="utf-8"))


def number(text):
    """A decimal, or a fraction of pi, as a float."""
    return float(sp.sympify(text, rational=True)) if "pi" in text else float(text)


def section_of(file, orbit):
    """The section of an attractor or of a bifurcation; the hopper has them at an energy."""
    return orbit.get("section", "E" if file == "N6" else "")


def system(file, section, parameters, **changes):
    """The system of a file with a section, and parameters as the references have them."""
    values = {RENAMED.get(name, name): number(str(text)) for name, text in {**parameters, **changes}.items()}
    return SYSTEMS[f"{file} {section}".strip()](**values)


def in_coordinates(file, section, point):
    """A point of the references, decimals, in the coordinates of the class: on the seat of the valve v is negative."""
    signs = (-1.0, 1.0) if (file, section) == ("N1", "I") else 1.0
    return np.array(point, float) * signs


def expected_word(file, section, word):
    """A word as the class writes it, without the letter of the start."""
    return "".join(letter for letter in word if letter not in SILENT.get(f"{file} {section}".strip(), ""))


class Row(NamedTuple):
    """A row of the references, and the return or arrival of nsmaps from its start."""

    given: dict[str, Any]
    word: str  #: without the letter of the start
    image: np.ndarray  #: shape (n,)
    derivative: np.ndarray  #: shape (n, coordinates of the start)
    time: float
    outcome: Outcome

    @property
    def steep(self):
        """The largest sum of the sizes of the derivatives of a coordinate, at least one."""
        return max(1.0, np.abs(np.array(self.given["jac"], float)).sum(axis=1).max())


FROM_MODES = {"A": [0, 2], "S": [0, 1], "arr": [0, 1]}  #: sections with starts in modes: which of their states rows have


def _in_modes(section, starts, rows):
    """The states and modes of starts: just after a switch with the phase, at a clock without it, or anywhere."""
    modes = [row.get("mode_start", {"A": "2", "arr": "rest"}.get(section)) for row in rows]
    if section == "A":
        starts = np.insert(starts, 1, -1.0, axis=1)
    return (np.pad(starts, ((0, 0), (0, 1))) if section == "S" else starts), [str(mode) for mode in modes]


def rows_of(file):
    """All rows of a file with their returns, batches by section and parameters."""
    given, rows = reference(file), []
    batches = dict.fromkeys((row["params"], row.get("section", "")) for row in given["returns"])
    for key, section in batches:
        here = [row for row in given["returns"] if (row["params"], row.get("section", "")) == (key, section)]
        made = system(file, section, given["parameters"][key])
        starts = np.array([in_coordinates(file, section, row["start"]) for row in here])
        if section in FROM_MODES:
            found = made.arrivals(*_in_modes(section, starts, here), derivative=True)
            words = found.words.tolist()
        else:
            found = made.first_return(starts, derivative=True)
            words = [word[1:] for word in found.words.tolist()]
        for k, row in enumerate(here):
            slopes = found.derivative[k][:, FROM_MODES.get(section, slice(None))]
            rows.append(Row(row, words[k], found.image[k], slopes, found.time[k], Outcome(found.outcome[k])))
    assert len(rows) == len(given["returns"]) > 30
    return rows
