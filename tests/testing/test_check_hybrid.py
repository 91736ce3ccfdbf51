"""check_system passes the included systems with modes, and finds planted errors."""

import warnings

import numpy as np
import pytest
from hybrid import SYSTEMS, numbers, reference, system
from nsmaps_soft_impact import SoftImpact

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
