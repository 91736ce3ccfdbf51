"""Orbits over the pieces: what has a colour, and what is enlarged."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex

from nsmaps.dynamics.orbit import orbit
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.figures.composite.inset import inset
from nsmaps.figures.composite.orbits import orbits
from nsmaps.study.sections.longrun.orbits import OVER


def drawn(result, ax, number=0):
    """The orbits of a start over the pieces of the result."""
    return orbits(result.orbits, ax, number, over=OVER.of(result, "orbits"))


def along(result, states):
    """The result with one start, whose two orbits are the states (m, 2)."""
    pair = result.orbits[0]
    both = {name: replace(getattr(pair, name), states=states) for name in ("exact", "composite")}
    return result.with_parts({"orbits": (replace(pair, **both),)})


class Turn(ReturnMap):
    """A map of three coordinates, which it turns."""

    coordinates = ("x", "y", "z")

    def first_return(self, states, derivative=False):
        return Returns.of_map(self.coordinates, states, np.roll(states, -1, axis=1))


def test_only_pieces_that_an_orbit_visits_have_a_colour(result, ax):
    drawn(along(result, np.tile([0.7, 0.5], (41, 1))), ax)
    mesh = next(each for each in ax.collections if isinstance(each, QuadMesh))
    white = [to_hex(colour) == "#ffffff" for colour in mesh.get_cmap().colors]
    assert white == [True, False, True], "the reset, R1, R2"


@pytest.mark.parametrize(("extent", "enlarged"), [(0.05, True), (0.0, False), (0.3, False)])
def test_an_attractor_that_is_small_and_no_point_is_enlarged(result, ax, extent, enlarged):
    states = np.random.default_rng(3).uniform([0.6, 0.5], [0.6 + extent, 0.5 + extent * 10], (400, 2))
    drawn(along(result, states), ax)
    assert len(ax.child_axes) == enlarged
    for inner in ax.child_axes:
        held = zip(states[-40:].T, (inner.get_xlim(), inner.get_ylim()), strict=True)
        assert all(low < values.min() <= values.max() < high for values, (low, high) in held)


@pytest.mark.parametrize("corner", [[0, 0], [0, 1], [1, 0], [1, 1]])
def test_an_inset_lies_where_nothing_else_is(ax, corner):
    ax.set(xlim=(0, 1), ylim=(0, 1))
    name = ax.text(*np.clip(corner, 0.25, 0.75), "R")
    taken = np.random.default_rng(0).uniform(0, 1, (300, 2))
    taken = taken[(np.abs(taken - corner) > 0.6).any(axis=1)]
    ax.plot(*taken.T, "o", ls="")
    small = np.array([[0.62, 0.62], [0.7, 0.7]] if corner == [0, 0] else [[0.3, 0.3], [0.38, 0.38]])
    inner = inset(ax, small, lambda inner: None)
    ax.figure.draw_without_rendering()
    place = ax.transAxes.inverted().transform(inner.get_tightbbox().get_points())
    assert (np.abs(place.mean(axis=0) - corner) < 0.5).all()
    assert not ((taken > place[0]) & (taken < place[1])).all(axis=1).any()
    assert name not in ax.texts
    assert min(len(axis.get_ticklabels()) for axis in (inner.xaxis, inner.yaxis)) >= 2


def test_an_orbit_draws_itself_in_the_plane_and_over_the_returns(result, ax):
    pair, three = result.orbits[0], orbit(Turn(), [[0.1, 0.2, 0.3], [0.3, 0.2, 0.1]], 5)
    plane, *over = pair.exact.plot().axes
    assert plane.get_xlabel() == "$v_{k}$"
    assert [np.array_equal(each.lines[0].get_ydata(), x) for each, x in zip(over, pair.exact.states.T, strict=True)] == [True] * 2
    assert pair.plot(ax) is ax
    assert "composite map" in [line.get_label() for line in ax.lines]
    panels = three.plot(number=1).axes
    assert [axis.lines[0].get_ydata()[:2].tolist() for axis in panels] == [[0.3, 0.2], [0.2, 0.1], [0.1, 0.3]]
    assert panels[0].get_xlabel() == "return"
    assert three.to_xarray().states.dims == ("step", "start", "coordinate")
    assert pair.to_xarray().start.dims == ("coordinate",)
