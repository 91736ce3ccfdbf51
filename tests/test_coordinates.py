"""Coordinates keep their angles and measure by them; boxes of states are taken in one way, anything else is refused."""

import ast
import json
import pickle
from copy import deepcopy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from messages import message

import nsmaps
from nsmaps.coordinates import TWO_PI, Coordinates, as_box, as_starts
from nsmaps.dynamics.noise.impacts import impact_diagram
from nsmaps.errors import StateError
from nsmaps.parallel import names_among, names_as_arrays
from nsmaps.study.store.serialize import decode, encode

NAMES = ("v", nsmaps.Angle("phi"))
ROWS = [[0.7, 1.0], [0.2, 1.14]]


@pytest.mark.parametrize(
    "box",
    [
        {"v": (0.7, 1.0), "phi": (0.2, 1.14)},
        {"phi": (0.2, 1.14), "v": (0.7, 1.0)},
        nsmaps.Box(coordinates=NAMES, bounds={"v": (0.7, 1.0), "phi": (0.2, 1.14)}),
        np.array(ROWS),
        ROWS,
    ],
    ids=["mapping", "mapping in another order", "Box", "array", "lists"],
)
def test_one_box_in_every_form_is_one_array(box: object) -> None:
    array = as_box(box, NAMES)  # type: ignore[arg-type]
    assert array.dtype == float
    assert array.tolist() == ROWS


@pytest.mark.parametrize("state", [{"v": 0.7, "phi": 1}, {"phi": 1.0, "v": 0.7}, [0.7, 1], np.array([0.7, 1.0])])
def test_one_state_in_every_form_is_one_array(state: object) -> None:
    assert as_starts(state, NAMES).tolist() == [0.7, 1.0]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("state", "why"),
    [
        ({"v": 0.7}, message("coordinates.state-lacks", given="v", name="phi", names="v, phi")),
        ({"v": 0.7, "phi": 1, "psi": 2}, message("coordinates.foreign-near", name="psi")),
        (
            [0.7],
            message("errors.shape", what="the start has", shape="(1,)", expected="(2,) or (..., 2), the coordinates v, phi last"),
        ),
        (0.7, message("errors.shape", what="the start has", shape="()")),
        ("v", message("coordinates.not-numbers", given="'v'")),
    ],
)
def test_other_states_are_refused(state: object, why: str) -> None:
    with pytest.raises(StateError, match=why):
        as_starts(state, NAMES)  # type: ignore[arg-type]


BOX = {"v": (0.8, 0.85), "phi": (0.3, 0.4)}
BOXED = {
    "strip_map": lambda system, box: nsmaps.reduced.strip_map(system, box, 1e-2),
    "grazing_curves": lambda system, box: system.grazing_curves(box, n_lines=9),
    "forward_invariant_box": lambda system, box: nsmaps.cells.forward_invariant_box(system, box, n_cells=2),
    "morse_sets": lambda system, box: nsmaps.cells.morse_sets(system, box, depth=0, n_cells=2),
    "attracting_domain": lambda system, box: nsmaps.attracting_domain(system, box, max_updates=1, n_samples=9),
    "over": lambda system, box: nsmaps.reduced.PolyMap.reset(system.coordinates, {"v": 1.0}).over(box),
}


@pytest.mark.parametrize("name", BOXED)
def test_everything_that_takes_a_box_takes_it_in_one_way(name: str, pair) -> None:
    """A mapping, a `Box` and an array alike; the errors are those of `as_box`."""
    system = pair(0.35)
    one = {"box": "v from 1.0 to 0.0"}
    flat = name in ("over", "attracting_domain")
    said = message("coordinates.box", **one) if flat else message("coordinates.box-with-angles", **one)
    for box in (BOX, nsmaps.Box(coordinates=system.coordinates, bounds=BOX), list(BOX.values())):
        BOXED[name](system, box)
    for wrong, why in (
        ({"v": BOX["v"]}, message("coordinates.box-lacks", name="phi")),
        ([[1, 0], [0, 1]], said),
    ):
        with pytest.raises(StateError, match=why):
            BOXED[name](system, wrong)


STARTED = {
    "orbit": lambda system, state: nsmaps.orbit(system, state, 2).states,
    "lyapunov": lambda system, state: nsmaps.lyapunov(system, starts=state, n_returns=32).exponents,
    "periodic_orbit": lambda system, state: nsmaps.periodic_orbit(system, state).states,
    "impacts": lambda system, state: system.impacts(state, 3).time,
    "trajectory": lambda system, state: np.array(system.trajectory(state, 3)),
    "noisy_orbits": lambda system, state: (
        nsmaps.noisy_orbits(system, state, nsmaps.Noise(sigma=0.01, tau=0.5), n_returns=3, n_realisations=2).states
    ),
}


SWEPT = {
    "bifurcation": lambda of, state: nsmaps.bifurcation_diagram(of, "p", [0.34, 0.35], state, n_returns=3, transient=2).states,
    "lyapunov over values": lambda of, state: nsmaps.lyapunov(of, "d", [0.34, 0.35], state, n_returns=32, transient=2).exponents,
    "parameter_plane": lambda of, state: (
        nsmaps.parameter_plane(
            lambda d, r: of(d).at(r=r), {"d": [0.34, 0.35], "r": [0.5]}, state, max_period=2, n_returns=4, transient=9
        ).period
    ),
    "impact_diagram": lambda of, state: (
        impact_diagram(of, "d", [0.34, 0.35], state, nsmaps.Noise(sigma=0, tau=1), "up", n_returns=2, transient=2).speed
    ),
}


@pytest.mark.parametrize("name", SWEPT)
def test_every_sweep_takes_a_state_in_one_way(name: str, pair) -> None:
    """By name in the order of the coordinates of the first value that has a map."""
    expected = SWEPT[name](pair, [0.8, 0.4])
    assert np.array_equal(SWEPT[name](pair, {"phi": 0.4, "v": 0.8}), expected, equal_nan=True)
    for wrong, said in (({"v": 0.8}, message("coordinates.state-lacks", name="phi")), ("v", message("coordinates.not-numbers"))):
        with pytest.raises(StateError, match=said):
            SWEPT[name](pair, wrong)


@pytest.mark.parametrize("name", STARTED)
def test_everything_that_takes_a_state_takes_it_in_one_way(name: str, pair) -> None:
    system = pair(0.35)
    expected = STARTED[name](system, [0.8, 0.4])
    assert np.array_equal(STARTED[name](system, {"phi": 0.4, "v": 0.8}), expected, equal_nan=True)
    for wrong, said in (
        ({"v": 0.8}, message("coordinates.state-lacks", name="phi")),
        ([0.8], message("errors.shape", what="the start has", shape="(1,)")),
        (0.8, message("errors.shape", what="the start has", shape="()")),
    ):
        with pytest.raises(StateError, match=said):
            STARTED[name](system, wrong)


def test_the_array_of_a_box_is_a_copy() -> None:
    given = np.array(ROWS)
    as_box(given, NAMES)[0, 0] = 9.0
    assert given.tolist() == ROWS


@pytest.mark.parametrize(
    ("box", "why"),
    [
        ({"v": (0.7, 1.0)}, message("coordinates.box-lacks", given="v", name="phi", names="v, phi")),
        ({"v": (0.7, 1.0), "phj": (0, 1)}, message("coordinates.foreign-near", name="phj", near="phi")),
        ({"v": (0.7, 1.0), "phi": (1, 1)}, message("coordinates.box", box="phi from 1.0 to 1.0")),
        ([[0.7, 1.0], [0.2, np.nan]], message("coordinates.box")),
        ([[0.7, 1.0], [0.2, np.inf]], message("coordinates.box")),
        ([[1.0, 0.7], [0.2, 1.14]], message("coordinates.box", names="v, phi")),
        ([0.7, 1.0], message("coordinates.box")),
        ("v", message("coordinates.box", box="'v'")),
        (None, message("coordinates.box")),
    ],
)
def test_other_boxes_are_refused(box: object, why: str) -> None:
    with pytest.raises(nsmaps.NsmapsError, match=why):
        as_box(box, NAMES)  # type: ignore[arg-type]


def test_domains_and_covers_take_a_box_by_name() -> None:
    return_map = nsmaps.reduced.PolyMap.of_monomials(("x", "y"), {"x": {(1, 0): 0.5}, "y": {(0, 1): 0.25}}, [[-2, 2], [-2, 2]])
    by_name, rows = {"y": (-1, 1), "x": (-1.5, 1.5)}, [[-1.5, 1.5], [-1, 1]]
    first, second = (nsmaps.attracting_domain(return_map, box, max_updates=1).boxes for box in (by_name, rows))
    assert np.array_equal(first, second)
    first_cover, second_cover = (nsmaps.cells.morse_sets(return_map, box, depth=2) for box in (by_name, rows))
    assert np.array_equal(first_cover.boxes, second_cover.boxes)


names_and_angles = st.lists(st.text(min_size=1, max_size=4).filter(str.isprintable), min_size=1, max_size=5, unique=True).flatmap(
    lambda names: st.tuples(st.just(names), st.lists(st.sampled_from(names), unique=True))
)
FLOATS = st.floats(-1e9, 1e9)


@given(names_and_angles)
def test_coordinates_survive_json_numpy_pickle_and_copies(given: tuple[list[str], list[str]]) -> None:
    names, angles = given
    coordinates = Coordinates(names, angles)
    arrays: dict[str, np.ndarray] = {}
    text = json.dumps(encode(coordinates, "coordinates", arrays))
    by_array = names_among(names_as_arrays(coordinates))[0]
    for same in (decode(json.loads(text), arrays), by_array, pickle.loads(pickle.dumps(coordinates)), deepcopy(coordinates)):
        assert same == coordinates
        assert hash(same) == hash(coordinates)
        assert same.angles.tolist() == [name in angles for name in names]
    assert not arrays
    assert Coordinates(coordinates) == Coordinates(tuple(coordinates)) == coordinates
    assert [type(name) for name in coordinates] == [nsmaps.Angle if name in angles else str for name in names]


@given(st.lists(st.tuples(FLOATS, FLOATS), min_size=1, max_size=20))
def test_a_difference_of_angles_is_the_exact_remainder_in_minus_pi_to_pi(pairs: list[tuple[float, float]]) -> None:
    """Whole turns are those of the float 2 pi, by which rational arithmetic takes the remainder without rounding."""
    a, b = np.array(pairs).T
    found = Coordinates(("x", "phi"), ("phi",)).difference(np.stack([a, a], axis=1), np.stack([b, b], axis=1))
    assert found[:, 0].tolist() == (a - b).tolist()
    turn = Fraction(TWO_PI)
    for gap, angle in zip((a - b).tolist(), found[:, 1].tolist(), strict=True):
        assert -np.pi < angle <= np.pi
        assert (Fraction(gap) - Fraction(angle)) % turn == 0


@given(st.lists(st.tuples(FLOATS, FLOATS), min_size=1, max_size=20))
def test_wrap_is_idempotent_and_a_lift_of_it_is_the_state_again(states: list[tuple[float, float]]) -> None:
    coordinates, x = Coordinates(("x", "phi"), ("phi",)), np.array(states)
    wrapped = coordinates.wrap(x)
    assert ((wrapped[:, 1] >= 0) & (wrapped[:, 1] < TWO_PI)).all()
    np.testing.assert_array_equal(wrapped[:, 0], x[:, 0])
    np.testing.assert_array_equal(coordinates.wrap(wrapped), wrapped)
    np.testing.assert_allclose(coordinates.lift(wrapped, x), x, rtol=4e-16, atol=4e-16 * TWO_PI)


def test_what_is_not_finite_stays_what_it_is() -> None:
    coordinates = Coordinates(("phi", "theta", "v"), ("phi", "theta"))
    state = [0.5, np.nan, np.inf]
    for to in ([np.inf] * 3, [np.nan] * 3):
        np.testing.assert_array_equal(coordinates.lift(state, to), state)
    np.testing.assert_array_equal(coordinates.lift([7.0, -np.inf, 1.0], [0.0, 0.0, 0.0]), [7.0 - TWO_PI, -np.inf, 1.0])
    assert not coordinates.near([[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 0]], [0, 0, 0], 1.0)[:2].any()


def test_near_is_relative_to_a_scale_which_angles_have_of_their_own() -> None:
    coordinates = Coordinates(("v", "phi"), ("phi",))
    states = np.array([[1e-9, 6.2], [-2e-9, 0.1], [np.nan, 0.2]])
    scale = coordinates.magnitudes(states)
    assert scale.tolist() == [2e-9, 1.0]
    assert coordinates.near([2e-9, 0.05], [2.1e-9, TWO_PI], 0.06, scale)
    assert not coordinates.near([2e-9, 0.05], [2.2e-9, TWO_PI], 0.06, scale)
    assert not coordinates.near([2e-9, 0.07], [2e-9, TWO_PI], 0.06, scale)


@pytest.mark.parametrize("angles", [(), ("c",), ("a", "b", "c", "d")])
def test_any_number_of_coordinates_may_be_angles(angles: tuple[str, ...]) -> None:
    found = Coordinates(list("abcd"), angles).difference(np.full((2, 4), 6.0), np.zeros(4))
    assert found.tolist() == [[6.0 - TWO_PI if name in angles else 6.0 for name in "abcd"]] * 2


@pytest.mark.parametrize("names", [(), "phi", 5, ("v", "v"), ("v", 1), ("v", ""), ("v\0",)])
def test_what_names_no_coordinates_is_refused(names: object) -> None:
    with pytest.raises(nsmaps.NsmapsError, match=message("coordinates.names")):
        Coordinates(names)  # type: ignore[arg-type]
    with pytest.raises(nsmaps.NsmapsError, match=message("coordinates.wrong-name", name="theta")):
        Coordinates(("v", "phi"), ("theta",))


def test_a_system_and_a_plain_map_may_give_names() -> None:
    class Turned(nsmaps.ImpactSystem):
        coordinates = ("w", nsmaps.Angle("theta"))  # type: ignore[assignment]

    assert Turned.coordinates == Coordinates(("w", "theta"), ("theta",))
    plain = nsmaps.reduced.PolyMap.reset(NAMES, {"v": 1.0})
    assert plain.coordinates == Coordinates(NAMES)


def test_no_other_module_asks_whether_a_name_is_an_angle_by_its_class() -> None:
    package = Path(nsmaps.__file__).parent
    asking = [
        f"{file.relative_to(package)}:{node.lineno}"
        for file in package.rglob("*.py")
        if "Angle" in (source := file.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance" and "Angle" in ast.unparse(node.args[1])
    ]
    assert [place.split(":")[0] for place in asking] == ["coordinates.py"]
