"""Quantifiers of attractors, of the logistic map, whose cycles of period two are known in closed form."""

import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from matplotlib.figure import Figure
from messages import message
from systems import Logistic

import nsmaps

STARTS = [[0.3], [0.4]]


def mean(states, return_map):
    return states[:, 0].mean()


def extent(states, return_map):
    return [states.min(), states.max(), return_map.r]


def cycle(r):
    """The states of the cycle of period two, from r^2 x^2 - r (r + 1) x + r + 1 = 0."""
    return (r + 1 + np.array([-1, 1]) * np.sqrt((r - 3) * (r + 1))) / (2 * r)


def test_basins_have_quantifiers_of_each_attractor():
    made = nsmaps.basins(Logistic(r=3.2), [*STARTS, [np.nan]], quantifiers={"mean": mean, "extent": extent})
    assert made.attractors[0].period == 2
    assert made.quantifiers["mean"] == pytest.approx([4.2 / 6.4], rel=1e-9)  # the sum of the roots over two
    assert made.quantifiers["extent"] == pytest.approx(np.array([[*cycle(3.2), 3.2]]), rel=1e-9)
    pytest.importorskip("xarray")
    table = made.to_xarray()
    assert table["mean"].dims == ("attractor",)
    assert table["extent"].dims == ("attractor", "extent_0")


def test_a_plane_has_quantifiers_at_each_pixel_and_draws_them():
    plane = {"r": [2.5, 3.2, 3.4], "height": [1.0, 2.0]}
    made = nsmaps.parameter_plane(
        Tall(), plane, [[0.3], [5.0]], n_returns=64, transient=2000, max_period=4, quantifiers={"mean": mean, "extent": extent}
    )
    for row, height in enumerate(plane["height"]):
        expected = height * np.array([1 - 1 / 2.5, 4.2 / 6.4, 4.4 / 6.8])
        assert made.quantifiers["mean"][row, :, 0] == pytest.approx(expected, rel=1e-9)
        assert made.quantifiers["extent"][row, 2, 0] == pytest.approx([*height * cycle(3.4), 3.4], rel=1e-9)
    assert np.isnan(made.quantifiers["mean"][..., 1]).all()  # those orbits escape
    ax = Figure().subplots()
    drawn = made.plot(ax, by="mean").collections[0].get_array()
    assert drawn.tolist() == made.quantifiers["mean"][..., 0].tolist()
    with pytest.raises(nsmaps.NsmapsError, match=message("figures.colours-of-plane", name="men")):
        made.plot(ax, by="men")


class Tall(nsmaps.PiecewiseMap):
    """The logistic map of y = height x."""

    r: float = 3.2
    height: float = 1.0
    coordinates = ("y",)

    def pieces(self, x):
        return {"A": (True, {"y": self.r * x.y * (1 - x.y / self.height)})}


def test_attractors_over_a_parameter_have_quantifiers():
    how = {"n_samples": 5, "n_kicks": 2, "n_directions": 2, "n_states": 1, "step": 1.0}
    made = nsmaps.global_continuation(Logistic(), "r", [3.2, 3.4], {"x": (0.1, 0.9)}, **how, quantifiers={"mean": mean})
    assert made.quantifiers["mean"] == pytest.approx(np.array([[4.2 / 6.4], [4.4 / 6.8]]), rel=1e-9)
    ax = made.plot(Figure().subplots(), quantity="mean")
    assert ax.get_ylabel() == "mean"
    assert len(made.plot().axes) == 4


def test_processes_receive_functions_of_modules():
    plane, how = {"r": [2.5, 3.2], "height": [1.0, 2.0]}, {"n_returns": 64, "transient": 1000, "max_period": 4}
    with ProcessPoolExecutor(1, get_context("fork")) as executor:
        parallel = nsmaps.Parallel(executor=executor)
        made = nsmaps.parameter_plane(Tall(), plane, [0.3], **how, quantifiers={"mean": mean}, parallel=parallel)
        assert made.quantifiers["mean"][1, 1, 0] == pytest.approx(2 * 4.2 / 6.4)
        with pytest.raises(
            nsmaps.NsmapsError, match=message("parallel.quantifier-not-sent", name="m", function=re.compile(".*<lambda>.*"))
        ):
            nsmaps.parameter_plane(
                Tall(), plane, [0.3], **how, quantifiers={"m": lambda states, return_map: 1.0}, parallel=parallel
            )


@pytest.mark.parametrize(
    ("quantifiers", "text"),
    [
        (
            {"mean": lambda states: 1.0},
            message("dynamics.quantifier-raises", name="mean", error="TypeError", shape="(2, 1)"),
        ),
        ({"mean": lambda states, return_map: "high"}, message("dynamics.quantifier-returns", name="mean", value="'high'")),
        (
            {"mean": lambda states, return_map: [[1.0], [2.0, 3.0]]},
            message("dynamics.quantifier-raises", name="mean", error="ValueError"),
        ),
        ({"mean": 3}, message("dynamics.quantifier", name="mean", given=3)),
        ({"label": mean}, message("dynamics.quantifier-taken", name="label", result="Basins")),
        ({"a mean": mean}, message("dynamics.quantifier-name", name="a mean")),
    ],
)
def test_what_is_not_a_quantifier_is_refused(quantifiers, text):
    with pytest.raises(nsmaps.NsmapsError, match=text):
        nsmaps.basins(Logistic(r=3.2), STARTS, quantifiers=quantifiers)


def test_pixels_that_are_continued_have_those_of_their_own_cycles():
    values, heights = np.linspace(2.3, 2.7, 19), np.linspace(1.0, 2.0, 19)
    how = {"n_returns": 16, "transient": 200, "max_period": 4, "refine": 8}
    made = nsmaps.parameter_plane(Tall(), {"r": values, "height": heights}, [0.3], **how, quantifiers={"mean": mean})
    assert 0 < made.computed.mean() < 0.9
    assert made.quantifiers["mean"][..., 0] == pytest.approx(heights[:, None] * (1 - 1 / values), rel=1e-9)


def test_values_have_one_shape():
    plane, how = {"r": [2.5, 3.2], "height": [1.0]}, {"n_returns": 64, "transient": 1000, "max_period": 4}
    with pytest.raises(nsmaps.NsmapsError, match=message("dynamics.quantifier-shapes", name="all", first="(1,)", second="(2,)")):
        nsmaps.parameter_plane(Tall(), plane, [0.3], **how, quantifiers={"all": lambda states, return_map: states[:, 0]})
