"""Studies of maps given by formulas, and of maps in Python: what they have, and what is refused at its line."""

import re

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.errors import StudyError
from nsmaps.exports.write import left_out
from nsmaps.study.prepare import prepare

CLASSES = """
import numpy as np
import nsmaps

class Formula(nsmaps.PiecewiseMap):
    a: float = 1.0
    b: float = 0.3
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"L": (x.x < 0, {"x": 1 + self.a * x.x + x.y, "y": self.b * x.x}),
                "R": (True, {"x": 1 - self.a * x.x + x.y, "y": self.b * x.x})}

class Program(nsmaps.System):
    a: float = 1.0
    b: float = 0.3
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        x, y = states.T
        slopes = np.zeros((len(x), 2, 2))
        slopes[:, 0, 0], slopes[:, 0, 1], slopes[:, 1, 0] = -self.a * np.sign(x), 1, self.b
        words = np.where(x < 0, "L", "R").tolist()
        return nsmaps.Returns.of_map(
            self.coordinates, states, np.stack([1 - self.a * np.abs(x) + y, self.b * x], axis=1), slopes, words, ("L", "R")
        )
"""
GRID = "{x: {from: -1.0, to: 1.5, points: 21}, y: {from: -0.5, to: 0.5, points: 21}}"


@pytest.fixture
def study(tmp_path):
    (tmp_path / "lozi.py").write_text(CLASSES)

    def made(kind, sections):
        file = tmp_path / "study.yaml"
        file.write_text(f"system: lozi.py:{kind}\ngrid: {GRID}\n{sections}\n")
        return nsmaps.load_study(file)

    return made


@pytest.mark.parametrize("kind", ["Formula", "Program"])
def test_a_study_of_a_map(study, kind):
    """The fixed point 1 / (1 + a - b) doubles at a = 1 - b; the pieces are affine, so that fits of order one are the map."""
    fits = [
        f"{{name: {n}, family: {n}, box: {{x: {x}, y: [-0.5, 0.5]}}, fit: {{full: {{x: 1, y: 1}}}}}}"
        for n, x in (("left", "[-1, 0]"), ("right", "[0, 1.5]"))
    ]
    found = nsmaps.run_study(
        study(
            kind,
            f"""
families: {{left: [L], right: [R]}}
composite: [{", ".join(fits)}]
orbits: [{{start: {{x: 0.1, y: 0.1}}, n_returns: 60}}]
branches: [{{name: fixed, parameter: a, bounds: [0.4, 0.9], value: 0.5, start: {{x: 0.8, y: 0.2}}}}]
""",
        )
    )
    states = np.random.default_rng(0).uniform([-1, -0.5], [1.5, 0.5], (50, 2))
    assert np.abs(found.composite.first_return(states).image - found.system.first_return(states).image).max() < 1e-12
    (event,) = found.branches["fixed"][0].events
    assert (event.kind, event.value) == ("period doubling", pytest.approx(0.7, abs=1e-12))
    cycle = found.orbits[0].exact.states[-2:]
    assert sorted(found.orbits[0].exact.words[-2:]) == ["L", "R"]
    assert np.abs(found.system.first_return(cycle).image - cycle[::-1]).max() < 1e-9
    exported = nsmaps.export(found, "python")
    assert ("formula.py" in exported, "composite_map.py" in exported) == (kind == "Formula", True)
    assert [why.split(":")[0] for why in left_out(found, "c")] == ["the exact map"] * (kind == "Program")


def test_cells_in_a_study_of_a_map(study):
    """The fixed point attracts at a = 0.5, within cells that are forward invariant."""
    found = nsmaps.run_study(
        study("Formula", "parameters: {a: 0.5}\nmorse_sets: {box: {x: [-1, 1.5], y: [-0.5, 0.5]}, depth: 4}")
    )
    assert (found.morse_sets.of, found.forward_invariant_set.of, found.forward_invariant_set.forward_invariant) == (
        "map Formula",
        "map Formula",
        True,
    )
    assert found.morse_sets.contains(np.array([[1 / 1.2, 0.3 / 1.2]])).all()


PLACE = r"study\.yaml:[34]:\d+"


@pytest.mark.parametrize(
    ("sections", "said"),
    [
        (
            "noise: {sigma: [0.1], tau: 0.1, start: {x: 0.1, y: 0.1}, modes: {a: [L]}}",
            message("dynamics.no-motion-for-noise", tau=0.1, map="Formula", at=re.compile(PLACE)),
        ),
        (
            "noise: {sigma: [0.1], scale: {z: 1}, start: {x: 0.1, y: 0.1}, modes: {a: [L]}}",
            message("dynamics.foreign-scale", name="z", at=re.compile(PLACE)),
        ),
        (
            "noise: {sigma: [0.1], step: 0.1, start: {x: 0.1, y: 0.1}, modes: {a: [L]}}",
            message("study.no-correlation-time", at=re.compile(PLACE)),
        ),
        (
            "orbits: [{start: {x: 0.1, y: 0.1}, n_returns: 5, track: 5}]",
            message("exact.no-motion", what="a trajectory", map="Formula", at=re.compile(PLACE)),
        ),
        (
            "orbits: [{start: {x: 0.1, y: 0.1}, n_returns: 5}]\nobserve: {observables: [impacts]}",
            message("exact.observable", name="impacts", map="Formula", at=re.compile(PLACE)),
        ),
        (
            "noise: {sigma: [0.1], start: {x: 0.1, y: 0.1}, modes: {a: [LR]}}",
            message("study.not-one-letter", word="LR", at=re.compile(PLACE)),
        ),
        ("families: {a: [L, LR]}", message("study.not-one-letter", word="LR", letters="L, R", at=re.compile(PLACE))),
        (
            "branches: [{name: a, parameter: a, bounds: [0, 2], start: {x: 0.1, y: 0.1}, chatter: true}]",
            message("exact.no-motion", what="complete chatter", map="Formula", at=re.compile(PLACE)),
        ),
        ("proof: {start: {x: 0.1, y: 0.1}, top: 1.0}", message("study.proof-of-flights", name="top", at=re.compile(PLACE))),
    ],
)
def test_what_a_map_lacks_is_refused_at_its_line(study, sections, said):
    with pytest.raises(StudyError, match=said):
        prepare(study("Formula", sections))


def test_noise_on_the_images_of_a_map_and_of_its_composite_map(study):
    """Pieces that are fitted exactly have, under kicks of the same law, the same residence within its error."""
    fits = [
        f"{{name: {n}, family: {n}, box: {{x: {x}, y: [-0.5, 0.5]}}, fit: {{full: {{x: 1, y: 1}}}}}}"
        for n, x in (("left", "[-1, 0]"), ("right", "[0, 1.5]"))
    ]
    text = f"""
parameters: {{a: 0.6}}
families: {{left: [L], right: [R]}}
composite: [{", ".join(fits)}]
noise:
  sigma: [0.05, 0.25]
  scale: {{x: 1}}
  start: {{x: 0.8, y: 0.2}}
  n_returns: 1000
  n_realisations: 16
  modes: {{fixed: [R], left: [L, R]}}
  min_returns: 4
  map: [exact, composite]
"""
    found = nsmaps.run_study(study("Formula", text)).noise
    assert found.stays[0].share.tolist() == [1.0, 0.0]
    exact, reduced = found.counted[1], found.reduced[1]
    assert np.array_equal(exact.switches, found.stays[1].switches)
    assert exact.switches.sum() > 100
    assert np.abs(exact.share - reduced.share).max() < 0.05
    assert np.abs(exact.rates - reduced.rates)[0, 1] < 5 * np.hypot(exact.rates_error, reduced.rates_error)[0, 1]


def test_observables_and_an_optimum_of_a_map(study):
    """The fixed point on the right is 1/(1 + a - b), of multipliers within the circle up to a = 1 - b."""
    text = """
orbits: [{start: {x: 0.1, y: 0.1}, n_returns: 300}]
branches: [{name: fixed, parameter: a, bounds: [0.4, 0.6], value: 0.5, start: {x: 0.8, y: 0.2}}]
bifurcation_diagram: {parameter: a, from: 0.4, to: 0.6, points: 3, starts: [{x: 0.8, y: 0.2}], n_returns: 10, transient: 300}
parameters: {a: 0.5}
observe: {observables: [x, {name: right, formula: "1", at: R}, {name: area, formula: x*y, largest: true}]}
optimize:
  observable: x
  bounds: {a: [0.3, 1.0]}
  start: {x: 0.8, y: 0.2}
  multiplier: 0.9
  sense: min
  noisy: {sigma: [0.01], scale: {x: 1}, n_returns: 200, n_realisations: 8}
figures: [observe, bifurcation_diagram]
"""
    found = nsmaps.run_study(study("Formula", text))
    a = found.bifurcation_diagram["exact"].values
    assert found.observe["bifurcation_diagram"].per_return.value[:, 0, 0] == pytest.approx(1 / (0.7 + a), abs=1e-10)
    for means, branch in zip(found.branch_observables["fixed"], found.branches["fixed"], strict=True):
        assert len(branch.values) > 3
        assert means.per_return.derivative[:, 0] == pytest.approx(-1 / (0.7 + branch.values) ** 2, rel=1e-9)
        assert means.per_return.value[:, 1] == pytest.approx(1.0)
    at = (0.81 - 0.3) / 0.9  #: where -0.9 is a multiplier: m^2 + a m = b
    assert found.optimize.parameters["a"] == pytest.approx(at, abs=1e-6)
    noisy = found.noisy_optimum
    assert abs(noisy.value[0] - 1 / (0.7 + at)) < 5 * noisy.error[0]


def test_projections_of_a_map_on_the_circle_leave_out_parts_without_states(tmp_path):
    from nsmaps.study.study import CATALOGUE

    (tmp_path / "turn.py").write_text("""
import nsmaps

class Turn(nsmaps.PiecewiseMap):
    b: float = 1.0
    coordinates = ("w", nsmaps.Angle("phi"))

    def pieces(self, x):
        image = {"w": x.w / 2, "phi": x.phi + self.b}
        return {"F": (x.phi > 4, image), "S": (True, image)}
""")
    axes = "{w: {from: -1, to: 1, points: 5}, phi: {from: 0, to: 2*pi, points: 21}}"
    (tmp_path / "study.yaml").write_text(f"system: turn.py:Turn\ngrid: {axes}\nfamilies: {{late: [F], early: [S]}}\n")
    found = CATALOGUE["projections"].sheets(nsmaps.run_study(nsmaps.load_study(tmp_path / "study.yaml")))
    assert [(sheet.name, len(sheet.panels)) for sheet in found] == [("projections-late", 2), ("projections-early", 4)]
