"""Results over parameters draw themselves and know the names of their axes."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import nsmaps

pytest.importorskip("xarray")
START = [0.8, 0.4]
PLANE = {"d": [0.3, 0.32, 0.34], "r": [0.5, 0.6]}


@cache
def pair() -> nsmaps.System:
    """The impact pair, whose parameters have units."""
    return nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113275192854541)


RESULTS: dict[str, tuple[Callable[[], Any], tuple[str, ...]]] = {
    "lyapunov": (lambda: nsmaps.lyapunov(pair(), "d", [0.26, 0.3], START, n_returns=64, transient=20), ("d",)),
    "bifurcation": (
        lambda: nsmaps.bifurcation_diagram(
            pair(), "d", [0.34, 0.35, 0.36, 0.37], START, n_returns=6, transient=200, borders=True
        ),
        ("d",),
    ),
    "plane": (
        lambda: nsmaps.parameter_plane(pair(), PLANE, START, n_returns=64, transient=200, observables=["loss"]),
        ("d", "r"),
    ),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_draws_itself_with_the_names_of_its_axes(name: str) -> None:
    make, parameters = RESULTS[name]
    result = make()
    figure, ax = result.plot(), Figure().add_subplot()
    assert isinstance(figure, Figure)
    assert result.plot(ax) is ax
    labels = [text for each in figure.axes for text in (each.get_xlabel(), each.get_ylabel())]
    for parameter in parameters:
        assert f"${parameter}$" in labels
    made = result.to_xarray()
    dims = [str(dim) for array in made.variables.values() for dim in array.dims]
    assert dims
    assert not [dim for dim in dims if dim.startswith("axis_") or dim[:1].isupper()]
    for parameter in parameters:
        assert np.array_equal(made[parameter], dict(zip(parameters, values_of(result), strict=True))[parameter])
        assert made[parameter].units == "1"


def values_of(result: Any) -> tuple[Any, ...]:
    """The values of the parameters of a result."""
    return (result.along, result.across) if hasattr(result, "along") else (result.values,)
