"""Which motion a record shows, its margins, and the uncertainty of quantities, against closed forms."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from messages import message
from nsmaps_vi_pair import VIPair
from scipy import stats
from unforced import Drop

import nsmaps
from nsmaps import load_system
from nsmaps.errors import ParameterError
from nsmaps.estimation import Estimate, Record, motions
from nsmaps.exact.systems.hybrid import Guard, HybridSystem, PoincareSection

BALL = load_system("bouncing_ball", Gamma=1.2, r=0.5)


@pytest.fixture(scope="module")
def found() -> Estimate:
    """An estimate of the acceleration of a ball whose motion of one impact a period is stable up to a doubling."""
    hits = BALL.impacts(nsmaps.orbit(BALL, [3.0, 0.5], 200).final, 13)
    noisy = hits.time + hits.phase[0] / BALL.phase_rate() + 5e-3 * np.random.default_rng(0).standard_normal(13)
    return nsmaps.estimate(BALL, Record.of(noisy, noise=5e-3, phase=0.0), free={"Gamma": (1.0, 1.6)}, n_guesses=1)


def test_the_motion_and_its_nearest_event_are_those_of_the_closed_form(found: Estimate) -> None:
    """A ball of restitution r is periodic between pi (1 - r)/(1 + r) and the doubling at the root of both squares."""
    what = motions(BALL, found, n_draws=4)
    assert what.label == "1:0/T"
    assert what.shares == {"1:0/T": 1.0}
    fold, r = np.pi / 3, 0.5
    doubling = np.hypot(fold, 2 * (1 + r**2) / (1 + r) ** 2)
    margins = what.margins
    assert set(margins.parameter.tolist()) == {"Gamma"}
    below, above = (margins.value[side] for side in (margins.value < 1.2, margins.value > 1.2))
    assert fold == pytest.approx(below[0], rel=1e-6)
    assert doubling == pytest.approx(above[0], rel=1e-6)
    np.testing.assert_allclose(margins.distance, np.abs(margins.value - found.values[0]) / found.errors[0])
    assert "sampled" in str(what)


def test_results_draw_themselves_and_are_datasets(found: Estimate) -> None:
    what = motions(BALL, found, n_draws=2)
    spread = nsmaps.uncertainty(BALL, found, lambda ball: ball.Gamma, n_draws=16)
    for result in (found, what, spread):
        assert isinstance(result.plot(), Figure)
        assert result.plot(Figure().subplots()) is not None
    assert found.to_xarray().attrs["dof"] == found.dof
    assert spread.values[:, 0] == pytest.approx(spread.draws[:, 0])
    assert abs(spread.means[0] - found.values[0]) < found.errors[0]


def test_sobol_indices_are_those_of_a_sum_and_distributions_are_what_is_given() -> None:
    """Of a + 2 b with uniform a, b the shares of the variance are 1/5 and 4/5."""
    laws = {"g": (1.0, 2.0), "e": stats.uniform(0.0, 1.0)}
    spread = nsmaps.uncertainty(Drop(g=1.0, e=0.5), laws, {"sum": lambda ball: ball.g + 2 * ball.e}, n_draws=1024, sobol=True)
    assert spread.first_order is not None
    np.testing.assert_allclose(spread.first_order, [[0.2, 0.8]], atol=0.03)
    assert spread.means[0] == pytest.approx(2.5, abs=0.06)
    assert spread.deviations[0] == pytest.approx(np.sqrt(5 / 12), abs=0.04)


def test_sobol_indices_are_left_out_where_they_do_not_exist() -> None:
    """One quantity without variance, one without a value at some draws; beside the exact index of a single one."""

    def low(ball: Any) -> float:
        if ball.e > 0.5:
            raise nsmaps.NsmapsError("no value")
        return float(ball.e)

    ball, laws = Drop(g=1.0, e=0.5), {"e": (0.0, 1.0)}
    for quantity, index in ((lambda ball: 3.0, np.nan), (low, np.nan), (lambda ball: 2 * ball.e, 1.0)):
        found = nsmaps.uncertainty(ball, laws, quantity, n_draws=64, sobol=True)
        np.testing.assert_allclose(found.first_order, [[index]], atol=0.03)
        np.testing.assert_allclose(found.total_order, [[index]], atol=0.03)
        assert isinstance(found.plot(), Figure)
    for wrong in (None, [1.0, 2.0]):
        with pytest.raises(nsmaps.NsmapsError, match=message("estimation.not-a-quantity", name="speed")):
            nsmaps.uncertainty(ball, laws, {"speed": lambda ball, wrong=wrong: wrong})


def test_quantities_without_a_value_are_counted_and_wrong_distributions_refused() -> None:
    def quantity(ball: Any) -> float:
        if ball.e > 0.5:
            raise nsmaps.NsmapsError("no value")
        return float(ball.e)

    spread = nsmaps.uncertainty(Drop(g=1.0, e=0.5), {"e": (0.0, 1.0)}, quantity, n_draws=64)
    assert np.isnan(spread.values).any()
    assert np.nanmax(spread.values) <= 0.5
    assert "without a value" in str(spread)
    with pytest.raises(ParameterError, match=message("estimation.distribution", name="e", given="(1, 0)")):
        nsmaps.uncertainty(Drop(g=1.0, e=0.5), {"e": (1, 0)}, quantity)
    for law in ((0.5, 2.5), stats.uniform(-0.1, 0.2)):
        with pytest.raises(ParameterError, match=message("estimation.distribution-outside", name="r", least=0, greatest=1)):
            nsmaps.uncertainty(VIPair(d=0.35, r=0.5, g_bar=0.2), {"r": law}, lambda one: 0.0)
    with pytest.raises(nsmaps.NsmapsError, match=message("estimation.no-draw-with-value", name="quantity", number=2)):
        nsmaps.uncertainty(Drop(g=1.0, e=0.9), {"e": (0.8, 1.0)}, quantity, n_draws=2)
    with pytest.raises(ParameterError, match=message("errors.unknown", kind="parameter", name="q")):
        nsmaps.uncertainty(VIPair(d=0.35, r=0.5, g_bar=0.2), {"q": (0.0, 1.0)}, lambda one: 0.0)
    for given, laws in ({"n_draws": 0}, {"e": (0, 1)}), ({"n_draws": 10, "sobol": True}, {"e": (0, 1)}), ({}, {}):
        with pytest.raises(nsmaps.NsmapsError, match=message("estimation.draws")):
            nsmaps.uncertainty(Drop(g=1.0, e=0.5), laws, quantity, **given)


class Firing(HybridSystem):
    """x' = I - x fires at 1 and is reset to 0, with x as the coordinate: only x = 1 is on the section."""

    I: float  # noqa: E741
    states = ("x",)

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"charge": {"x": self.I - y.x}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        return {"F": Guard("charge", 1 - y.x, reset={"x": 0})}

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection("F", ("x",))


def test_a_section_of_a_single_state_is_fitted_from_its_closed_form() -> None:
    """An interval takes ln(I/(I - 1))."""
    times = np.log(1.7 / 0.7) * np.arange(12) + 0.3
    found = nsmaps.estimate(Firing(I=1.6), {"time": times, "noise": 1e-4}, free={"I": (1.2, 2.5)}, n_guesses=1)
    assert found.values[0] == pytest.approx(1.7, rel=1e-6)
