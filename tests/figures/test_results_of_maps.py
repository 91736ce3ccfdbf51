"""Results of exact and reduced maps draw themselves, and their datasets have named axes."""

from operator import attrgetter

import pytest
from figures.conftest import COUPLED
from matplotlib.figure import Figure

from nsmaps.results import dataset_of, declared_arrays
from nsmaps.symbolic.curve_iterates import second_iterate

DRAWN = {  #: the part of a study's result, and the number of its panels
    "slice": (lambda result: result.slices[0], 3),
    "track": (lambda result: result.orbits[0].track, 2),
    "domain": (lambda result: result.domains["fitted"], 6),
    "composite": (attrgetter("composite"), 1),
    "near": (lambda result: result.near[0], 4),
}
ARRAYS = {  #: further results, without a picture of their own
    "returns": lambda result: result.slices[0].returns,
    "impacts": lambda result: result.orbits[0].track.impacts,
    "region": attrgetter("diagonal"),
    "envelope": lambda result: result.domains["fitted"].updates[0].envelopes[0],
    "fit": lambda result: result.composite.pieces[1].map,
    "auxiliary orbit": attrgetter("auxiliary_map"),
}


@pytest.mark.parametrize("name", DRAWN)
def test_a_result_draws_itself(result, name):
    part, panels = DRAWN[name]
    figure = part(result).plot()
    assert isinstance(figure, Figure)
    drawn = [axes for axes in figure.axes if axes.get_xlabel()]
    assert len(drawn) == panels
    assert all(axes.get_ylabel() for axes in drawn)


def test_the_second_iterate_of_a_polynomial_has_its_fixed_points(ax):
    twice = second_iterate(COUPLED, 0.2, 1.0, "min_first")
    twice.plot(ax)
    (stars,) = [line for line in ax.lines if line.get_marker() == "*"]
    (fixed,) = twice.fixed_points()  # of a composition of two lines, one
    assert stars.get_xydata().tolist() == [[fixed, fixed]]


@pytest.mark.parametrize("name", [*DRAWN, *ARRAYS])
def test_every_array_of_a_result_has_named_axes(result, name):
    pytest.importorskip("xarray")
    part = (ARRAYS.get(name) or DRAWN[name][0])(result)
    data = dataset_of(part)
    assert {axis for axis in data.dims if "axis_" in axis} == set()
    assert all(data[key].attrs["long_name"] for key in data.data_vars)
    assert len(data.data_vars) >= sum(not declared.name for _, declared, _ in declared_arrays(part))
