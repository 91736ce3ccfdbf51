"""Wrong parameters: one error of nsmaps wherever a system is made, with a near match whatever the case."""

import math
import pydoc
import re

import pytest
import sympy as sp
from messages import message
from pydantic import Field

import nsmaps
from nsmaps.errors import ParameterError, SystemDefinitionError, near_match

PAIR = {"d": 0.35, "g_bar": 0.2113}


@pytest.mark.parametrize(
    ("parameters", "says"),
    [
        (
            PAIR | {"R": 1},
            message(
                "errors.unknown-near", kind="parameter", name="R", near="r", known="d, r, g_bar, base, M, F, g, beta, s, omega"
            ),
        ),
        (PAIR | {"g_baz": 1}, message("errors.unknown-near", kind="parameter", name="g_baz", near="g_bar")),
        ({"d": 0.35}, message("parameters.missing", name="g_bar")),
        ({"D": 0.35, "g_bar": 0.2}, message("errors.unknown-near", kind="parameter", name="D", near="d")),
        (PAIR | {"r": 2}, message("errors.value", name="r", value=2, expected="less than or equal to 1")),
        (PAIR | {"M": 1}, message("exact.not-used", names="M")),
    ],
)
def test_a_wrong_parameter_is_an_error_of_nsmaps_without_a_link(parameters: dict[str, float], says: str) -> None:
    with pytest.raises(ParameterError) as told:
        nsmaps.load_system("vi_pair", **parameters)
    assert str(told.value).startswith("VIPair: ")
    assert re.search(says, str(told.value))
    assert "http" not in str(told.value)
    assert told.value.__suppress_context__, "the message says all"
    assert isinstance(told.value, ValueError)


def test_a_missing_parameter_that_is_there_misspelt_is_told_once() -> None:
    with pytest.raises(ParameterError) as told:
        nsmaps.load_system("vi_pair", D=0.35, g_bar=0.2)
    assert "missing" not in str(told.value)


def test_changing_a_parameter_says_the_same() -> None:
    system = nsmaps.load_system("vi_pair", **PAIR)
    with pytest.raises(
        ParameterError, match=message("errors.unknown-near", kind="parameter", name="G_bar", near="g_bar", at="VIPair")
    ):
        system.at(G_bar=1)
    with pytest.raises(ParameterError, match=message("errors.at-least", name="r", value=-1, bound=0)):
        system.at(r=-1)


def test_help_has_the_parameters_with_their_descriptions() -> None:
    described = type(nsmaps.load_system("vi_pair", **PAIR))
    shown = pydoc.plain(pydoc.render_doc(described))
    for name in ("d", "r", "g_bar"):
        assert f"{name}: {described.model_fields[name].description}" in shown
    assert "Parameters:" not in pydoc.plain(pydoc.render_doc(Falling))


def test_near_matches_do_not_mind_the_case() -> None:
    assert near_match("l", ["a", "L"]) == ", did you mean 'L'?"
    assert near_match("R1", ["R1", "r2"]) == ", did you mean 'R1'?"
    assert near_match("x", ["L"]) == ""


class Runner(nsmaps.HybridSystem):
    """x' = h + e from 0 to 1, with numbers of sympy as defaults."""

    h: float = sp.pi / 8
    e: float = Field(sp.sqrt(2).evalf() / 8, gt=0)
    states = ("x",)

    def modes(self, t, y):
        return {"m": {"x": self.h + self.e}}

    def guards(self, t, y):
        return {"J": nsmaps.Guard("m", 1 - y.x, reset={"x": y.x - 1})}

    def section(self, t, y):
        return nsmaps.PoincareSection("J", ("x",))


class Falling(nsmaps.ImpactSystem):
    """A ball that falls at the rate g."""

    g: float = sp.Rational(1, 4)

    def walls(self):
        return {"B": nsmaps.Wall(at=0, side=-1)}

    def period(self):
        return 1

    def rebound(self, speed, wall):
        return speed / 2

    def displacement(self, t, hit):
        return hit.z + hit.w * (t - hit.t) - self.g * (t - hit.t) ** 2 / 2


def test_numbers_of_sympy_are_parameters_also_as_defaults() -> None:
    runner, ball = Runner(), Falling()
    assert [type(x) for x in (*runner.parameters.values(), *ball.parameters.values())] == [float] * 3
    assert runner.first_return([[1.0]]).time == pytest.approx([8 / (math.pi + math.sqrt(2))])
    assert ball.first_return([[1.0, 0.0]]).time == pytest.approx([4])  # 2 r v / g
    assert Runner(h=sp.Rational(1, 3)).h == 1 / 3


def test_a_default_that_no_parameter_may_have_is_refused() -> None:
    class Negative(Runner):
        e: float = Field(-1, gt=0)

    with pytest.raises(ValueError, match=message("others.greater", bound=0)):
        Negative()


def test_a_value_without_annotation_is_a_constant_and_hides_no_parameter() -> None:
    class Fast(Runner):
        speed = 3.0

        def modes(self, t, y):
            return {"m": {"x": self.speed}}

    assert Fast().first_return([[1.0]]).time == pytest.approx([1 / 3])
    assert set(Fast().parameters) == {"h", "e"}
    assert type("Faster", (Fast,), {"speed": sp.sqrt(10), "__module__": __name__})().first_return([[1.0]]).time == 1 / 10**0.5
    with pytest.raises(SystemDefinitionError, match=message("parameters.of-base", cls="Other", name="h")):
        type("Other", (Runner,), {"h": 0.5, "__module__": __name__})
