"""The distance of a motion from the boundary of its basin, of a map whose basins are known."""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.estimation import Record, basin_distance
from nsmaps.exact.systems.guards import Guard, PoincareSection
from nsmaps.exact.systems.hybrid import HybridSystem


class Bistable(HybridSystem):
    """A ball on a driven plate: speeds from 4 e on come nearer to 3 by the factor e at each impact, lower ones to 1."""

    e: float

    states = ("z", "v")

    def modes(self, t: Any, y: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
        return {"flight": {"z": y.v, "v": -2}}

    def guards(self, t: Any, y: SimpleNamespace) -> Mapping[str, Guard]:
        near = {end: {"v": end + self.e * (-y.v - end)} for end in (1, 3)}
        high = -y.v - 4 * self.e
        return {
            "high": Guard("flight", y.z, reset=near[3], where=(high,)),
            "low": Guard("flight", y.z, reset=near[1], where=(-high,)),
        }

    def section(self, t: Any, y: SimpleNamespace) -> PoincareSection:
        return PoincareSection(("high", "low"), ("v",), side="after")


@pytest.mark.thorough
def test_the_boundary_of_a_basin_and_its_spread_are_those_of_the_closed_form() -> None:
    """The record ends on v = 3, at the distance 3 - 4 e of the boundary, whose spread is that of the estimate of e."""
    system, rng = Bistable(e=0.5), np.random.default_rng(0)
    speeds = 3 - 0.9 * 0.5 ** np.arange(9)
    record = Record.of(samples={"v": speeds + 0.01 * rng.standard_normal(9)}, sample_noise=0.01)
    found = nsmaps.estimate(system, record, free={"e": (0.2, 0.7)}, guess={"e": 0.45}, n_guesses=1)
    assert abs(found.values[0] - 0.5) < 4 * found.errors[0]
    margin = basin_distance(system, found, directions=[[1.0], [-1.0]], n_draws=6)
    assert margin.state[0] == pytest.approx(3.0)
    assert margin.distances[0] == np.inf
    assert margin.distances[1] * margin.unit[0] == pytest.approx(3.0 - 4 * found.values[0], rel=1e-3)
    np.testing.assert_allclose(margin.points[1], 4 * found.values, rtol=1e-3)
    np.testing.assert_allclose(margin.least * margin.unit[0], 3.0 - 4 * margin.draws[:, 0], rtol=1e-3)
    assert margin.share == (1.0, 0.0)
    assert "this motion in 100 +- 0 % of 6 draws; sampled" in str(margin)
    assert isinstance(margin.plot(), Figure)
    with pytest.raises(NsmapsError, match=message("errors.shape", what="directions have", shape="(1, 2)", expected="(D, 1)")):
        basin_distance(system, found, directions=[[1.0, 0.0]])
