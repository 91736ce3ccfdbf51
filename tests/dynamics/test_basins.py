"""Basins against a map whose boundary is known in closed form, and orbits of the pair followed by another program."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from messages import message
from nsmaps_circle_map import CircleMap
from scipy.optimize import brentq
from systems import GearRattle

import nsmaps
from nsmaps.coordinates import Angle, Coordinates
from nsmaps.dynamics.attractors.attractor import find_attractors
from nsmaps.dynamics.attractors.basins import Basins, basin_boundary, basins
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

PHASE = Angle("phi")
X, XY, X_PHASE = (Coordinates(names) for names in (("x",), ("x", "y"), ("x", PHASE)))


@dataclass(frozen=True)
class TwoWells(ReturnMap):
    """u -> 3/2 u - u^3/2 with u = x - 0.3 cos phi, which comes to u = 1 or -1, and phi -> phi - sin(phi)/2, which comes to 0.

    The sign of u is kept up to sqrt 3 and flipped from there on, as long as its image is within sqrt 3; beyond sqrt 5 it escapes.
    """

    coordinates: Coordinates = X_PHASE

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        x, phi = start.T
        u, later = x - 0.3 * np.cos(phi), phi - np.sin(phi) / 2
        inside = np.abs(u) <= np.sqrt(5)
        image = np.column_stack([1.5 * u - u**3 / 2 + 0.3 * np.cos(later), later % (2 * np.pi)])
        outcome = np.select([np.isnan(x), ~inside], [Outcome.invalid, Outcome.escaped], Outcome.returned).astype(np.int8)
        blank = np.ones(len(x))
        turns = np.zeros(start.shape, np.int32)
        image = np.where(inside[:, None], image, np.nan)
        return Returns(self.coordinates, ("B", "T"), start, image, turns, blank.astype(int), outcome, blank)


@dataclass(frozen=True)
class Chaos(ReturnMap):
    """x -> 2 x^2 - 1 on either side of zero of a sign s, kept in y = s + x/10: two attractors without a period."""

    coordinates: Coordinates = XY

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        x, y = start.T
        nearer = np.sign(y) + (y - np.sign(y)) / 2
        image = np.column_stack([np.clip(1.9 * x**2 - 0.9, -1, 1), nearer])
        blank = np.zeros(len(x), np.int8)
        return Returns(self.coordinates, ("B",), start, image, np.zeros(start.shape, np.int32), blank + 1, blank, blank + 1.0)


def wells(points=60):
    axes = {
        "x": nsmaps.Axis(low=-1.4, high=1.3, points=points),
        "phi": nsmaps.Axis(low=0.05, high=2 * np.pi * (1 - 1 / points) + 0.05, points=points),
    }
    return nsmaps.Grid(axes=axes)


def test_labels_are_the_signs_of_the_closed_form():
    made = basins(TwoWells(), wells())
    assert {round(float(a.states[0, 0]), 5) for a in made.attractors} == {1.3, -0.7}
    assert made.fractions[0] >= made.fractions[1]
    u = made.start[:, 0] - 0.3 * np.cos(made.start[:, 1])
    above = np.array([a.states[0, 0] > 0 for a in made.attractors])
    assert np.array_equal(above[made.label], u > 0)
    assert made.fractions.sum() == pytest.approx(1)
    assert made.fractions[0] == np.mean(made.label == 0)
    f = made.fractions[0]
    assert made.fraction_error[0] == pytest.approx(np.sqrt(f * (1 - f) / 3600))
    steps, (x, phi) = 0, made.start[77]
    home = made.attractors[made.label[77]].states[0]
    while max(abs(x - home[0]), abs((phi - home[1] + np.pi) % (2 * np.pi) - np.pi)) > 1e-6:
        u, phi = x - 0.3 * np.cos(phi), phi - np.sin(phi) / 2
        x, steps = 1.5 * u - u**3 / 2 + 0.3 * np.cos(phi), steps + 1
    assert made.arrival[77] == steps


@dataclass(frozen=True)
class ThreeWells(TwoWells):
    """The same with a third coordinate z -> z/2, which the others do not feel."""

    coordinates: tuple[str, ...] = ("x", "z", PHASE)

    def first_return(self, states, derivative=False):
        start = np.asarray(states, float)
        plane = TwoWells().first_return(start[:, [0, 2]])
        image = np.column_stack([plane.image[:, 0], start[:, 1] / 2, plane.image[:, 1]])
        turns = np.zeros(start.shape, np.int32)
        return Returns(self.coordinates, ("B", "T"), start, image, turns, plane.codes, plane.outcome, plane.time)


def test_a_plane_through_three_coordinates_is_the_map_in_it():
    flat = wells(20)
    axes = flat.axes
    held = nsmaps.Grid(axes={"x": axes["x"], "z": nsmaps.Axis.at(0.7), "phi": axes["phi"]})
    assert held.shape == (20, 1, 20)
    assert list(held.varying) == ["x", "phi"]
    made, plain = basins(ThreeWells(), held), basins(TwoWells(), flat)
    assert (made.start[:, 1] == 0.7).all()
    assert np.array_equal(made.label, plain.label)
    line, other = basin_boundary(ThreeWells(), made, tolerance=1e-9), basin_boundary(TwoWells(), plain, tolerance=1e-9)
    assert np.abs(line.points[:, [0, 2]] - other.points).max() < 1e-12
    assert (line.points[:, 1] == 0.7).all()


def test_a_value_at_which_a_coordinate_is_held_is_one_point():
    with pytest.raises(ValueError, match=message("study.axis-points", low=0.0, high=1.0, number=1)):
        nsmaps.Axis(low=0, high=1, points=1)
    with pytest.raises(ValueError, match=message("study.axis-ends")):
        nsmaps.Axis(low=1, high=1, points=2)


def test_boundary_and_distance_are_those_of_the_closed_form():
    made = basins(TwoWells(), wells(160))
    line = basin_boundary(TwoWells(), made, tolerance=1e-9)
    assert np.abs(line.points[:, 0] - 0.3 * np.cos(line.points[:, 1])).max() < 2e-9
    assert sorted(np.unique(line.sides)) == [0, 1]
    assert len(line.points) > 160  # on lines both ways, and around the circle
    phi = np.linspace(-np.pi, np.pi, 200_001)
    for k, attractor in enumerate(made.attractors):
        exact = np.hypot(0.3 * np.cos(phi) - attractor.states[0, 0], phi).min()
        assert exact <= line.distance(k) + 1e-9 < exact + 0.02
    with pytest.raises(NsmapsError, match=message("dynamics.no-attractor", number=2)):
        line.distance(2)


def test_a_boundary_is_halved_to_rounding_at_most():
    made = basins(TwoWells(), wells(6))
    line = basin_boundary(TwoWells(), made, tolerance=1e-18)
    assert np.abs(line.points[:, 0] - 0.3 * np.cos(line.points[:, 1])).max() < 1e-14
    assert 0 < line.tolerance < 1e-14


def test_neighbours_are_neighbours_around_the_circle_too():
    grid, rng = wells(7), np.random.default_rng(5)
    label = rng.integers(-2, 3, 49)
    blank = np.zeros(49, np.int8)
    made = Basins(TwoWells().coordinates, grid, grid.states(), (), label, blank, blank, blank > 0)
    ends, sides = made.edges()
    table, expected = label.reshape(7, 7), []
    for i in range(7):
        for j in range(7):
            expected += [(table[i, j], table[i + 1, j])] if i < 6 else []
            expected += [(table[i, j], table[i, (j + 1) % 7])]
    expected = [(a, b) for a, b in expected if a != b and -1 not in (a, b)]
    assert sorted(map(tuple, sides.tolist())) == sorted(expected)
    apart = ends[:, 1] - ends[:, 0]
    assert np.allclose(apart[apart[:, 0] == 0, 1], 2 * np.pi / 7)
    assert np.allclose(apart[apart[:, 0] > 0, 0], 2.7 / 6)


def test_escape_flips_and_what_is_no_state_are_data():
    starts = [[0.3 + u, 0.0] for u in (0.5, 1.5, 2.0, 2.3, -2.0, np.nan)]
    made = basins(TwoWells(), starts)
    high = [a.states[0, 0] > 0 for a in made.attractors].index(True)
    assert made.label.tolist() == [high, high, 1 - high, -2, high, -2]
    assert made.outcome[[3, 5]].tolist() == [Outcome.escaped, Outcome.invalid]
    assert made.fractions[-1] == 2 / 6
    none = basins(TwoWells(), np.empty((0, 2)))
    assert none.label.shape == (0,)
    assert none.attractors == ()
    with pytest.raises(NsmapsError, match=message("dynamics.not-a-grid")):
        made.edges()


def test_too_few_returns_leave_starts_unresolved():
    known = basins(TwoWells(), wells()).attractors
    made = basins(TwoWells(), wells(), attractors=known, max_returns=3)
    assert made.attractors == known
    assert (made.label == -1).mean() > 0.9
    assert (made.arrival[made.label == -1] == 3).all()


def test_attractors_without_a_period_are_sets():
    starts = np.random.default_rng(0).uniform([-0.9, -1.5], [0.9, 1.5], (300, 2))
    made = basins(Chaos(), starts)
    assert [attractor.period for attractor in made.attractors] == [0, 0]
    side = np.array([np.sign(a.states[0, 1]) for a in made.attractors])
    assert np.array_equal(side[made.label], np.sign(starts[:, 1]))


@dataclass(frozen=True)
class InUnits(ReturnMap):
    """A map in other units of its first coordinate."""

    map: object
    unit: float

    @property
    def coordinates(self):
        return self.map.coordinates

    def first_return(self, states, derivative=False):
        made = self.map.first_return(np.asarray(states, float) / [self.unit, 1])
        return replace(made, start=np.asarray(states, float), image=made.image * [self.unit, 1])


@pytest.mark.parametrize("unit", [1e-3, 1e4])
def test_the_reach_of_an_attractor_without_a_period_has_no_unit(pair, unit):
    """Chaos beside 2:1/T: were lengths and radians compared, the first coordinate alone would count, or not at all."""
    system = pair(0.2265, r=0.25, beta=np.pi / 6)
    starts = np.random.default_rng(3).uniform([0.05, 0.0], [0.9, 2 * np.pi], (60, 2))
    one, other = basins(system, starts, max_period=16), basins(InUnits(system, unit), starts * [unit, 1], max_period=16)
    assert [a.label for a in one.attractors] == [a.label for a in other.attractors]
    assert {a.period for a in one.attractors} == {0, 2}
    assert np.array_equal(one.label, other.label)
    for a, b in zip(one.attractors, other.attractors, strict=True):
        assert a.period or b.reach == pytest.approx(a.reach, rel=1e-3)


def by_scanning(d, r, g, state, returns):
    """Speeds on the base wall of an orbit of the pair, by steps of 1e-3 and Brent's method."""

    def place(s, t, z, w):
        return z + (w - np.sin(np.pi * t) / np.pi) * s + g * s * s / 2 - (np.cos(np.pi * (t + s)) - np.cos(np.pi * t)) / np.pi**2

    v, t = state[0], state[1] / np.pi
    z, w, speeds = d / 2, -r * v, []
    while len(speeds) < returns:
        s, steps = 0.0, np.arange(1, 4001) * 1e-3
        over = np.abs(place(steps, t, z, w)) > d / 2
        first = int(np.argmax(over))
        end, wall = steps[first], np.sign(place(steps[first], t, z, w)) * d / 2
        s = brentq(lambda s, *at: place(s, *at[:3]) - at[3], end - 1e-3, end, args=(t, z, w, wall), xtol=1e-14)
        w = w - np.sin(np.pi * t) / np.pi + g * s + np.sin(np.pi * (t + s)) / np.pi
        t, z = t + s, wall
        if wall > 0:
            speeds.append(w)
        w = -r * w
    return np.array(speeds)


def test_the_bistable_pair_comes_where_another_program_says(pair):
    system = pair(0.2275, r=0.25, beta=np.pi / 6)
    axes = {"v": nsmaps.Axis(low=0.55, high=0.8, points=20), "phi": nsmaps.Axis(low=0.3, high=0.8, points=20)}
    made = nsmaps.basins(system, nsmaps.Grid(axes=axes))
    assert len(made.attractors) == 2
    two = [attractor.label for attractor in made.attractors].index("2:1/T")
    assert 0.1 < made.fractions[two] < 0.9
    quiet = np.flatnonzero(~made.stuck)
    for k in (*quiet[made.label[quiet] == two][:3], *quiet[made.label[quiet] == 1 - two][:3]):
        speeds = by_scanning(0.2275, 0.25, system.g_bar, made.start[k], 250)
        slow = np.abs(speeds[-40:] - made.attractors[two].states[:, :1]).min(axis=0).max() < 1e-3
        assert slow == (made.label[k] == two)


@pytest.mark.parametrize(("d", "most", "label"), [(0.35, 110, "1:1/T"), (0.30, 70, "1:1/2T")])
def test_every_start_of_the_paper_arrives(pair, d, most, label):
    axes = {"v": nsmaps.Axis(low=0.05, high=1.5, points=30), "phi": nsmaps.Axis(low=0, high=2 * np.pi * 29 / 30, points=30)}
    seen = []
    made = nsmaps.basins(pair(d), nsmaps.Grid(axes=axes), parallel=nsmaps.Parallel(progress=seen.append))
    assert [attractor.label for attractor in made.attractors] == [label]
    assert made.fractions.tolist() == [1, 0, 0]
    assert made.arrival.max() <= most
    assert made.stuck.any()
    assert seen == sorted(seen)
    assert seen[-1] == 1
    assert len(seen) > made.arrival.max() / 2, "progress is reported as the starts arrive"


def test_a_long_transient_is_no_attractor(pair):
    """Where the chaotic set has lost its hold, orbits stay near it for thousands of returns."""
    found = find_attractors(pair(0.225, r=0.25, beta=np.pi / 6), np.array([[0.67, 0.47], [0.08, 1.75]]), discard=100)
    assert "2:1/T" in [attractor.label for attractor in found]


def test_wrong_calls_are_errors(pair):
    many = partial(nsmaps.basins, pair(0.3))
    with pytest.raises(StateError, match=message("errors.shape", what="states have", shape="(1, 3)")):
        many([[1, 2, 3]])
    with pytest.raises(NsmapsError, match=message("exact.grid-axes", axes="phi, v")):
        many(nsmaps.Grid(axes={"phi": nsmaps.Axis(low=0, high=1, points=3), "v": nsmaps.Axis(low=0, high=1, points=3)}))
    with pytest.raises(NsmapsError, match=message("dynamics.basin-returns", number=0)):
        many([[0.8, 0.4]], max_returns=0)


@dataclass(frozen=True)
class Slow(ReturnMap):
    """x -> x + (x - x^3)/1000, which comes to 1 or -1 with the multiplier 0.998, or minus that, which comes to both in turn."""

    side: int = 1
    coordinates: Coordinates = X

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        image, slopes = self.side * (x + (x - x**3) / 1000), self.side * (1 + (1 - 3 * x**2) / 1000)
        blank = np.zeros(len(x), np.int8)
        made = Returns(self.coordinates, ("B",), x, image, np.zeros(x.shape, np.int32), blank + 1, blank, blank + 1.0)
        return replace(made, derivative=slopes[:, :, None]) if derivative else made


@pytest.mark.thorough
def test_cycles_that_attract_slowly_are_found_once():
    """Each orbit repeats within the tolerance while it is far beyond it from the cycle, and from every other orbit."""
    starts = np.random.default_rng(0).uniform(-1.5, 1.5, (30, 1))
    made = basins(Slow(), starts, max_returns=6000)
    there = np.array([a.states.item() for a in made.attractors])
    assert np.allclose(np.sort(there), [-1, 1], atol=1e-9)
    assert np.array_equal(np.sign(starts[:, 0]), np.sign(there[made.label]))
    assert 0 < (made.arrival == 6000).mean() < 1, "some are still coming"
    (both,) = basins(Slow(side=-1), starts, max_returns=6000).attractors
    assert np.allclose(np.sort(both.states[:, 0]), [-1, 1], atol=1e-9)


def test_the_rattle_has_two_attractors_where_one_attracts_slowly():
    """At eps = 0.44 the multipliers of 1:1/T are about -0.998; orbits that repeated within 1e-6 passed for 241 attractors."""
    starts = np.random.default_rng(0).uniform([0.1, 0], [14, 6.28], (60, 2))
    made = basins(GearRattle(eps=0.44), starts)
    assert {a.label for a in made.attractors} == {"1:1/T", "2:1/2T"}
    for attractor in made.attractors:
        path = nsmaps.orbit(GearRattle(eps=0.44), attractor.states[0], 60_000)
        assert np.allclose(path.states[-1], path.states[-1 - attractor.period], atol=1e-12)
        assert np.abs(path.states[-1] - attractor.states).max(axis=1).min() < 1e-8


def test_quasi_periodic_orbits_of_a_circle_map_have_one_attractor():
    """A diffeomorphism of the circle has one at most; near the rotation number 1/7 its orbits leave gaps for a long time."""
    made = basins(CircleMap(Omega=1 / 7 + 2e-5, K=0.5), np.linspace(0.1, 6.2, 12)[:, None])
    assert [(each.label, each.period) for each in made.attractors] == [("Q", 0)]
    assert (made.label == 0).all()
