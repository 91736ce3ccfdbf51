"""Maps given by formulas in pieces, against closed forms of the border-collision normal form, gap maps and circle maps."""

import re
import warnings
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps import Angle, PiecewiseMap
from nsmaps.errors import SystemDefinitionError
from nsmaps.testing import check_system


class BorderCollision(PiecewiseMap):
    """The normal form of a border collision in the plane."""

    tau_L: float
    delta_L: float
    tau_R: float
    delta_R: float
    mu: float = 1.0
    coordinates = ("x", "y")

    def pieces(self, x):
        return {
            "L": (x.x <= 0, {"x": self.tau_L * x.x + x.y + self.mu, "y": -self.delta_L * x.x}),
            "R": (True, {"x": self.tau_R * x.x + x.y + self.mu, "y": -self.delta_R * x.x}),
        }


class Gap(PiecewiseMap):
    """x -> a x + mu, and less by one where x is above zero: its cycle LR exists for a / (1 + a) < mu < 1 / (1 + a)."""

    a: float = 0.5
    mu: float = 0.5
    coordinates = ("x",)

    def pieces(self, x):
        return {"L": (x.x < 0, {"x": self.a * x.x + self.mu}), "R": (x.x > 0, {"x": self.a * x.x + self.mu - 1})}


class Turned(PiecewiseMap):
    """The circle map, in one piece; it is flat where `flat`."""

    tau: float
    b: float = 0.4
    flat: bool = False
    coordinates = (Angle("phi"),)

    def pieces(self, x):
        image = {"phi": x.phi + 2 * sp.pi * self.tau - self.b * sp.sin(x.phi)}
        return {"F": (x.phi > 3, {"phi": self.tau}), "S": (True, image)} if self.flat else {"S": (True, image)}


class Polynomial(PiecewiseMap):
    """A polynomial whose coefficients are a choice, not parameters."""

    coefficients: list[float]
    scale: float = 1.0
    coordinates = ("x",)

    def pieces(self, x):
        return {"P": (True, {"x": self.scale * sum(c * x.x**k for k, c in enumerate(self.coefficients))})}


class Root(PiecewiseMap):
    """x -> sqrt(x - a), of no real value to the left of a; in no piece beyond 4."""

    a: float = 1.0
    coordinates = ("x",)

    def pieces(self, x):
        return {"R": ((x.x >= -4) & (x.x <= 4), {"x": sp.sqrt(x.x - self.a)})}


FORM = {"tau_L": 1.4, "delta_L": 0.5, "tau_R": -1.2, "delta_R": 0.4}


def by_hand(x, y, n):
    """States and words of the normal form in rational numbers."""
    values = {name: Fraction(value) for name, value in FORM.items()}
    for _ in range(n):
        side = "L" if x <= 0 else "R"
        x, y = values[f"tau_{side}"] * x + y + 1, -values[f"delta_{side}"] * x
        yield side, x, y


def test_orbits_are_those_of_exact_numbers():
    found = nsmaps.orbit(BorderCollision(**FORM), [0.125, 0.5], 25)
    words, x, y = zip(*by_hand(Fraction(1, 8), Fraction(1, 2), 25), strict=True)
    assert found.words.tolist() == list(words)
    assert {"L", "R"} == set(words)
    assert np.abs(found.states[1:] - np.array([x, y], float).T).max() < 1e-10
    assert found.time.tolist() == [1.0] * 25


def test_derivatives_follow_from_the_formulas():
    return_map, states = BorderCollision(**FORM), np.array([[-0.3, 0.1], [0.3, 0.2], [0.0, 1.0]])
    returns = return_map.first_return(states, derivative=True)
    left, right = [[1.4, 1], [-0.5, 0]], [[-1.2, 1], [-0.4, 0]]
    assert returns.derivative.tolist() == [left, right, left]
    assert return_map.sensitivity(states, {"mu": 1, "tau_R": 2}) == pytest.approx(np.array([[1, 0], [1.6, 0], [1, 0]]), abs=1e-15)
    assert return_map.sensitivity([[np.nan, 0]], {"mu": 1}).tolist() == [[pytest.approx(np.nan, nan_ok=True)] * 2]
    many = return_map.orbits(states, 3, derivative=True)
    for k in range(3):
        step = return_map.first_return(states, derivative=True)
        assert np.array_equal(step.image, many.image[3 * k : 3 * k + 3])
        assert np.array_equal(step.derivative, many.derivative[3 * k : 3 * k + 3])
        states = step.image


def test_a_fixed_point_doubles_and_turns_into_a_circle_where_its_multipliers_say():
    """On the right 1 + tau + delta = 0 is a doubling, delta = 1 a Neimark-Sacker bifurcation, if tau is within (-2, 2)."""
    start = BorderCollision(**FORM)
    orbit = nsmaps.periodic_orbit(start, [0.4, -0.2])
    assert orbit.states[0] == pytest.approx([1 / 2.6, -0.4 / 2.6], abs=1e-14)
    assert sorted(abs(orbit.multipliers)) == pytest.approx(sorted(abs(np.roots([1, 1.2, 0.4]))), abs=1e-14)
    doubled = nsmaps.continue_branch(start, "tau_R", orbit, -1.2, (-1.6, -1.0), direction="down")
    assert [(event.kind, pytest.approx(event.value, abs=1e-12)) for event in doubled.events] == [("period doubling", -1.4)]
    turned = nsmaps.continue_branch(start, "delta_R", orbit, 0.4, (0.3, 1.2))
    assert [(event.kind, pytest.approx(event.value, abs=1e-10)) for event in turned.events] == [("Neimark-Sacker", 1.0)]


def test_a_cycle_ends_at_its_gap():
    orbit = nsmaps.periodic_orbit(Gap(), nsmaps.orbit(Gap(), [0.1], 200).final, 2)
    assert sorted(orbit.words) == ["L", "R"]
    for direction, end in (("down", 1 / 3), ("up", 2 / 3)):
        (event,) = nsmaps.continue_branch(Gap(), "mu", orbit, 0.5, (0.2, 0.8), direction=direction).events
        assert (event.kind, abs(event.value - end) <= event.precision < 1e-8) == ("border collision", True)


def test_angles_are_on_the_circle():
    """Images are those of the formula, on whichever turn the state is given."""
    return_map = Turned(tau=0.3)
    returns = return_map.first_return([[6.0], [6.0 + 4 * np.pi], [-0.5]])
    lifted = 6.0 + 0.6 * np.pi - 0.4 * np.sin(6.0)
    assert returns.lifted[:2, 0] == pytest.approx([lifted, lifted + 4 * np.pi], abs=1e-13)
    assert returns.image[:2, 0] == pytest.approx([lifted - 2 * np.pi] * 2, abs=1e-13)
    assert returns.turns[:, 0].tolist() == [1, 3, 0]
    flat = Turned(tau=0.3, flat=True)
    assert flat.first_return([[4.0], [4.0 - 2 * np.pi]]).words.tolist() == ["F", "F"]
    assert flat.letters == ("F", "S")


def test_states_without_an_image_have_their_outcome():
    returns = Root().first_return([[2.0], [0.5], [5.0], [np.inf]], derivative=True)
    assert returns.counts() == {"returned": 1, "uncovered": 1, "escaped": 1, "invalid": 1}
    assert returns.image[0, 0] == 1.0
    assert returns.derivative[0, 0, 0] == 0.5
    assert returns.words.tolist() == ["R", "", "", ""]
    later = Root().orbits([[2.0], [5.0]], 3)
    assert [later.outcome[k::2].tolist() for k in (0, 1)] == [[0, 0, later.outcome[4]], [later.outcome[1]] * 3]
    assert np.isnan(later.image[1::2]).all()


def test_fields_that_are_not_numbers_are_part_of_the_formulas():
    first, second = Polynomial(scale=2.0, coefficients=[1, 0, 3]), Polynomial(coefficients=[1, 1])
    assert [formulas.first_return([[0.5]]).image.item() for formulas in (first, second, first.at(scale=1.0))] == [3.5, 1.5, 1.75]
    assert first.parameter_names() == ("scale",)


def test_check_system_tries_a_map():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        check_system(BorderCollision(**FORM))
        check_system(Turned(tau=0.3))


@pytest.mark.parametrize(
    ("pieces", "text"),
    [
        (
            lambda self, x: {"L": (x.x < 0, {"x": x.x, "y": x.y})} if x.x < 1 else {},
            message("exact.relation", relation="x.x < 1"),
        ),
        (
            lambda self, x: {"L": (x.z < 0, {"x": x.x, "y": x.y})},
            message("exact.coordinate-of-piece", name="z", names="x.x, x.y"),
        ),
        (lambda self, x: {"L": (True, {"x": np.sin(x.x), "y": x.y})}, message("exact.numpys-functions")),
        (
            lambda self, x: {"L": (sp.zeta(x.x) > 1, {"x": x.x, "y": x.y})},
            message("exact.function-of-piece", formula=re.compile("zeta.* > 1")),
        ),
        (lambda self, x: {"L": (x.x < 0, {"x": x.x})}, message("exact.images-of-piece", given="x", names="x, y")),
        (
            lambda self, x: {"L": (x.x, {"x": x.x, "y": x.y})},
            message("exact.condition-of-piece", letter="L", cls="Broken", given="_y_0"),
        ),
        (
            lambda self, x: {"L": (True, {"x": sp.Symbol("q"), "y": x.y})},
            message("exact.symbols-of-piece", symbols="q", formula="q"),
        ),
        (lambda self, x: {"L": x.x}, message("exact.piece")),
        (lambda self, x: {"left": (True, {"x": x.x, "y": x.y})}, message("exact.piece-names", names="'left'")),
        (lambda self, x: {}, message("exact.pieces")),
    ],
)
def test_what_is_not_a_piece_is_refused(pieces, text):
    class Broken(PiecewiseMap):
        coordinates = ("x", "y")

    Broken.pieces = pieces
    Broken.__abstractmethods__ = frozenset()
    for call in (Broken().check_formulas, lambda: nsmaps.orbit(Broken(), [0, 0], 1)):
        with pytest.raises(SystemDefinitionError, match=text):
            call()
