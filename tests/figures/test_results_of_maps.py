"""Results of exact and reduced maps draw themselves, and their datasets have named axes."""

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from operator import attrgetter
from typing import ClassVar

import pytest
from figures.conftest import COORDINATES, COUPLED, GRID, ORDERS, WALLS, Toy
from matplotlib.figure import Figure

from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.reduced.composite.composite import PieceSpec, build_composite
from nsmaps.reduced.conditions.region import Box
from nsmaps.results import Result, dataset_of, declared_arrays
from nsmaps.symbolic.curve_iterates import second_iterate

DRAWN = {  #: the part of a study's result, and the number of its panels
    "slice": (lambda result: result.slices[0], 3),
    "track": (lambda result: result.orbits[0].track, 2),
    "domain": (lambda result: result.domains["fitted"], 1),
    "surface": (lambda result: result.surfaces["BTB"], 2),
    "composite": (attrgetter("composite"), 1),
    "partition": (attrgetter("partition"), 1),
    "strips": (attrgetter("accurate"), 1),
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


def test_a_surface_and_the_map_fitted_to_it_have_the_units_of_the_system():
    class Metres(Toy):
        units: ClassVar[Mapping[str, str]] = {"v": "m/s"}
        dimensionless = False

    family = WordFamily(name="BTB", words=("BTB",))
    surface = family.surface(Metres(), GRID)
    spec = PieceSpec(name="R1", region=Box.of(COORDINATES, [[0.5, 1], [0, 1]]), family="BTB", fit=ORDERS["poly11"])
    composite = build_composite(COORDINATES, WALLS, {"BTB": surface}, [spec])
    assert surface.restrict(surface.start[:, 0] > 0.7).units == composite.units == {"v": "m/s"}
    assert composite.plot().axes[0].get_xlabel() == "$v_{k}$ (m/s)"


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


#: parts of results that are printed with their fields
SILENT = {
    "Update",
    "AuxiliaryRegion",
    "Slab",
    "Strips",
    "ParametricReport",
    "Slope",
    "Mean",
    "Misleads",
    "Events",
    "AtBorder",
    "Agreement",
}


def results_in(value):
    """Every result in a part of a study's result, at any depth."""
    if isinstance(value, Result) and is_dataclass(value):
        yield value
        for each in fields(value):
            yield from results_in(getattr(value, each.name))
    elif isinstance(value, Mapping):
        for part in value.values():
            yield from results_in(part)
    elif isinstance(value, tuple):
        for part in value:
            yield from results_in(part)


def test_results_are_printed_in_a_line_with_their_numbers(result, stored):
    found = {type(one): one for each in (result, *stored.values()) for one in results_in(tuple(each.parts.values()))}
    assert len(found) > 35
    printed = {kind: one for kind, one in found.items() if type(one).summary is not Result.summary}
    assert len(printed) > 30
    for kind, one in printed.items():
        text = repr(one)
        assert text.startswith(f"{kind.__name__}(")
        assert str(one) == one.summary()
        assert text.count("\n") == 0
        assert len(text) < 600
        assert re.search(r"\d", text), text
        assert "array(" not in text
    silent = {kind.__name__ for kind in found} - {kind.__name__ for kind in printed}
    assert silent <= SILENT
