"""Attractors along a parameter against maps whose basins, distances, return times and folds have closed forms."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from math import ceil, log, pi, sqrt

import numpy as np
import pytest
from messages import message
from scipy.optimize import brentq
from test_hybrid_public import PLANAR

import nsmaps
from nsmaps.coordinates import Angle, Coordinates
from nsmaps.dynamics.attractors.kicks import Kicks, nonlocal_stability
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns

EDGE = 2 / (3 * sqrt(3))  #: of the cubic: the value of p at the folds
FOLD = 0.227713761  #: of 2:1/T of the pair; see test_branch.py
X, X_PHASE = (Coordinates(names) for names in (("x",), ("x", Angle("phi"))))


def returns_of(coordinates, start, image):
    """Returns that end where an image is NaN, without a state where the start is."""
    outcome = np.where(np.isnan(image).any(axis=1), Outcome.escaped, Outcome.returned)
    outcome = np.where(np.isnan(start).any(axis=1), Outcome.invalid, outcome).astype(np.int8)
    blank = np.ones(len(start))
    return Returns(coordinates, ("B", "T"), start, image, np.zeros(start.shape, np.int32), blank.astype(int), outcome, blank)


@dataclass(frozen=True)
class Jump(ReturnMap):
    """x -> -1 + (x + 1)/2 below b, 1 + (x - 1)/4 from there on, in each of n coordinates; beyond 3 there is no image."""

    b: float
    coordinates: Coordinates = X

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        image = np.where(x < self.b, -1 + (x + 1) / 2, 1 + (x - 1) / 4)
        return returns_of(self.coordinates, x, np.where((np.abs(x) > 3).any(axis=1, keepdims=True), np.nan, image))


@dataclass(frozen=True)
class Cubic(ReturnMap):
    """y + 0.3 (y - y^3 + p) with y = x up to 1.2 in size; its fixed points meet at |p| = EDGE; refused for p from 0.1 to 0.15.

    It is monotone, so that the fixed point between two others is the boundary.
    """

    p: float
    coordinates: Coordinates = X

    def __post_init__(self):
        if 0.1 < self.p < 0.15:
            raise NsmapsError(f"p is {self.p:g}")

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        y = np.clip(x, -1.2, 1.2)
        return returns_of(self.coordinates, x, y + 0.3 * (y - y**3 + self.p))

    @property
    def fixed(self):
        """The real fixed points in ascending order."""
        roots = np.roots([-1, 0, 1, self.p])
        return np.sort(roots[np.abs(roots.imag) < 1e-9].real)


@dataclass(frozen=True)
class Wells(ReturnMap):
    """u -> 3/2 u - u^3/2, u = x - c cos phi up to 1.2 in size, to 1 or -1 by the sign of u; phi -> phi - sin(phi)/2, to 0."""

    c: float
    coordinates: Coordinates = X_PHASE

    def first_return(self, states, derivative=False):
        x, phi = np.asarray(states, float).T
        u, later = np.clip(x - self.c * np.cos(phi), -1.2, 1.2), phi - np.sin(phi) / 2
        image = np.column_stack([1.5 * u - u**3 / 2 + self.c * np.cos(later), later % (2 * pi)])
        return returns_of(self.coordinates, np.column_stack([x, phi]), image)


BOX = {"x": (-1.2, 1.2)}


@pytest.mark.parametrize("side", [1.0, 3.5])
def test_a_timed_kick_is_a_share_of_the_box_and_the_reach_one_of_the_map_s_scale(side):
    box = {"x": (-1 - side / 2, -1 + side / 2)}
    made = nsmaps.global_continuation(Jump, "b", [1.0], box, n_samples=20, max_returns=100, kick=0.01, n_kicks=10)
    (attractor,) = [each for each in made.attractors if each.states[0, 0] < 0]
    assert made.return_time[0, 0] == ceil(log(0.01 * side / (1e-6 * attractor.scale[0])) / log(2))


def test_share_distance_and_return_time_of_a_map_with_a_known_boundary():
    values = [-0.5, 0.25]
    made = nsmaps.global_continuation(
        Jump, "b", values, {"x": (-2, 2)}, n_samples=2000, max_returns=200, scale=1.0, kick=0.1, n_kicks=20
    )
    assert made.share.shape == (2, 2)
    left = int(made.attractors[made.index[0, 0]].states[0, 0] > 0)  # the number of the attractor at -1
    for v, b in enumerate(values):
        exact = {left: ((b + 2) / 4, b + 1, 0.5), 1 - left: ((2 - b) / 4, 1 - b, 0.25)}
        for number, (share, distance, multiplier) in exact.items():
            assert made.share_error[v, number] == pytest.approx(sqrt(share * (1 - share) / 2000), rel=0.1)
            assert abs(made.share[v, number] - share) < 4 * made.share_error[v, number]
            if distance > 1:  # kicks up to the scale are tried
                assert made.distance[v, number] == np.inf
            else:
                assert distance <= made.distance[v, number] <= distance * 1.001
            attractor = made.attractors[made.index[v, number]]
            returns = ceil(log(0.1 / (attractor.reach * attractor.scale[0])) / log(1 / multiplier))
            assert made.return_time[v, number] == pytest.approx(returns, abs=1)
            assert made.returned[v, number] == 1
    assert made.changes == ()


def test_kicks_that_arrive_nowhere_in_time_say_nothing():
    attractors = nsmaps.basins(Jump(0.0), [[-0.5], [0.5]], max_returns=100).attractors
    found = nonlocal_stability(Jump(0.0), attractors, Kicks(0.1, 5, 2, 1, 0), np.ones(1), returns=1)
    assert np.isnan([found.distance, found.return_time, found.return_error]).all()
    assert found.returned.tolist() == [0, 0]


def test_in_any_number_of_coordinates():
    names = ("x", "y", "z")
    made = nsmaps.global_continuation(
        partial(Jump, coordinates=names),
        "b",
        [0.0],
        [(-2, 2)] * 3,
        n_samples=400,
        max_returns=60,
        scale=1.6,
        n_directions=20,
        n_kicks=9,
    )
    assert made.share.shape == (1, 8)
    assert made.share.sum() == pytest.approx(1)
    assert (np.abs(made.share - 1 / 8) < 4.5 * made.share_error).all()
    assert (made.distance >= 1 / 1.6).all()  # in a direction of one coordinate
    assert np.isfinite(made.distance).all()
    assert (made.distance < 1).all()
    assert (made.returned == 1).all()


def test_the_distance_is_the_least_over_the_directions():
    region, scale = [(-2, 2), (0, 2 * pi)], np.array([4, 2 * pi])
    made = nsmaps.global_continuation(Wells, "c", [0.3], region, n_samples=500, n_directions=12, n_kicks=10)
    for number in range(2):
        x, phi = made.attractors[made.index[0, number]].states[0]

        def u(size, ray, x=x, phi=phi):
            return x + size * ray[0] - 0.3 * np.cos(phi + size * ray[1])

        rays = [scale * (np.cos(a), np.sin(a)) for a in 2 * pi * np.arange(12) / 12]
        crossing = [brentq(u, 0, 0.7, args=(ray,)) for ray in rays if u(0, ray) * u(0.7, ray) < 0]
        assert made.distance[0, number] == pytest.approx(min(crossing), rel=1.01e-3)
        assert made.distance[0, number] >= min(crossing)


def test_attractors_are_matched_through_folds_and_over_refused_values():
    values = np.linspace(-0.48, 0.48, 17)
    made = nsmaps.global_continuation(
        Cubic, "p", values[::-1], {"x": (-1.2, 1.2)}, n_samples=300, max_returns=400, n_kicks=4, step=0.2
    )
    step = values[1] - values[0]
    assert np.array_equal(made.values, values)
    refused = [v for v, reason in enumerate(made.reasons) if reason]
    assert [made.reasons[v] for v in refused] == [f"p is {values[v]:g}" for v in refused]
    assert values[refused] == pytest.approx(values[(values > 0.1) & (values < 0.15)])
    assert not made.found[refused].any()
    birth, death = made.changes
    assert (birth.kind, birth.attractor, death.kind, death.attractor) == ("birth", 1, "death", 0)
    assert birth.low < -EDGE < birth.high == pytest.approx(birth.low + step)
    assert death.low < EDGE < death.high == pytest.approx(death.low + step)
    for v in set(range(17)) - set(refused):
        fixed = Cubic(values[v]).fixed
        own = [made.attractors[k].states.item() for k in made.index[v] if k >= 0]
        assert own == pytest.approx(fixed[::2] if len(fixed) == 3 else fixed, abs=1e-3)
        if len(fixed) == 3:
            low = (fixed[1] + 1.2) / 2.4
            assert abs(made.share[v, 0] - low) < 4 * sqrt(low * (1 - low) / 300)
            assert made.distance[v] == pytest.approx(np.abs(fixed[1] - fixed[::2]) / 2.4, rel=2e-3)
        else:
            assert made.distance[v, np.isfinite(made.share[v])] == [np.inf]


@pytest.mark.thorough
def test_an_attractor_whose_basin_has_no_start_is_followed():
    values = np.linspace(-0.3, 0.35, 8)
    few = nsmaps.global_continuation(
        Cubic, "p", values, {"x": (-0.2, 1.2)}, n_samples=4, max_returns=400, scale=2.4, n_kicks=2, rng=3
    )
    held = [not reason for reason in few.reasons]
    assert few.found[held].all()
    assert few.share[:, 0][held][-1] == 0
    assert few.distance[:, 0][held] == pytest.approx(
        [(fixed[1] - fixed[0]) / 2.4 for fixed in (Cubic(p).fixed for p in values[held])], rel=2e-3
    )


def test_the_window_of_the_pair_with_two_attractors(pair):
    made = nsmaps.global_continuation(
        partial(pair, r=0.25, beta=pi / 6),
        "d",
        [0.2272, 0.2280],
        [(0.05, 1.2), (0, 2 * pi)],
        n_samples=60,
        max_returns=1500,
        n_kicks=8,
        n_states=2,
    )
    both = {str(label) for label in made.labels[0]}
    assert "2:1/T" in both
    assert len(both) == 2
    number = int(np.flatnonzero(made.labels[0] == "2:1/T").item())
    (death,) = [change for change in made.changes if change.attractor == number]
    assert (death.kind, death.label) == ("death", "2:1/T")
    assert death.low < FOLD < death.high
    assert 0 < made.distance[0, number] < 1
    assert 0.01 < made.share[0, number] < 0.99
    attractor, size = made.attractors[made.index[0, number]], made.distance[0, number]
    angle = 2 * pi * np.arange(16) / 16
    kicks = size * np.column_stack([np.cos(angle), np.sin(angle)]) * made.scale
    ends = [nsmaps.orbit(pair(0.2272, r=0.25, beta=pi / 6), state + kicks, 3000).final for state in attractor.states]
    near = np.abs(np.concatenate(ends)[:, None] - attractor.states).max(axis=2).min(axis=1) < 1e-3
    assert not near.all()  # a kick of this size leads elsewhere


def test_a_system_with_modes():
    region = {"v": (0.6, 0.85), "phi": (1.2, 1.45)}
    made = nsmaps.global_continuation(
        PLANAR, "w", [0.8, 0.8004], region, n_samples=6, max_returns=400, n_kicks=4, n_directions=4, n_states=1
    )
    end = nsmaps.orbit(PLANAR, [0.72, 1.32], 400).final
    assert made.share[0].max() == 1
    attractor = made.attractors[made.index[0, int(made.share[0].argmax())]]
    assert np.abs(attractor.states - end).max(axis=1).min() < 1e-4
    assert made.share.shape == (2, 1)
    assert (made.return_time > 1).all()


@pytest.mark.thorough
def test_parts_elsewhere_and_kept_give_the_same_digits(tmp_path):
    def run(parallel):
        return nsmaps.global_continuation(
            Cubic, "p", [-0.2, 0.12, 0.2], BOX, n_samples=60, max_returns=500, n_kicks=4, parallel=parallel
        )

    alone, again = run(nsmaps.Parallel()), run(nsmaps.Parallel(checkpoint=tmp_path))
    files = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("part-*.npz")}
    assert len(files) == 3 + 2
    with ProcessPoolExecutor(1) as pool:
        elsewhere = run(nsmaps.Parallel(executor=pool))
    read = run(nsmaps.Parallel(checkpoint=tmp_path))
    assert {file: file.stat().st_mtime_ns for file in tmp_path.rglob("part-*.npz")} == files
    for other in (again, elsewhere, read):
        assert other.reasons == alone.reasons
        for name in ("share", "distance", "return_time", "return_error", "returned", "index"):
            assert np.array_equal(getattr(other, name), getattr(alone, name), equal_nan=True)


@pytest.mark.parametrize("calls", [2, 5])
def test_what_was_finished_before_ctrl_c_is_kept(calls):
    told = []

    def stop(fraction):
        told.append(fraction)
        if len(told) == calls:
            raise KeyboardInterrupt

    values = [-0.2, 0.0, 0.2]
    with pytest.raises(nsmaps.Interrupted) as stopped:
        nsmaps.global_continuation(
            Cubic, "p", values, BOX, n_samples=60, max_returns=500, n_kicks=4, parallel=nsmaps.Parallel(progress=stop)
        )
    made = stopped.value.result
    assert told == sorted(told)
    computed = [not reason for reason in made.reasons]
    assert any(computed)
    assert np.nansum(made.share, axis=1)[computed] == pytest.approx(1)
    assert all(computed) == (calls == 5)
    assert np.isnan(made.distance).any()
    assert np.isfinite(made.distance).any() == (calls == 5)


def test_the_dataset_has_every_quantity():
    pytest.importorskip("xarray")
    made = nsmaps.global_continuation(Cubic, "p", [-0.5, 0.0], BOX, n_samples=60, max_returns=300, n_kicks=4)
    table = made.to_xarray()
    assert dict(table.sizes) == {"p": 2, "attractor": 2, "coordinate": 1, "end": 2}
    assert table["p"].values.tolist() == [-0.5, 0.0]
    assert table["period"].values.tolist() == [[-1, 1], [1, 1]] or table["period"].values.tolist() == [[1, -1], [1, 1]]
    assert np.array_equal(table["distance"], made.distance, equal_nan=True)
    assert table["share"].sum("attractor").values == pytest.approx(1)


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"values": [np.nan]}, NsmapsError, message("errors.shape", what="the values have", shape="(1,)")),
        ({"values": [0.11, 0.12]}, NsmapsError, message("dynamics.no-map", number=2, value=0.11, reason="p is 0.11")),
        ({"box": {"y": (0, 1)}}, StateError, message("coordinates.box-foreign", given="y", name="y")),
        ({"n_samples": 0}, NsmapsError, message("dynamics.samples", number=0)),
        ({"step": 0.0}, NsmapsError, message("dynamics.samples", step=0.0)),
        ({"scale": [-1.0]}, NsmapsError, message("dynamics.scale", scale="[-1.0]")),
        ({"kick": 0.0}, NsmapsError, message("dynamics.kicks", size=0.0)),
        ({"n_directions": 0}, NsmapsError, message("dynamics.kicks", directions=0)),
    ],
)
def test_arguments_that_are_not_valid(change, error, text):
    with pytest.raises(error, match=text):
        nsmaps.global_continuation(Cubic, "p", **{"values": [0.0], "box": {"x": (-1, 1)}, "n_samples": 9, **change})
