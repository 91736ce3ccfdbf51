"""Nonlinear systems with modes against Taylor series of 60 digits: words, images, derivatives, multipliers, bifurcations."""

import mpmath as mp
import numpy as np
import pytest
from nonlinear import FILES, expected_word, in_coordinates, number, reference, rows_of, section_of, system

import nsmaps
from nsmaps.exact.outcome import Outcome

pytest.importorskip("heyoka")

EPS = float(np.finfo(float).eps)
WITHOUT = {"fall": Outcome.escaped, "no return up to t = 600 (integrated, not proved)": Outcome.escaped}


@pytest.fixture(scope="module", params=FILES)
def rows(request):
    """The name of a file, and its rows with their returns."""
    found = rows_of(request.param)
    assert found
    return request.param, found


def test_words_are_those_of_60_digits(rows):
    file, found = rows
    for row in found:
        if row.given["image"] is None:
            assert row.outcome == WITHOUT[row.given["outcome"]], row
            continue
        word = expected_word(file, row.given.get("section", ""), row.given["word"])
        assert row.word == word, row
        assert row.outcome == Outcome.returned, row


def test_images_and_times_are_right_to_what_rounding_of_the_start_makes(rows):
    """To 1e-11 of the size of the motion, where the return multiplies a rounding error of its start by less than 100."""
    file, found = rows
    angles = reference(file).get("angle_coordinates", [])
    for row in found:
        if row.given["image"] is None:
            assert np.isnan(row.image).all()
            continue
        section = row.given.get("section", "")
        off = row.image - in_coordinates(file, section, row.given["image"])
        turning = angles.get(section, []) if isinstance(angles, dict) else angles
        off[turning] = (off[turning] + np.pi) % (2 * np.pi) - np.pi
        size = max(1.0, np.abs(np.array(row.given["start"], float)).max(), np.abs(row.image).max())
        bound = max(1e-11 if row.given["kind"] == "ordinary" else 0, 500 * EPS * row.steep) * size
        assert np.abs(off).max() <= bound, (row.given["kind"], off, bound)
        steep = max(row.steep, np.abs(np.array(row.given["time_grad"], float)).sum())
        assert abs(row.time - float(row.given["return_time"])) <= max(1e-11, 500 * EPS * steep) * size, row


def test_derivatives_through_all_events(rows):
    file, found = rows
    compared = 0
    for row in found:
        if row.given["image"] is None:
            continue
        section = row.given.get("section", "")
        signs = in_coordinates(file, section, np.ones(len(row.given["start"])))
        exact = np.array(row.given["jac"], float) * signs
        exact = exact if section == "arr" else np.atleast_1d(signs)[:, None] * exact if signs.ndim else exact
        time_steep = np.abs(np.array(row.given["time_grad"], float)).sum()
        bound = (
            1e-12 * row.steep
            if row.given["kind"] == "ordinary"
            else 1e-7 * row.steep + 10 * EPS * row.steep**3 + 1e3 * EPS * time_steep
        )
        assert np.abs(row.derivative - exact).max() <= bound, row
        compared += 1
    assert compared > 20


@pytest.mark.parametrize("file", FILES)
def test_attractors_close_with_their_multipliers(file):
    given = reference(file)
    for one in given["attractors"]:
        section = section_of(file, one)
        energy = {"E": one["energy_E"]} if file == "N6" else {}
        made = system(file, section, given["parameters"][one["params"]], **energy)
        points = np.array([in_coordinates(file, section, point) for point in one["points"]])
        orbit = nsmaps.periodic_orbit(made, points[0], len(points))
        assert orbit.converged
        assert orbit.stable == one["stable"]
        assert [word[1:] for word in orbit.words] == [expected_word(file, section, word) for word in one["words"]]
        assert np.abs(orbit.states - points).max() < 1e-10 * np.abs(points).max()
        assert orbit.returns.time == pytest.approx(np.array(one["return_times"], float), rel=1e-11)
        wanted = [complex(float(x), float(y)) for x, y in one["multipliers"]]
        for value in wanted:
            assert np.abs(orbit.multipliers - value).min() < 1e-8 * max(1.0, abs(value))


DOUBLING, FOLD, BRANCH_POINT, TORUS = "period doubling", "fold", "branch point", "Neimark-Sacker"
PASSED = [  #: file, kind, and a share of its value by which the parameter changes to where the branch starts
    ("N1", DOUBLING, 0.02),
    ("N2", FOLD, 0.02),
    ("N3", DOUBLING, 0.002),
    ("N4", BRANCH_POINT, 0.01),
    ("N4", TORUS, -0.002),
    ("N5", DOUBLING, -0.01),
    ("N6", FOLD, 0.002),
    ("N7", DOUBLING, -0.02),
]


@pytest.mark.parametrize(("file", "kind", "share"), PASSED)
def test_a_bifurcation_where_30_digits_have_it(file, kind, share):
    one = reference(file)["bifurcations"][1 if kind == TORUS else 0]
    section = section_of(file, one)
    made = system(file, section, one["other_parameters"], **{one["parameter"]: one["value"]})
    name, value = {"alpha0_deg": "angle"}.get(one["parameter"], one["parameter"]), number(one["value"])
    map_of = nsmaps.exact.Along(made, name)
    start = value * (1 + share)
    orbit = nsmaps.periodic_orbit(map_of(start), in_coordinates(file, section, one["point"]))
    assert orbit.converged
    reach = abs(value * share)
    branch = nsmaps.continue_branch(
        map_of,
        "p",
        orbit,
        start,
        (value - 1.5 * reach, value + 1.5 * reach),
        direction="down" if share * value > 0 else "up",
        until=(kind,),
    )
    (found,) = branch.of_kind(kind)
    assert found.value == pytest.approx(value, rel=1e-10)
    assert np.abs(found.orbit.states[0] - in_coordinates(file, section, one["point"])).max() < 1e-5


def test_the_cycle_of_the_valve_grazes_its_seat_where_30_digits_have_it():
    one = reference("N1")["bifurcations"][1]
    value, parameters = float(one["value"]), one["other_parameters"]
    map_of = nsmaps.exact.Along(system("N1", "M", parameters, q=one["value"]), "q")
    orbit = nsmaps.periodic_orbit(map_of(7.6), [8.61150949961543657, 0.779221187319636388])
    branch = nsmaps.continue_branch(map_of, "p", orbit, 7.6, (7.5, 7.7), direction="down")
    (found,) = branch.events
    assert found.kind == "grazing"
    assert found.value == pytest.approx(value, rel=1e-10)
    assert found.orbit.states[0] == pytest.approx(np.array(one["point"], float), rel=1e-6)


@pytest.mark.thorough
def test_the_cycle_of_the_valve_shrinks_to_its_equilibrium():
    """There a pair of eigenvalues is imaginary: the rule of Routh and Hurwitz for x = lift, p = x + delta, q = x sqrt(p)."""
    parameters = reference("N1")["bifurcations"][1]["other_parameters"]
    with mp.workdps(30):
        kappa, delta, beta = (mp.mpf(parameters[name]) for name in ("kappa", "delta", "beta"))
        leak = lambda x: beta * x / (2 * mp.sqrt(x + delta))  # noqa: E731
        x = mp.findroot(lambda x: (kappa + leak(x)) * (kappa * leak(x) + 1) - leak(x) - beta * mp.sqrt(x + delta), 2.4)
        value = float(x * mp.sqrt(x + delta))
    map_of = nsmaps.exact.Along(system("N1", "M", parameters, q=8.46), "q")
    orbit = nsmaps.periodic_orbit(map_of(8.46), [2.89, 9.45])
    branch = nsmaps.continue_branch(map_of, "p", orbit, 8.46, (8.4, 8.5), direction="up")
    (event,) = branch.events
    assert event.kind == branch.ended == "Hopf bifurcation"
    assert event.value == pytest.approx(value, rel=1e-10)
    assert event.orbit.states[0] == pytest.approx([float(x), float(x + delta)], rel=1e-4)


@pytest.mark.parametrize("k", range(3))
def test_rolling_ends_at_the_upright(k):
    one = reference("N5w")["bifurcations"][k]
    value = float(one["value"])
    map_of = nsmaps.exact.Along(system("N5w", "", one["other_parameters"], gamma=2 * value), "gamma")
    alpha, gamma = map_of(0.1).alpha, 2 * value
    w = np.sqrt(4 * np.sin(gamma) * np.sin(alpha)) / np.sin(2 * alpha)
    orbit = nsmaps.periodic_orbit(map_of(gamma), [w])
    branch = nsmaps.continue_branch(map_of, "p", orbit, gamma, (value / 2, gamma), direction="down")
    assert branch.values.min() == pytest.approx(value, rel=1e-9)
    assert branch.values.min() > value
