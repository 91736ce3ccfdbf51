"""Batches of returns in parts: the same numbers, to the last bit, as in one."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps import Parallel
from nsmaps.errors import NsmapsError, StateError
from nsmaps.exact.batches import divided_returns
from nsmaps.exact.surfaces.sweep import sweep

ROWS = ("start", "image", "turns", "codes", "outcome", "time", "derivative")
SYSTEMS = {
    "duffing": {"c": 0.1, "a": 1, "b": 1, "f": 0.7, "w": 1.2, "d": 0.6},
    "pendulum": {"c": 0.1, "f": 0.5, "w": 0.7, "stop": 0.5},
    "vi_pair": {"d": 0.35, "g_bar": 0.2113},
    "soft_impact": {"xi": 0.01, "e": 1.26, "a": 0.7, "beta": 29, "w": 0.79},
}


def same(one, other):
    """Whether two batches have the same rows, to the last bit, NaN included."""
    pairs = [(getattr(one, name), getattr(other, name)) for name in ROWS]
    return all(np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in pairs)


def starts(n):
    """Random states, one of them not a state."""
    rng = np.random.default_rng(2)
    states = np.column_stack([rng.uniform(0.01, 1.5, n), rng.uniform(-3, 9, n)])
    states[3] = np.nan
    return states


@pytest.mark.parametrize("name", SYSTEMS)
def test_parts_are_the_whole(name):
    if name in ("duffing", "pendulum"):
        pytest.importorskip("heyoka")
    system, states = nsmaps.load_system(name, **SYSTEMS[name]), starts(60)
    whole = system.orbits(states, 4, derivative=True)
    with ThreadPoolExecutor(2) as executor:
        parts = system.orbits(states, 4, derivative=True, parallel=Parallel(executor, part=20))
        first = system.first_return(states, parallel=Parallel(executor, part=20))
    assert same(whole, parts)
    assert (parts.walls, parts.integrated) == (whole.walls, whole.integrated)
    assert first.derivative is None
    assert np.array_equal(first.image, system.first_return(states).image, equal_nan=True)


def test_integrated_returns_in_two_processes_and_from_a_folder(tmp_path):
    pytest.importorskip("heyoka")
    system, states = nsmaps.load_system("duffing", **SYSTEMS["duffing"]), starts(40)
    with ProcessPoolExecutor(2) as executor:
        made = system.orbits(states, 2, True, parallel=Parallel(executor, tmp_path, part=10))
    assert same(made, system.orbits(states, 2, True))
    assert len(list(tmp_path.glob("part-*.npz"))) == 4
    assert same(system.orbits(states, 2, True, parallel=Parallel(checkpoint=tmp_path, part=10)), made)


def test_a_fitted_map_of_several_returns_in_parts():
    """Two pieces, of which one has images after two returns."""
    pieces = [
        nsmaps.reduced.Piece(
            name, nsmaps.Box.of(("x",), [side]), nsmaps.reduced.PolyMap.of_monomials(("x",), {"x": {(0,): 0.5}}, [side]), "", n
        )
        for name, side, n in (("left", (0.0, 1.0), 1), ("right", (1.0, 2.0), 2))
    ]
    return_map = nsmaps.CompositeMap(("x",), (), tuple(pieces))
    states = np.linspace(0.05, 1.95, 12)[:, None]
    whole = return_map.orbits(states, 3)
    with ThreadPoolExecutor(2) as executor:
        parts = divided_returns(return_map, states, 3, False, parallel=Parallel(executor, part=4))
    assert whole.numbers[:12].tolist() == [1] * 6 + [2] * 6
    assert parts.numbers.tolist() == whole.numbers.tolist()
    assert parts.fitted


def test_a_sweep_says_that_flights_are_integrated():
    pytest.importorskip("heyoka")
    system = nsmaps.load_system("duffing", **SYSTEMS["duffing"])
    grid = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.1, high=1, points=3), "phi": nsmaps.Axis(low=0, high=3, points=3)})
    family = nsmaps.WordFamily(name="one", words=(2 * system.letters[0],))
    ((_, made),) = sweep(system, "f", [0.7], grid, [family])
    assert len(made["one"].returns)
    assert made["one"].returns.integrated


def test_no_states_and_what_is_refused():
    system = nsmaps.load_system("vi_pair", **SYSTEMS["vi_pair"])
    with ThreadPoolExecutor(1) as executor:
        assert len(system.orbits(np.empty((0, 2)), 3, parallel=Parallel(executor))) == 0
        with pytest.raises(NsmapsError, match=message("exact.no-returns", name="n", value=0)):
            system.orbits(starts(5), 0, parallel=Parallel(executor))
        with pytest.raises(StateError):
            system.orbits([[1.0, 2.0, 3.0]], 1, parallel=Parallel(executor))
