"""check_system passes the included systems with modes, and finds planted errors."""

import warnings

import numpy as np
import pytest
from hybrid import SYSTEMS, Friction, numbers, reference, system
from nsmaps_recoil_pair import RecoilPair
from nsmaps_soft_impact import SoftImpact

from nsmaps import Section
from nsmaps.errors import CheckError
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
        (Idle(**SOFT), STARTS, "no return of Idle depends on its parameter 'idle'"),
        (Slow(**SOFT), STARTS, "the period of Slow is -7.85398; expected: a positive number"),
        (SoftImpact(**SOFT), -STARTS, "none of 20 states of SoftImpact returns to its section"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore:.*has no description")
def test_planted_errors_are_found(system, states, said):
    with pytest.raises(CheckError, match=said):
        check_system(system, states=states)


def test_a_flow_that_is_not_that_of_the_formulas_is_found(monkeypatch):
    """The formulas that are integrated are those of another stiffness."""
    from nsmaps.testing import hybrid

    def formulas(system, made=hybrid.Formulas):
        return made(system.at(beta=system.beta * 1.01))

    monkeypatch.setattr(hybrid, "Formulas", formulas)
    with pytest.raises(CheckError, match="is not that of its formulas"):
        check_system(SoftImpact(**SOFT), states=STARTS)


PAIR = {"eta": 0.1, "kappa": 0.04, "Lambda": 0.2, "d": 0.35, "r": 0.5, "g_bar": 0.2113}


class FromTop(RecoilPair):
    """The pair from impacts at the top, between which it may rest at the base."""

    def section(self, t, y):
        return Section("T", ("v", "X", "V", "phi"))


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
@pytest.mark.filterwarnings("ignore:.*has no description", "ignore:no event")
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
    with pytest.raises(CheckError, match="is not that of its formulas"):
        check_system(chosen, states=states)
