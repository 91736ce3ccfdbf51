"""check_system passes the included systems with modes, and finds planted errors."""

import warnings

import numpy as np
import pytest
import sympy as sp
from hybrid import SYSTEMS, Friction, numbers, reference, system
from messages import message
from nsmaps_recoil_pair import RecoilPair
from nsmaps_soft_impact import SoftImpact

from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.errors import CheckError
from nsmaps.exact.outcome import Outcome
from nsmaps.testing import check_system

SOFT = {"xi": 0.05, "e": 0.3, "a": 0.7, "beta": 29.0, "w": 0.8}


@pytest.mark.parametrize("name", SYSTEMS)
def test_included_systems_pass(name):
    given = reference(name)
    key, parameters = list(given["parameters"].items())[-1]
    rows = [row for row in given["returns"] if row["params"] == key and row["kind"] == "random" and row["image"]]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="no event .* takes place")
        check_system(system(name, parameters), states=[numbers(row["start"]) for row in rows])


class Idle(SoftImpact):
    """A soft impact with a parameter that nothing has."""

    idle: float = 1.0


class Slow(SoftImpact):
    """Its period is given by half."""

    def period(self):
        return -SoftImpact.period(self)


STARTS = np.column_stack([np.linspace(0.1, 2, 20), np.linspace(0, 6, 20)])


@pytest.mark.parametrize(
    ("system", "states", "said"),
    [
        (Idle(**SOFT), STARTS, message("testing.no-effect", system="Idle", name="idle")),
        (Slow(**SOFT), STARTS, message("testing.period", system="Slow", period=-7.85398)),
        (SoftImpact(**SOFT), -STARTS, message("testing.none-returns", number=20, system="SoftImpact")),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:no description of")
def test_planted_errors_are_found(system, states, said):
    with pytest.raises(CheckError, match=said):
        check_system(system, states=states)


def test_a_flow_that_is_not_that_of_the_formulas_is_found(monkeypatch):
    """The formulas that are integrated are those of another stiffness."""
    from nsmaps.testing import hybrid

    def formulas(system, made=hybrid.Formulas):
        return made(system.at(beta=system.beta * 1.01))

    monkeypatch.setattr(hybrid, "Formulas", formulas)
    with pytest.raises(CheckError, match=message("testing.other-return")):
        check_system(SoftImpact(**SOFT), states=STARTS)


PAIR = {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113}


class FromTop(RecoilPair):
    """The pair from impacts at the top, between which it may rest at the base."""

    def section(self, t, y):
        return PoincareSection("T", ("v", "X", "V", "phi"))


def derived(name):
    """A system with a derived mode, and states whose returns lead through it."""
    rng = np.random.default_rng(4)
    phases = rng.uniform(0, 6.28, 60)
    if name == "sliding":
        return Friction(mu=0.5), np.column_stack([rng.uniform(-0.1, 0.1, 60), phases]), "mu"
    starts = np.column_stack([np.full(60, 1e-14), rng.uniform(-0.2, 0.2, 60), rng.uniform(-0.6, 0.6, 60), phases])
    if name == "contact":
        starts[30:, 0] = rng.uniform(0.5, 1, 30)
        return RecoilPair(**PAIR, contact=True), starts, "eta"
    starts[:, 0] = rng.uniform(-0.4, -0.05, 60)
    return FromTop(**{**PAIR, "r": 0.1}, contact=True), starts, "eta"


@pytest.mark.parametrize("name", ["sliding", "contact", "contact on the way"])
@pytest.mark.filterwarnings("ignore:no description of", "ignore:no event")
def test_derived_modes_are_integrated(name, monkeypatch):
    """Sliding and contact by their own formulas: right ones pass, those of another parameter are found."""
    from nsmaps.testing import hybrid

    chosen, states, parameter = derived(name)
    returns = chosen.first_return(states)
    states, returns = states[returns.valid], returns.select(returns.valid)
    if name != "sliding":
        rests = np.char.find(returns.words, "~") > 0
        assert rests.sum() >= 3
        states = np.concatenate([states[rests][:6], states[~rests][-6:]])
    check_system(chosen, states=states)

    def formulas(system, made=hybrid.Formulas):
        return made(system.at(**{parameter: getattr(system, parameter) * 1.05}))

    monkeypatch.setattr(hybrid, "Formulas", formulas)
    with pytest.raises(CheckError, match=message("testing.other-return")):
        check_system(chosen, states=states)


class Wheel(HybridSystem):
    """A wheel of spokes, linear about the upright, that rolls over a spoke forward (F) or backward (B)."""

    k: float = 2.0
    a: float = 0.3
    e: float = 0.8
    states = ("th", "w")

    def modes(self, t, y):
        return {"roll": {"th": y.w, "w": self.k * y.th + 0.1}}

    def guards(self, t, y):
        forward, backward = (
            Guard("roll", self.a - y.th, reset=self.turned(-1, y)),
            Guard("roll", self.a + y.th, reset=self.turned(1, y)),
        )
        return {"F": forward, "B": backward}

    def turned(self, side, y):
        return {"th": y.th + 2 * side * self.a, "w": self.e * y.w}

    def section(self, t, y):
        return PoincareSection("F", ("w",), side="after")


class Sides(Wheel):
    def section(self, t, y):
        return PoincareSection(("F", "B"), ("w",))


class AtPhase(SoftImpact):
    """Once a period, at a phase of its own."""

    def guards(self, t, y):
        return {**super().guards(t, y), "strobe": Guard(("free", "contact"), sp.cos(self.w * t))}

    def section(self, t, y):
        return PoincareSection("strobe", ("x", "v"))


class Fire(HybridSystem):
    """A voltage that rises to 1 and falls back to 0; the phase alone is seen."""

    a: float = 0.3
    states = ("u",)

    def period(self):
        return 2

    def modes(self, t, y):
        return {"m": {"u": 1.4 - y.u + self.a * sp.cos(sp.pi * t)}}

    def guards(self, t, y):
        return {"F": Guard("m", 1 - y.u, reset={"u": 0})}

    def section(self, t, y):
        return PoincareSection("F", ("phi",))


class Held(HybridSystem):
    """A temperature between two thresholds, both of them a section on which it is named."""

    a: float = 0.3
    states = ("T",)

    def period(self):
        return 1

    def modes(self, t, y):
        wave = self.a * sp.sin(2 * sp.pi * t)
        return {"on": {"T": 2 - y.T + wave}, "off": {"T": wave - y.T}}

    def guards(self, t, y):
        return {"U": Guard("on", 1.2 - y.T, to="off"), "D": Guard("off", y.T - 0.8, to="on")}

    def section(self, t, y):
        return PoincareSection(("U", "D"), ("T", "phi"))


@pytest.mark.filterwarnings("ignore:no description of")
def test_of_a_phase_alone_the_time_is_compared(monkeypatch):
    from nsmaps.testing import hybrid

    monkeypatch.setattr(hybrid, "Formulas", lambda system, made=hybrid.Formulas: made(system.at(a=system.a * 1.01)))
    with pytest.raises(CheckError, match=message("testing.other-return", system="Fire")):
        check_system(Fire())


@pytest.mark.parametrize("system", [Wheel(), Sides(), AtPhase(**SOFT), Fire(), Held()], ids=lambda one: type(one).__name__)
@pytest.mark.filterwarnings("ignore:.*has no (description|docstring)", "ignore:no event")
def test_random_states_to_which_no_motion_comes_raise_no_alarm(system):
    check_system(system)


@pytest.mark.filterwarnings("ignore:no description of")
def test_an_image_that_is_not_a_start_is_found(monkeypatch):
    """A section whose engine takes no start at its second event."""
    from nsmaps.testing import hybrid

    def one_start(system, states, **options):
        returns = Sides.first_return(system, states, **options)
        returns.outcome[np.asarray(states)[:, 0] < 0] = Outcome.invalid
        return returns

    system = type("Half", (Sides,), {"first_return": one_start})()
    with pytest.raises(CheckError, match=message("testing.returned-to-no-start")):
        hybrid.check_hybrid(system, None)


@pytest.mark.filterwarnings("ignore:no description of", "ignore:no event")
def test_walls_in_the_wrong_order_are_found():
    class Crossed(HybridSystem):
        """A ball between walls at a and -a, for a negative a: behind one wall after an impact on the other."""

        a: float = -1.0
        states = ("x", "v")

        def modes(self, t, y):
            return {"fly": {"x": y.v, "v": -y.v / 10}}

        def guards(self, t, y):
            return {"R": Guard("fly", self.a - y.x, reset={"v": -y.v}), "L": Guard("fly", self.a + y.x, reset={"v": -y.v})}

        def section(self, t, y):
            return PoincareSection("R", ("v",))

    with pytest.raises(
        CheckError,
        match=message("testing.cannot-continue", start="[2.]", why="The guard 'L' is negative where the mode 'fly' begins"),
    ):
        check_system(Crossed(), states=[[2.0]])
    with pytest.raises(CheckError, match=message("testing.none-returns-because", number=200, system="Crossed", letter="R")):
        check_system(Crossed())
