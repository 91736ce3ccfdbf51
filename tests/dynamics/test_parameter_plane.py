"""Charts of two parameters against closed forms, single sweeps and orbits; killed, refined, with refused parameters."""

import multiprocessing
import os
import signal
from functools import partial
from math import pi
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from messages import message
from systems import BouncingBall

import nsmaps
from nsmaps.dynamics.limits import settled
from nsmaps.dynamics.planes import parameter_plane as module
from nsmaps.dynamics.planes.quadtree import refined
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.flows import tables
from nsmaps.exact.outcome import Outcome

PAIR = nsmaps.load_system("vi_pair", d=0.3, g_bar=0.2113275192854541)
BISTABLE = nsmaps.load_system("vi_pair", d=0.2265, r=0.25, M=0.1245, g=9.8, beta=np.pi / 6, F=5)
PLANE = {"d": np.linspace(0.22, 0.36, 8), "r": np.linspace(0.4, 0.6, 8)}
STARTS = [[0.8, 0.4], [0.2, 3.0]]
ARRAYS = ("motion", "attractor", "exponent", "outcome", "state", "means", "refused", "computed")


def same(one: Any, other: Any, names: tuple[str, ...] = ARRAYS) -> bool:
    """Whether two planes hold the same bytes."""
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return one.motions == other.motions and all(a.dtype == b.dtype and a.tobytes() == b.tobytes() for a, b in pairs)


@pytest.fixture(scope="module")
def made() -> Any:
    """A plane of 8 x 8 pixels and two starts."""
    return nsmaps.parameter_plane(PAIR, PLANE, STARTS, n_returns=300, transient=1500)


def test_fixed_points_of_the_bouncing_ball_attract_between_their_fold_and_their_doubling() -> None:
    """Their impacts have the speed 2 pi/(1 + e), their multipliers the product e^2 and the sum 1 + e^2 - (1 + e)^2 s.

    Here s^2 = a^2 - (pi (1 - e)/(1 + e))^2.
    """
    drives, es = np.linspace(0.9, 2.5, 9), np.linspace(0.41, 0.61, 5)
    found = nsmaps.parameter_plane(
        BouncingBall(a=1.2, r=0.5),
        {"a": drives, "r": es},
        [4.0, 1.0],
        n_returns=64,
        transient=3000,
        max_period=16,
        observables=["loss"],
    )
    for i, e in enumerate(es):
        fold = pi * (1 - e) / (1 + e)
        s = np.emath.sqrt(drives**2 - fold**2)
        total = 1 + e * e - (1 + e) ** 2 * s
        root = np.emath.sqrt(total**2 / 4 - e * e)
        largest = np.maximum(np.abs(total / 2 + root), np.abs(total / 2 - root))
        stable = (largest < 1) & (drives > fold)
        fixed = found.labels[i, :, 0] == "1:0/T"
        sure = np.abs(largest - 1) > 0.02
        assert (fixed == stable)[sure & fixed].all()
        assert fixed[stable & sure].sum() >= 2
        assert np.allclose(found.exponent[i, fixed, 0], np.log(largest[fixed]), atol=1e-6)
        assert np.allclose(found.means[i, fixed, 0, 0], (1 - e * e) / 2 * (2 * pi / (1 + e)) ** 2, rtol=1e-6)


def test_pixels_are_those_of_single_orbits(made: Any) -> None:
    for i, j in ((0, 0), (2, 3), (4, 7), (7, 5)):
        system = PAIR.at(d=PLANE["d"][j], r=PLANE["r"][i])
        sweep = nsmaps.bifurcation_diagram(lambda d, s=system: s.at(d=d), "d", [system.d], STARTS, n_returns=64, transient=1736)
        assert made.labels[i, j].tolist() == sweep.labels[0].tolist()
        assert made.period[i, j].tolist() == sweep.period[0].tolist()
        assert np.array_equal(made.state[i, j], sweep.states[0, :, -1])
        for s in range(2):
            if period := int(made.period[i, j, s]):
                cycle = nsmaps.periodic_orbit(system, sweep.states[0, s, -period:], period)
                assert made.exponent[i, j, s] == pytest.approx(np.log(np.abs(cycle.multipliers).max()) / period, abs=1e-4)
                assert sorted(cycle.words) == sorted(made.words[i, j, s].split())


def test_the_exponent_of_chaos_is_that_of_a_long_orbit(made: Any) -> None:
    chaos = np.argwhere(made.period[..., 0] == 0)
    assert len(chaos) > 2
    i, j = max(chaos.tolist(), key=lambda place: made.exponent[place[0], place[1], 0])
    exact = nsmaps.lyapunov(PAIR.at(d=PLANE["d"][j], r=PLANE["r"][i]), starts=made.state[i, j, 0], n_returns=20_000)
    assert made.exponent[i, j, 0] == pytest.approx(exact.exponents[0], abs=0.1)
    assert made.exponent[i, j, 0] > 0.1


def test_what_repeats_to_the_last_bit_is_not_computed_and_has_the_same_numbers(made: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr(settled, "_repeating", lambda states: states[:0])
    whole = nsmaps.parameter_plane(PAIR, PLANE, STARTS, n_returns=300, transient=1500)
    assert whole.n_returns == 64 * 2 * 1800
    assert made.n_returns < 0.7 * whole.n_returns
    assert same(made, whole)


@pytest.mark.parametrize("way", ["up", "down", "both"])
def test_rows_that_are_followed_are_bifurcation_diagrams(way: Any) -> None:
    found = nsmaps.parameter_plane(PAIR, PLANE, STARTS, n_returns=64, transient=500, direction=way)
    for i in (0, 7):
        row = PAIR.at(r=PLANE["r"][i])
        sweep = nsmaps.bifurcation_diagram(
            lambda d, s=row: s.at(d=d), "d", PLANE["d"], STARTS, n_returns=64, transient=500, direction=way
        )
        assert np.array_equal(found.state[i], sweep.states[:, :, -1])
        assert found.labels[i].tolist() == sweep.labels.tolist()


def test_two_motions_coexist_where_two_starts_find_them() -> None:
    attractors = nsmaps.basins(BISTABLE, np.random.default_rng(0).uniform([0.1, 0], [1, 6], (40, 2)), max_returns=300).attractors
    starts = [attractors[0].states[0], attractors[1].states[0], attractors[0].states[0] + 1e-3]
    found = nsmaps.parameter_plane(BISTABLE, {"d": [0.2265, 0.34], "r": [0.25, 0.26]}, starts, n_returns=64, transient=2000)
    assert found.counts[0, 0] == 2
    assert found.attractor[0, 0].tolist() == [0, 1, 0]
    assert found.labels[0, 0, :2].tolist() == [attractors[0].label, attractors[1].label]
    assert found.counts[0, 1] == 1
    assert set(found.labels[:, 1].ravel().tolist()) == {"1:1/T"}
    seen = [set(found.labels[i, j].tolist()) for i in (0, 1) for j in (0, 1)]
    assert found.shares() == {name: sum(name in each for each in seen) / 4 for name in set().union(*seen)}


class Edge(nsmaps.ImpactSystem):
    """The bouncing ball with gravity 1/p, a formula that fails at p = 0."""

    a: float
    p: float
    r: float

    def walls(self) -> Any:
        return {"B": nsmaps.Wall(at=0, side=-1)}

    def period(self) -> Any:
        return 2 * sp.pi

    def displacement(self, t: Any, hit: SimpleNamespace) -> Any:
        s = t - hit.t
        return (
            hit.z + (hit.w + self.a * sp.cos(hit.t)) * s - self.p * s**2 / (2 * self.p**2) - self.a * (sp.sin(t) - sp.sin(hit.t))
        )


def test_refused_parameters_are_counted_and_never_an_error() -> None:
    found = nsmaps.parameter_plane(PAIR, {"d": [-0.1, 0.3, 0.35], "r": [0.5, 1.5]}, [0.8, 0.4], n_returns=64, transient=300)
    assert found.refused.tolist() == [[True, False, False], [True] * 3]
    assert "greater than 0" in found.reason
    assert (found.outcome[found.refused] == Outcome.invalid).all()
    assert (found.period[found.refused] == -1).all()
    assert np.isnan(found.exponent[found.refused]).all()
    fails = nsmaps.parameter_plane(
        Edge(a=1.2, p=1.0, r=0.5), {"p": [0.0, 1.0], "a": [1.0, 1.2]}, [4.0, 1.0], n_returns=64, transient=100
    )
    assert fails.refused.tolist() == [[True, False], [True, False]]
    with pytest.raises(NsmapsError, match=message("dynamics.no-map-in-plane-greater", number=4, bound=0)):
        nsmaps.parameter_plane(PAIR, {"d": [-0.2, -0.1], "r": [0.5, 0.6]}, [0.8, 0.4], n_returns=64, transient=300)


def test_means_are_those_of_long_orbits() -> None:
    """Of cycles over a period, of chaos over the returns of the plane, of orbits that end none."""
    plane = {"d": [0.26, 0.35], "r": [0.5, 1.5]}
    found = nsmaps.parameter_plane(
        PAIR, plane, [[0.8, 0.4], [np.nan, 0]], n_returns=2000, transient=1000, observables=["loss", "impacts"]
    )
    assert found.observables == ("loss", "impacts")
    for j, d in enumerate(plane["d"]):
        long = nsmaps.observe(PAIR.at(d=d, r=0.5), found.state[0, j, 0], ["loss", "impacts"], n_returns=50_000)
        near = 1e-9 if found.period[0, j, 0] else 0.03
        assert np.allclose(found.means[0, j, 0], long.per_period.value, rtol=near)
    assert found.period[0, :, 0].tolist() == [0, 1]
    assert np.isnan(found.means[:, :, 1]).all()
    assert np.isnan(found.means[1]).all()


def test_an_orbit_that_ends_says_how() -> None:
    found = nsmaps.parameter_plane(
        PAIR, {"d": [0.3, 0.35], "r": [0.5, 0.6]}, [[0.8, 0.4], [np.nan, 0.0]], n_returns=64, transient=100
    )
    assert (found.outcome[..., 1] == Outcome.invalid).all()
    assert (found.motion[..., 1] == -1).all()
    assert (found.counts == 1).all()


def _killed(folder: Path) -> None:
    """A plane whose process dies after two parts."""
    shares: list[float] = []

    def kill(share: float) -> None:
        shares.append(share)
        if len(shares) == 2:
            os.kill(os.getpid(), signal.SIGKILL)

    module.PART = 1800 * 10
    nsmaps.parameter_plane(
        PAIR, PLANE, STARTS, n_returns=300, transient=1500, parallel=nsmaps.Parallel(checkpoint=folder, progress=kill)
    )


def test_a_chart_that_was_killed_goes_on_with_the_same_bytes(made: Any, tmp_path: Path, monkeypatch: Any) -> None:
    process = multiprocessing.get_context("fork").Process(target=_killed, args=(tmp_path,))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL
    kept = {file: file.stat().st_mtime_ns for file in tmp_path.glob("part-*.npz")}
    assert len(kept) == 2
    (tmp_path / "part-000002.npz").write_bytes(next(iter(kept)).read_bytes()[:100])  # cut off, as by a full disk
    monkeypatch.setattr(module, "PART", 1800 * 10)
    assert same(
        nsmaps.parameter_plane(PAIR, PLANE, STARTS, n_returns=300, transient=1500, parallel=nsmaps.Parallel(checkpoint=tmp_path)),
        made,
    )
    assert {file: file.stat().st_mtime_ns for file in kept} == kept, "they were read"
    assert len(list(tmp_path.glob("part-*.npz"))) == 13


def test_a_picture_is_refined_where_it_changes() -> None:
    """A disc and a thin line that begins beside a pixel of the coarse grid: each border is followed to its end."""
    y, x = np.mgrid[:130, :177]
    kinds = np.where((x - 60) ** 2 + (y - 70) ** 2 < 900, 1, 0)
    kinds[64, 100:170] = 2
    asked: list[int] = []

    def of(pixels: Any) -> Any:
        assert (np.diff(pixels) > 0).all()
        asked.extend(pixels.tolist())
        return kinds.ravel()[pixels]

    found = refined(kinds.shape, 16, of)
    assert np.array_equal(kinds.ravel()[found.source], kinds)
    assert len(asked) == len(set(asked)) == found.computed.sum() < 0.2 * kinds.size
    assert np.array_equal(found.source[found.computed], np.flatnonzero(found.computed))
    assert (found.probes, found.differing) == (int(0.02 * kinds.size), 0)
    every = refined((5, 4), 1, lambda pixels: pixels)
    assert (every.computed.all(), every.probes, every.differing) == (True, 0, 0)


def test_random_pixels_find_what_lies_between_those_of_the_coarse_grid() -> None:
    """A patch inside one cell is found by a random pixel and then seen whole; of specks, the share that is missed is bounded."""
    kinds = np.zeros((257, 257), np.int64)
    kinds[66:78, 130:143] = 1
    found = refined(kinds.shape, 16, lambda pixels: kinds.ravel()[pixels])
    assert found.computed.mean() < 0.1
    assert np.array_equal(kinds.ravel()[found.source], kinds)
    specks = (np.random.default_rng(3).random((257, 257)) < 0.02).astype(np.int64)
    specks[::16, ::16] = 0
    seen = refined(specks.shape, 16, lambda pixels: specks.ravel()[pixels])
    missed = (specks.ravel()[seen.source] != specks)[~seen.computed].mean()
    assert seen.probes == int(0.02 * specks.size)
    assert abs(seen.differing / seen.probes - missed) < 4 * np.sqrt(missed / seen.probes)


def test_pixels_whose_source_cannot_be_continued_are_computed_with_their_borders() -> None:
    kinds = np.zeros((65, 65), np.int64)
    kinds[33:39, 17:40] = 1
    found = refined(
        kinds.shape,
        16,
        lambda pixels: kinds.ravel()[pixels],
        lambda pixels, sources: (kinds.ravel()[pixels] == kinds.ravel()[sources]) | (pixels % 65 != 20),
    )
    assert np.array_equal(kinds.ravel()[found.source], kinds)
    assert not found.computed.all()


def test_a_refined_chart_is_the_whole_one_where_it_was_computed_and_continues_cycles_elsewhere() -> None:
    plane = {"d": np.linspace(0.29, 0.36, 25), "r": np.linspace(0.45, 0.55, 25)}
    whole, some = (
        nsmaps.parameter_plane(PAIR, plane, STARTS[0], n_returns=64, transient=1000, refine=refine, observables=["loss"])
        for refine in (None, 8)
    )
    assert some.computed.mean() < 0.6
    assert (whole.computed.all(), whole.probes, whole.most_differing) == (True, 0, 0.0)
    assert some.state[some.computed].tobytes() == whole.state[some.computed].tobytes()
    assert some.exponent[some.computed].tobytes() == whole.exponent[some.computed].tobytes()
    same = ~some.computed & (some.labels == whole.labels)[..., 0]
    assert same.sum() > 200
    assert np.allclose(some.exponent[same], whole.exponent[same], rtol=0, atol=1e-5)
    assert np.allclose(some.means[same], whole.means[same], rtol=1e-6)
    assert np.isfinite(some.state[~some.computed]).all()
    assert (some.labels != whole.labels)[~some.computed].mean() <= some.most_differing < 0.1
    assert some.most_differing == pytest.approx(1 - 0.05 ** (1 / some.probes) if not some.differing else some.most_differing)
    lone = (whole.period[..., 0] == 0) & ~some.computed
    assert not (some.period[lone] == 0).any(), "what has no period is never filled"


def test_an_interrupted_chart_keeps_the_pixels_that_were_computed() -> None:
    def stop(share: float) -> None:
        if share >= 0.5:
            raise KeyboardInterrupt

    plane = {"d": np.linspace(0.3, 0.36, 4), "r": np.linspace(0.45, 0.55, 4)}
    with pytest.raises(nsmaps.Interrupted) as stopped:
        nsmaps.parameter_plane(PAIR, plane, STARTS, n_returns=64, transient=200, parallel=nsmaps.Parallel(part=2, progress=stop))
    assert str(stopped.value) == "stopped with 4 of 8 parts; `result` of this exception holds what was finished"
    whole, part = nsmaps.parameter_plane(PAIR, plane, STARTS, n_returns=64, transient=200), stopped.value.result
    assert part.computed.ravel().tolist() == [True] * 8 + [False] * 8
    assert part.state[part.computed].tobytes() == whole.state[part.computed].tobytes()
    assert part.labels[:2].tolist() == whole.labels[:2].tolist()
    assert np.isnan(part.exponent[2:]).all()
    assert (part.motion[2:] == -1).all()


def test_flights_are_decomposed_once_for_parameters_that_they_do_not_contain() -> None:
    formulas = tables.formulas_of(PAIR)
    tables._flight.cache_clear()
    first = formulas.table([0.3, 0.5, 0.21])
    second = formulas.table([0.31, 0.6, 0.21])
    assert tables._flight.cache_info().misses == 1
    tables._flight.cache_clear()
    assert np.array_equal(formulas.table([0.31, 0.6, 0.21]), second)
    assert np.array_equal(formulas.table([0.3, 0.5, 0.21]), first)
    formulas.table([0.3, 0.5, 0.22])
    assert tables._flight.cache_info().misses == 2


def test_a_chart_is_a_dataset(made: Any) -> None:
    data = made.to_xarray()
    assert data["period"].dims == ("r", "d", "start")
    assert data["period"].sel(d=PLANE["d"][3], r=PLANE["r"][2]).values.tolist() == made.period[2, 3].tolist()


CALL = partial(nsmaps.parameter_plane, PAIR, starts=[0.8, 0.4])
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "one parameter": ({"axes": {"d": [0.3, 0.31]}}, message("dynamics.plane", names="d", known="d, r, g_bar")),
    "none": ({"axes": {}}, message("dynamics.plane", names="no parameter")),
    "unknown": (
        {"axes": {"d": [0.3], "gbar": [0.1]}},
        message("errors.no-such-near", kind="parameter", name="gbar", near="g_bar"),
    ),
    "infinite": ({"axes": {"d": [0.3, np.inf], "r": [0.5]}}, message("dynamics.values-of", name="d", values="[0.3, inf]")),
    "nan": ({"axes": {"d": [0.3], "r": [np.nan]}}, message("dynamics.values-of", name="r", values="[nan]")),
    "descending": ({"axes": {"d": [0.3, 0.2], "r": [0.5]}}, message("dynamics.values-of", name="d", values="[0.3, 0.2]")),
    "empty": ({"axes": {"d": [], "r": [0.5]}}, message("dynamics.values-of", name="d", values="[]")),
    "returns": ({"axes": PLANE, "n_returns": 10}, message("dynamics.plane-returns", number=10, transient=1000, period=32)),
    "discard": (
        {"axes": PLANE, "transient": -1},
        message("errors.value", name="transient", value=-1, expected="a whole number of at least 0"),
    ),
    "tolerance": ({"axes": PLANE, "tolerance": 0.0}, message("dynamics.tolerance", value=0.0)),
    "direction": ({"axes": PLANE, "direction": "left"}, message("errors.value", name="direction", value="'left'")),
    "refine": ({"axes": PLANE, "refine": 6}, message("dynamics.refine", value=6)),
    "both": ({"axes": PLANE, "refine": 4, "direction": "up"}, message("dynamics.refined-sweep")),
    "observable": (
        {"axes": PLANE, "observables": ["los"]},
        message("exact.observable-near", name="los", map="VIPair", near="loss"),
    ),
    "formula": (
        {"axes": PLANE, "observables": [{"name": "x", "formula": "v +* 2"}]},
        message("reduced.unread", text="v +* 2", column=4),
    ),
    "no starts": ({"axes": PLANE, "starts": np.zeros((0, 2))}, message("dynamics.no-starts")),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_calls_are_errors(name: str) -> None:
    given, text = WRONG[name]
    with pytest.raises(NsmapsError, match=text):
        CALL(**given)


def test_starts_of_other_coordinates_are_errors() -> None:
    with pytest.raises(StateError, match=message("coordinates.state-lacks", name="phi")):
        nsmaps.parameter_plane(PAIR, PLANE, {"v": 0.8})


def test_a_plane_of_a_function_has_rows_that_are_bifurcation_diagrams(pair) -> None:
    along, across = [0.26, 0.30, 0.35], [0.5, 0.6]
    how = {"n_returns": 16, "transient": 1000, "direction": "down"}
    made = nsmaps.parameter_plane(lambda d, r: pair(d, r), {"d": along, "r": across}, {"v": 0.8, "phi": 0.4}, max_period=8, **how)
    for k, r in enumerate(across):
        row = nsmaps.bifurcation_diagram(lambda d, r=r: pair(d, r), "d", along, [0.8, 0.4], **how)
        assert np.array_equal(made.period[k], row.period)
        assert np.array_equal(made.labels[k], row.labels)
    assert made.labels[0, :, 0].tolist() == ["1:1/C", "1:1/2T", "1:1/T"]
    assert (made.period == 1).mean() == 2 / 6


def test_pixels_where_a_function_has_no_map_are_refused(pair) -> None:
    def of(d, r):
        return pair(0.3).at(d=d, r=r)

    made = nsmaps.parameter_plane(of, {"d": [-0.1, 0.35], "r": [0.5, 1.5]}, [0.8, 0.4], direction="down", observables=["loss"])
    assert made.period[..., 0].tolist() == [[-1, 1], [-1, -1]]
    assert made.labels[..., 0].tolist() == [["", "1:1/T"], ["", ""]]
    assert made.refused.tolist() == [[True, False], [True, True]]
    assert np.isfinite(made.means[..., 0, 0]).tolist() == [[False, True], [False, False]]
    assert "greater than 0" in made.reason
    with pytest.raises(NsmapsError, match=message("dynamics.no-map-in-plane-at-most", number=1, bound=1)):
        nsmaps.parameter_plane(of, {"d": [0.35], "r": [1.5]}, [0.8, 0.4])


def test_a_curve_of_doublings_parts_the_plane(pair) -> None:
    """On either side of the curve iteration alone finds one state and two."""
    fixed = nsmaps.periodic_orbit(pair(0.35), [0.8, 0.4])
    branch = nsmaps.continue_branch(
        lambda d: pair(d, 0.5), "d", fixed, 0.35, (0.25, 0.36), direction="down", until=("period doubling",)
    )
    curve = nsmaps.bifurcation_curve(pair, branch.events[-1], {"d": (0.25, 0.36), "r": (0.45, 0.6)}, 0.5, step=0.2)
    assert np.ptp(curve.parameters[:, 1]) == pytest.approx(0.15)
    sampled = curve.parameters[:: max(len(curve.parameters) // 3, 1)]
    assert len(sampled) >= 3
    for d, r in sampled:
        sides = nsmaps.parameter_plane(pair, {"d": [d - 2e-3, d + 2e-3], "r": [r]}, [0.8, 0.31], n_returns=64, transient=20_000)
        assert sides.period[0, :, 0].tolist() == [2, 1]


def test_cycles_with_rest_have_no_finite_exponent_however_they_were_found():
    """The image of a state that comes to rest does not depend on it; here only orbits followed for longer show the rest."""
    ball = nsmaps.load_system("bouncing_ball", Gamma=1.5, r=0.5)
    gamma = np.linspace(1.5, 3.2, 24)[7]
    plane = nsmaps.parameter_plane(ball, {"Gamma": [gamma], "r": [0.6]}, [[1, 1], [3, 2]], n_returns=400, transient=300)
    assert plane.labels.ravel().tolist() == ["B~B/16T", "B~B/16T"]
    assert np.isneginf(plane.exponent).all()
