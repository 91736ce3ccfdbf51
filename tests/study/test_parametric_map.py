"""A study's parametric map against the exact map: on the bouncing ball, whose first period doubling is known in closed form."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from messages import message

from nsmaps import load_study, load_system, read_result, run_study
from nsmaps.errors import NsmapsError

# Gamma^2 is (pi (1 - r) / (1 + r))^2 + (2 (1 + r^2) / (1 + r)^2)^2 at the doubling of one impact a period
DOUBLING = np.sqrt((np.pi / 3) ** 2 + (2 * 1.25 / 1.5**2) ** 2)
STUDY = """\
system: bouncing_ball
parameters: {Gamma: 1.4, r: 0.5}
grid: {v: {from: 3.6, to: 4.8, points: 25}, phi: {from: 0, to: 1.6, points: 25}}
families: {BB: [BB]}
composite:
  - name: R1
    box: {v: [3.6, 4.8], phi: [0.1, 1.6]}
    family: BB
    data: 3.7 <= v <= 4.7 and (phi - 0.7 - (Gamma - 1.4))**2 <= 0.2
    fit: {full: {v: 4, phi: 5}}
parametric_map:
  parameter: Gamma
  bounds: [1.35, 1.6]
  degree: 3
  degrees: {R1: {v: 2}}
  compare: {start: {v: 4.2, phi: 0.7}, points: 21, transient: 1000, n_returns: 60, tolerance: 0.05}
  require: [follows]
bifurcation_diagram:
  {parameter: Gamma, from: 1.5, to: 1.56, points: 13, starts: [{v: 4, phi: 0.7}], transient: 99, n_returns: 9,
   map: [exact, parametric]}
"""


@pytest.fixture(scope="module")
def made(computed):
    return computed(STUDY, "ball")


def test_the_parametric_map_follows_the_exact_one(made):
    """One impact a period has v = 4 pi / 3 and cos phi = pi / (3 Gamma), up to the doubling."""
    result, folder = made
    (verdict,) = (v for v in result.verdicts if v.name == "parametric_map: follows")
    assert (verdict.holds, verdict.required) == (True, True), verdict.text
    single = result.agreement.values < DOUBLING
    assert (result.agreement.exact[:, 0] == "1:0/T").tolist() == single.tolist()
    assert (result.agreement.labels[:, 0] == "1:0, period 1").tolist() == single.tolist()
    for gamma in (1.35, 1.45, 1.5):
        state = result.parametric_map.at(gamma).orbits([[4.2, 0.7]], 2000).image[-1]
        assert state == pytest.approx([4 * np.pi / 3, np.arccos(np.pi / 3 / gamma)], abs=5e-3)
    again = read_result(folder)
    assert np.array_equal(again.agreement.holds, result.agreement.holds)
    record = json.loads((folder / "result.json").read_text())["numbers"]["parametric_map"]
    assert (record["compared"], record["disagreements"]) == (21, [])


def test_period_doublings_of_both_maps_are_located(made):
    result, _ = made
    for of, near in (("exact", 1e-9), ("parametric", 5e-3)):
        border = next(
            window.high
            for window in result.bifurcation_diagram[of].windows
            if window.high.kind in ("period doubling", "period halving")
        )
        assert border.value == pytest.approx(DOUBLING, abs=near)
    fixed = result.parametric_map.piece("R1").map  # whose multiplier is -1 at its own doubling, by differences of its polynomial

    def multiplier(gamma):
        state = np.array([4 * np.pi / 3, np.arccos(np.pi / 3 / gamma)])
        for _ in range(50):
            h = 1e-6 * np.eye(2)
            at = [fixed([[*point, gamma]])[0, :2] for point in (state, *(state + h), *(state - h))]
            slope = np.column_stack([(at[1] - at[3]) / 2e-6, (at[2] - at[4]) / 2e-6])
            state = state - np.linalg.solve(slope - np.eye(2), at[0] - state)
        return np.linalg.eigvals(slope).real.min()

    assert multiplier(border.value) == pytest.approx(-1, abs=1e-6)


def test_a_map_of_too_low_an_order_does_not_follow():
    """Of order 0 it has one motion at every value, which the exact map has not."""
    text = STUDY.replace("degree: 3", "degree: 0").replace("degrees: {R1: {v: 2}}", "degrees: {R1: 0}").split("bifurcation")[0]
    result = run_study(write(text))
    (verdict,) = (v for v in result.verdicts if v.name == "parametric_map: follows")
    first, last = result.agreement.disagreements()
    assert not verdict.holds
    assert verdict.text.startswith(
        f"no: at {first.count + last.count} of 21 values of Gamma from 1.35 to 1.6 orbits from (v = 4.2, phi = 0.7) end on "
    )
    stated = text.replace("tolerance: 0.05", f"tolerance: 0.05, except: [[1.3, {first.high}], [{last.low}, 1.6]]")
    (verdict,) = (v for v in run_study(write(stated)).verdicts if v.name == "parametric_map: follows")
    assert verdict.text.startswith(f"yes: at {21 - first.count - last.count} values of Gamma from 1.35 to 1.6 outside [1.3, ")


def test_a_piece_is_a_map_of_all_states_that_is_fitted_at_every_value():
    section = (
        "parameter: Gamma, from: 1.4, to: 1.5, points: 2, starts: [{v: 4.2, phi: 0.7}], transient: 30, n_returns: 4, map: [R1]"
    )
    result = run_study(write(f"{STUDY.split('parametric_map:')[0]}bifurcation_diagram: {{{section}}}"))
    assert result.map_title("R1") == "fitted map R1"
    fitted = run_study(write(STUDY.split("parametric_map:")[0].replace("1.4, r", "1.5, r"))).composite.piece("R1").map
    state = np.array([4.2, 0.7])
    for _ in range(34):
        state = fitted([state])[0]
    assert result.bifurcation_diagram["R1"].states[1, 0, -1] == pytest.approx(state, abs=1e-9)


HENON = """
from nsmaps import PiecewiseMap


class Henon(PiecewiseMap):
    a: float = 1.0
    b: float = 0.3
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"H": (True, {"x": 1 - self.a * x.x**2 + x.y, "y": self.b * x.x})}
"""
OF_HENON = """\
system: henon.py:Henon
parameters: {a: 0.3, b: 0.3}
grid: {x: {from: -1.5, to: 1.5, points: 5}, y: {from: -0.5, to: 0.5, points: 5}}
families: {H: [H]}
composite: [{name: all, where: x**2 < 9, family: H, fit: {full: {x: 2, y: 1}}}]
parametric_map:
  {parameter: a, bounds: [0.2, 1.4], degrees: {all: 1}, compare: {start: {x: 0, y: 0}, points: 9}, require: [follows]}
"""


def test_a_map_whose_coefficients_are_linear_in_its_parameter_is_the_exact_one():
    """Of the Henon map periods double at a = 3 (1 - b)^2 / 4 = 0.3675 and (1 - b)^2 + (1 + b)^2 / 4 = 0.9125."""
    Path("henon.py").write_text(HENON)
    result = run_study(write(OF_HENON))
    (verdict,) = (v for v in result.verdicts if v.name == "parametric_map: follows")
    assert verdict.holds, verdict.text
    found = result.agreement
    assert [each.rpartition("period ")[2] for each in found.labels[:5, 0]] == ["1", "1", "2", "2", "2"]
    assert found.labels[-1, 0].endswith("C")
    assert max(result.parametric_map.report.error.max(), result.parametric_map.report.difference.max()) < 1e-13
    states, a = np.random.default_rng(0).uniform(-1, 1, (20, 2)), 0.77
    x, y = states.T
    image = result.parametric_map.at(a).first_return(states).image
    np.testing.assert_allclose(image, np.column_stack([1 - a * x**2 + y, 0.3 * x]), atol=1e-13)


SEVERAL = """\
system: vi_pair
parameters: {d: 0.2265, r: 0.25, M: 0.1245, g: 9.8, beta: pi/6, F: 5}
grid: {v: {from: 0.01, to: 1, points: 50}, phi: {from: 0, to: pi, points: 50}}
families: {two: [BTBB], BTB: [BTB]}
composite:
  - {name: R2, where: v < 0.5, family: two, fit: {full: {v: 4, phi: 4}}, data: (v - 0.08)**2 + ((phi - 1.83)/3)**2 < 0.005}
  - {name: R1, where: v >= 0.5, family: BTB, fit: {full: {v: 4, phi: 4}}}
parametric_map:
  {parameter: d, bounds: [0.224, 0.2268], degree: 1, compare: {start: {v: 0.07, phi: 1.83}, points: 3, n_returns: 50,
   transient: 60}}
"""


def test_pieces_of_several_returns_are_compared_with_as_many_of_the_exact_map():
    """2:1 is a cycle of two returns to B, one image of the piece BTBB, at (0.072199, 1.828844) for d = 0.2265."""
    result = run_study(write(SEVERAL))
    found = result.agreement
    assert found.holds.all()
    assert found.distance.max() < 1e-3
    assert result.parametric_map.at(0.2265).first_return([[0.072199, 1.828844]]).image[0] == pytest.approx(
        [0.072199, 1.828844], abs=1e-3
    )


@pytest.mark.parametrize(
    ("said", "says", "told"),
    [
        (
            "map: [exact, parametric]",
            "map: [exact, R2]",
            message("errors.unknown", kind="map", name="R2", known="exact, composite, R1, parametric"),
        ),
        ("map: [exact, parametric]", "map: [exact, exact]", message("study.map-twice")),
        (
            "bifurcation_diagram:\n  {parameter: Gamma",
            "bifurcation_diagram:\n  {parameter: r",
            message("study.over-another", parameter="Gamma", other="r"),
        ),
        ("degrees: {R1: {v: 2}}", "degrees: {R2: 2}", message("errors.unknown", kind="piece", name="R2")),
        ("degrees: {R1: {v: 2}}", "degrees: {R1: {w: 2}}", message("errors.unknown", kind="coordinate", name="w")),
        ("degrees: {R1: {v: 2}}", "n_nodes: 3", message("study.nodes", nodes=3, degree=3)),
        ("tolerance: 0.05", "except: [[1.5, 1.4]]", message("study.empty", range="[1.5, 1.4]")),
        ("(Gamma - 1.4)", "(gama - 1.4)", message("errors.unknown-near", kind="name", name="gama", near="Gamma")),
        ("name: R1", "name: parametric", message("study.piece-named-as-map", name="parametric")),
    ],
)
def test_what_is_refused(said, says, told):
    text = STUDY.replace("from: 1.5, to: 1.56", "from: 0.4, to: 0.5") if "parameter: r" in says else STUDY
    assert text.count(said) == 1
    with pytest.raises(NsmapsError) as caught:
        run_study(write(text.replace(said, says)))
    assert re.search(told, str(caught.value))


def test_data_move_with_the_parameter():
    """The fit at a value is the least squares of NumPy over the states that the condition has there."""
    for gamma in (1.35, 1.55):
        result = run_study(write(STUDY.split("parametric_map:")[0].replace("1.4, r", f"{gamma}, r")))
        system = load_system("bouncing_ball", Gamma=gamma, r=0.5)
        v, phi = (axis.ravel() for axis in np.meshgrid(np.linspace(3.6, 4.8, 25), np.linspace(0, 1.6, 25), indexing="ij"))
        inside = (v >= 3.7) & (v <= 4.7) & ((phi - 0.7 - (gamma - 1.4)) ** 2 <= 0.2)
        states = np.column_stack([v, phi])[inside]
        returns = system.first_return(states)
        known = returns.words == "BB"
        powers = [(i, j) for i in range(5) for j in range(6) if i + j <= 5]
        columns = np.column_stack([(states[known, 0] - 4.2) ** i * (states[known, 1] - 0.8) ** j for i, j in powers])
        best = np.linalg.lstsq(columns, returns.image[known, 0], rcond=None)[0]
        ours = result.composite.piece("R1").map(states[known])[:, 0]
        assert ours == pytest.approx(columns @ best, abs=1e-9)


def write(text):
    Path("study.yaml").write_text(text)
    return load_study("study.yaml")
