"""Pieces whose image is that of several returns, on a tent map with the words BB and BTB, known in closed form."""

import functools
from dataclasses import dataclass
from math import log

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.dynamics.attractors.limit_set import limit_set
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.dynamics.iterated import IteratedMap
from nsmaps.errors import FitError
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.family import WordFamily
from nsmaps.exact.surfaces.surface import Axis, Grid
from nsmaps.exact.surfaces.sweep import surfaces
from nsmaps.reduced.composite.composite import PieceSpec, build_composite
from nsmaps.reduced.composite.parametric import chebyshev_nodes, parametric_map
from nsmaps.reduced.conditions.region import ConditionRegion
from nsmaps.reduced.fit.polyfit import PolynomialFit
from nsmaps.reduced.validation.words import misleads

WALLS = ("B", "T")
GRID = Grid(axes={"x": Axis(low=-0.9, high=1.1, points=51)})
LEFT, RIGHT = 0.5, -1.5


@dataclass(frozen=True)
class Tent(ReturnMap):
    """x' = left x + 1 with the word BB where x <= 0, x' = right x + 1 with BTB beyond.

    The cycle of both branches has x = (1 + right)/(1 - left right) <= 0 and the multiplier left right.
    """

    left: float = LEFT
    right: float = RIGHT
    coordinates = ("x",)

    def first_return(self, states, derivative=False) -> Returns:
        x = np.asarray(states, float)
        slope = np.where(x[:, 0] <= 0, self.left, self.right)
        words = ["BB" if each <= 0 else "BTB" for each in x[:, 0].tolist()]
        slopes = slope[:, None, None] if derivative else None
        return Returns.of_map(("x",), x, slope[:, None] * x + 1, slopes, words, WALLS)


def families(*words):
    return [WordFamily(name=word, words=(word,)) for word in words]


def piece(name, text, family, degree=1):
    region = ConditionRegion(text=text, coordinates=("x",))
    return PieceSpec(name=name, region=region, family=family, fit=PolynomialFit(degrees={"x": degree}))


def augmented(tent, *words, family="BBTB"):
    """The composite map of a tent in which what makes a return BB and then BTB is one piece."""
    found = surfaces(tent, GRID, families("BTB", family, *words))
    return build_composite(("x",), WALLS, found, [piece("R1", "x > 0", "BTB"), piece("R2", "x <= 0", family)])


@pytest.mark.parametrize("family", ["BBTB", "BB+TB"])
def test_a_piece_of_two_returns(family):
    tent = Tent()
    made = augmented(tent, family=family)
    assert [(each.word, each.returns, each.title) for each in made.pieces] == [
        ("BTB", 1, "R1 (BTB)"),
        ("BBTB", 2, "R2 (BBTB, 2 returns)"),
    ]
    assert made.title == "composite map (2 returns by R2)"
    states = GRID.states()
    ours = made.first_return(states, derivative=True)
    there = IteratedMap(tent, made.returns_of).first_return(states, derivative=True)
    np.testing.assert_allclose(ours.image, there.image, atol=1e-12)
    np.testing.assert_allclose(ours.derivative[:, 0, 0], np.where(states[:, 0] > 0, RIGHT, LEFT * RIGHT), atol=1e-10)
    np.testing.assert_allclose(there.derivative, ours.derivative, atol=1e-10)
    assert ours.words.tolist() == there.words.tolist()
    assert ours.numbers.tolist() == there.numbers.tolist() == np.where(states[:, 0] > 0, 1, 2).tolist()
    assert misleads(made, GRID, tent, tent.first_return(states)).wrong_words == 0


def test_orbits_periods_and_names_count_returns():
    tent = Tent()
    made, cycle = augmented(tent), (1 + RIGHT) / (1 - LEFT * RIGHT)
    path, exact = nsmaps.orbit(made, [0.9], 300), nsmaps.orbit(tent, [0.9], 600)
    np.testing.assert_allclose(path.states, exact.states[np.append(0, path.numbers.cumsum())], atol=1e-12)
    found = limit_set(made, path)
    assert (found.period, found.label, found.words, found.stable) == (2, "2:1, period 2", ("BBTB",), True)
    np.testing.assert_allclose(found.states, [[cycle]], atol=1e-12)
    assert found.multipliers.real == pytest.approx([LEFT * RIGHT], abs=1e-9)
    assert limit_set(tent, exact).label == found.label
    fixed = nsmaps.periodic_orbit(made, [-0.3])
    assert (fixed.period, fixed.label, len(fixed.states)) == (2, "2:1, period 2", 1)
    assert nsmaps.periodic_orbit(IteratedMap(tent, 2), [-0.3]).period == 2


@pytest.mark.parametrize("slope", [1.2, 1.5])
def test_exponents_are_per_return(slope):
    """Every return of a tent with slopes of one size stretches by it."""
    tent = Tent(slope, -slope)
    for return_map in (tent, augmented(tent)):
        assert nsmaps.lyapunov(return_map, starts=[0.3], n_returns=2000).exponents[0] == pytest.approx(log(slope), rel=1e-9)
    found = limit_set(augmented(tent), nsmaps.orbit(augmented(tent), [0.3], 200))
    assert found.meaning == "chaos"
    assert found.exponent == pytest.approx(log(slope), rel=0.02)  # of images that count one or two


def test_basins_count_returns():
    """An orbit comes to its cycle by a factor of left right in two returns."""
    tent = Tent()
    made, states = augmented(tent), np.linspace(-0.6, -0.05, 9)[:, None]
    ours, exact = (nsmaps.basins(formulas, states, max_returns=200) for formulas in (made, tent))
    assert [(each.period, each.label, len(each.states)) for each in ours.attractors] == [(2, "2:1, period 2", 1)]
    assert [(each.period, each.label, len(each.states)) for each in exact.attractors] == [(2, "2:1, period 2", 2)]
    cycle = (1 + RIGHT) / (1 - LEFT * RIGHT)
    near = ours.attractors[0].reach * ours.attractors[0].scale
    steps = np.ceil(np.log(near / np.abs(states[:, 0] - cycle)) / np.log(-LEFT * RIGHT))
    assert ours.arrival.tolist() == (2 * steps).astype(int).tolist()


@pytest.mark.thorough
def test_diagrams_count_returns_and_windows_end_where_they_do():
    """The cycle of both branches loses stability where left right = -1."""
    values = np.linspace(-2.21, -1.4, 7)
    for map_of in (functools.cache(lambda right: augmented(Tent(right=right))), lambda right: Tent(right=right)):
        diagram = nsmaps.bifurcation_diagram(map_of, "p", values, [-0.3], n_returns=32, transient=400)
        stable = values * LEFT > -1 + 1e-9
        assert (diagram.period[stable] == 2).all()
        assert set(diagram.labels[stable].ravel().tolist()) == {"2:1, period 2"}
        assert not (diagram.period[~stable] == 2).any()
        (window,) = (each for each in windows(diagram, map_of, [-0.3], 400) if each.label == "2:1, period 2")
        assert window.low.value == pytest.approx(-2, abs=1e-6)
    assert set(diagram.length[stable].ravel().tolist()) == {2}


def test_members_of_different_numbers_of_returns_are_refused():
    found = surfaces(Tent(), GRID, families("B+TB"))
    with pytest.raises(FitError, match=message("reduced.mixed-returns", family="B+TB", numbers="28 of 1, 23 of 2")):
        build_composite(("x",), WALLS, found, [piece("R", "x <= 2", "B+TB")])
    made = build_composite(("x",), WALLS, found, [piece("R1", "x > 0", "B+TB"), piece("R2", "x <= 0", "B+TB")])
    assert [each.returns for each in made.pieces] == [1, 2]


def test_files_keep_the_number_of_returns(tmp_path):
    made = augmented(Tent())
    for language, suffix in (("json", "json"), ("python", "py")):
        file = tmp_path / f"tent.{suffix}"
        nsmaps.export(made, language, tmp_path, name="tent")
        assert [each.returns for each in nsmaps.load_map(file).pieces] == [1, 2]
    for language in ("python", "c", "matlab", "julia", "javascript", "latex"):
        texts = nsmaps.export(made, language, name="tent")
        assert "BBTB, 2 returns" in (texts if isinstance(texts, str) else "".join(texts.values())), language


def test_a_map_of_a_parameter_keeps_the_number_of_returns():
    nodes = chebyshev_nodes((-1.9, -1.2), 3)
    made = parametric_map({right: augmented(Tent(right=right)) for right in nodes.tolist()}, "right", (-1.9, -1.2), 1)
    found = nsmaps.periodic_orbit(made.at(-1.7), [-0.3])
    assert found.period == 2
    assert found.states[0, 0] == pytest.approx(-0.7 / 1.85, abs=1e-12)


def test_a_domain_says_of_which_map_it_is():
    made = augmented(Tent())
    domain = attracting_domain(made, [(-0.5, -0.06)], max_updates=40)
    assert domain.forward_invariant
    assert domain.claim == "enclosed for the composite map (2 returns by R2)"
    assert domain.box[0] == pytest.approx([-2 / 7, -2 / 7], abs=1e-3)
