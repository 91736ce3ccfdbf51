"""Returns of systems with modes against 40 digits: words, images, derivatives, multipliers, bifurcations, and what is refused."""

import numpy as np
import pytest
from hybrid import SYSTEMS, numbers, reference, system, word
from messages import message
from nsmaps_soft_impact import SoftImpact
from nsmaps_vi_pair import VIPair

import nsmaps
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.outcome import Outcome

EPS = 1e-16


@pytest.fixture(scope="module", params=SYSTEMS)
def rows(request):
    """The name of a system, and its reference rows by set of parameters, with its returns and their derivatives."""
    given, found = reference(request.param), []
    for key, parameters in given["parameters"].items():
        here = [row for row in given["returns"] if row["params"] == key]
        if here:
            starts = np.array([numbers(row["start"]) for row in here])
            made = system(request.param, parameters).first_return(starts, derivative=True)
            found += [(row, made.select([k])) for k, row in enumerate(here)]
    assert len(found) == len(given["returns"]) > 10
    return request.param, found


def test_words_are_those_of_40_digits(rows):
    name, found = rows
    for row, made in found:
        mine = word(name, str(made.words[0]))
        assert mine == row["word"] or (mine.endswith("...") and row["word"].startswith(mine[:-3]) and len(mine) > 25), row


def test_images_are_right_to_what_rounding_of_the_start_makes(rows):
    _, found = rows
    for row, made in found:
        if row["image"] is None:
            assert np.isnan(made.image).all()
            assert made.outcome[0] == Outcome.escaped
            continue
        off = made.image[0] - numbers(row["image"])
        off = np.where(made.coordinates.angles, (off + np.pi) % (2 * np.pi) - np.pi, off)
        size = max(1.0, np.abs(made.start).max())
        assert np.abs(off).max() <= 50 * EPS * size * max(1.0, float(row["jac_inf_norm"])), row
        assert abs(made.time[0] - float(row["return_time"])) <= 50 * EPS * max(10.0, 10 * float(row["time_grad_norm"])), row


def test_derivatives_through_all_events(rows):
    _, found = rows
    for row, made in found:
        if row["image"] is not None and float(row["jac_inf_norm"]) < 1e4:
            assert np.abs(made.derivative[0]).max() == pytest.approx(float(row["jac_inf_norm"]), rel=2e-5), row


def test_certified_are_all_but_what_rounding_decides(rows):
    _, found = rows
    made = [each for row, each in found if row["image"] is not None]
    undecided = sum(each.outcome[0] == Outcome.undecided for each in made)
    assert undecided <= 1
    assert all(each.certified[0] for each in made if each.outcome[0] == Outcome.returned)


@pytest.mark.parametrize("name", SYSTEMS)
def test_attractors_close_with_their_multipliers(name):
    given, tried = reference(name), 0
    for one in given["attractors"]:
        made = system(name, given["parameters"][one["params"]])
        if not one.get("points") or len(one["points"][0]) != len(made.coordinates):
            continue
        orbit = nsmaps.periodic_orbit(made, numbers(one["points"][0]), one["period_in_returns"])
        assert orbit.converged
        assert np.abs(orbit.states - [numbers(point) for point in one["points"]]).max() < 1e-9
        wanted = [complex(float(x), float(y)) for x, y in one["multipliers"]]
        for value in wanted:
            assert np.abs(orbit.multipliers - value).min() < 1e-9 * max(1.0, abs(value))
        tried += 1
    assert tried


@pytest.mark.parametrize("name", SYSTEMS)
def test_derivatives_by_parameters(name):
    given = reference(name)
    key, parameters = list(given["parameters"].items())[-1]
    row = next(row for row in given["returns"] if row["params"] == key and row["kind"] == "random" and row["image"])
    start, made = [numbers(row["start"])], system(name, parameters)
    assert made.parameter_names()
    for parameter in made.parameter_names():
        h = 1e-6 * (abs(getattr(made, parameter)) or 1.0)
        up, down = (made.at(**{parameter: getattr(made, parameter) + step}).first_return(start).lifted for step in (h, -h))
        difference = (up - down) / (2 * h)
        found = made.sensitivity(start, {parameter: 1.0})
        assert np.abs(found - difference).max() <= 1e-6 * max(np.abs(difference).max(), 1e-3), parameter


@pytest.mark.parametrize(
    ("name", "share"), [("S1_recoil", 0.01), ("S1_recoil", 0.005), ("S2_bilinear", 0.01), ("S5_buck", 0.01), ("S6_twomass", 0.01)]
)
def test_a_doubling_where_40_digits_have_it(name, share):
    (event,) = [each for each in reference(name)["bifurcations"] if "doubling" in each["kind"]]
    parameter, value = event["parameter"], float(event["value"])

    def at(x):
        return system(name, event["other_parameters"], **{parameter: x})

    low, high = value * (1 - share), value * (1 + share)
    orbit = nsmaps.periodic_orbit(at(low), numbers(event["point"]))
    branch = nsmaps.continue_branch(at, "p", orbit, low, (low, high))
    (found,) = [each for each in branch.events if each.kind == "period doubling"]
    assert found.value == pytest.approx(value, rel=1e-11)


@pytest.mark.parametrize(
    ("name", "kind", "share"),
    [("S3_stickslip", "grazing", 0.2), ("S4_rocking", "branch point", 0.02)],
)
def test_a_graze_and_a_loss_of_symmetry_where_40_digits_have_them(name, kind, share):
    event = reference(name)["bifurcations"][-1]
    parameter, value = event["parameter"], float(event["value"])

    def at(x):
        return system(name, event["other_parameters"], **{parameter: x})

    low, high = value * (1 - share), value * (1 + share)
    settled = nsmaps.orbit(at(low), numbers(event["point"]), 400).final
    branch = nsmaps.continue_branch(at, "p", nsmaps.periodic_orbit(at(low), settled), low, (low, high))
    (found,) = branch.events
    assert found.kind == kind
    assert found.value == pytest.approx(value, rel=1e-11)


def test_without_recoil_it_is_the_vibro_impact_pair():
    rng = np.random.default_rng(1)
    starts = np.column_stack([rng.uniform(0.05, 1.5, 400), rng.uniform(0, 6.28, 400)])
    pair = VIPair(d=0.35, g_bar=0.2113).first_return(starts)
    recoil = system("S1_recoil", {"eta": 0, "kappa": 0, "Lambda": 0, "d": 0.35, "r": 0.5, "g_bar": 0.2113})
    rows = np.column_stack([starts[:, 0], np.zeros((400, 2)), starts[:, 1]])
    made = recoil.first_return(rows)
    plain = np.isin(pair.outcome, [0]) & ~np.char.find(pair.words, "~") >= 0
    same = plain & (pair.words == made.words)
    assert same.sum() > 350
    off = made.image[same][:, [0, 3]] - pair.image[same]
    off[:, 1] = (off[:, 1] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < 1e-12


def test_a_stiff_stop_tends_to_the_wall_at_the_rate_of_theory():
    wall = nsmaps.load_system("impact_oscillator", zeta=0.01, w=0.8, A=0.7 * 0.64, wall=0.4, r=1.0)
    hard = wall.first_return([[0.5, 2.0 - np.pi / 2]])
    errors = []
    for beta in (1e4, 1e6, 1e8):
        soft = SoftImpact(xi=0.01, e=0.4, a=0.7, beta=beta, w=0.8).first_return([[0.5, 2.0]])
        errors.append(abs(soft.image[0, 0] - hard.image[0, 0]))
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx(10, rel=0.2)


def test_many_returns_are_the_returns_one_by_one():
    made = system("S6_twomass", reference("S6_twomass")["parameters"]["d0w14"])
    starts = np.array([[1.0, -0.4, -0.4, 5.7], [0.5, 0.1, 0.2, 1.0], [-1.0, 0, 0, 0]])
    orbits = made.orbits(starts, 5, derivative=True)
    states = starts
    for k in range(5):
        single = made.first_return(states, derivative=True)
        part = orbits.select(np.arange(3 * k, 3 * k + 3))
        assert np.array_equal(single.image, part.image, equal_nan=True)
        assert np.array_equal(single.derivative, part.derivative, equal_nan=True)
        states = single.image
    assert (orbits.outcome.reshape(5, 3)[:, 2] == Outcome.invalid).all()


def test_minima_of_guards_and_margins():
    made = system("S2_bilinear", reference("S2_bilinear")["parameters"]["w085"])
    edges = [row for row in reference("S2_bilinear")["returns"] if "hard: edge 1e-" in row["kind"] and row["params"] == "w085"]
    assert len(edges) >= 2
    found = made.itineraries([numbers(row["start"]) for row in edges])
    assert (np.minimum(found.clearance, found.slowest**2) < 1e-2).all()
    plain = made.itineraries([[1.0, 1.0]])
    assert plain.turns[0] == str(plain.words[0]).count("v") == 1


def broken(**changes):
    """A soft impact with some formulas replaced."""
    return type("Broken", (SoftImpact,), changes)(xi=0.01, e=1.26, a=0.7, beta=29, w=0.75)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"modes": lambda self, t, y: {"free": {"x": y.v, "v": y.x * y.v}, "contact": {}}},
            message("exact.rates-of", names="x, v"),
        ),
        (
            {"modes": lambda self, t, y: {"free": {"x": y.v}, "contact": {"x": 0, "v": 0}}},
            message("exact.rates-of", given="x", names="x, v"),
        ),
        (
            {"guards": lambda self, t, y: {"C": nsmaps.Guard("fre", y.x)}},
            message("exact.guard-mode-near", name="fre", near="free"),
        ),
        (
            {"guards": lambda self, t, y: {"C": nsmaps.Guard("free", y.x, reset={"z": 0})}},
            message("exact.guard-resets", name="z"),
        ),
        (
            {"section": lambda self, t, y: nsmaps.PoincareSection("D", ("v", "phi"))},
            message("exact.section-at", guard="D", guards="C, F"),
        ),
        (
            {"section": lambda self, t, y: nsmaps.PoincareSection("C", ("phi",))},
            message("exact.section-open-not-linear", names="x and v"),
        ),
        ({"period": lambda self: None}, message("exact.no-period")),
    ],
)
def test_formulas_that_are_none_are_refused(changes, said):
    with pytest.raises(SystemDefinitionError, match=said):
        broken(**changes).first_return([[1.0, 1.0]])
