"""Why a box is not carried into itself: what its states do, and what the derivative at a fixed point forbids."""

import re
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pytest
from boxmaps import Henon, one_each, plain_returns

from nsmaps.auxiliary.attracting_domain import attracting_domain, smallest_box
from nsmaps.auxiliary.bounds import ErrorBound
from nsmaps.coordinates import Angle
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.reduced.fit.polymap import PolyMap


def turning(share: float, degrees: float) -> PolyMap:
    """A turn of the plane that shrinks to a share, about (1, 2)."""
    c, s = share * np.cos(np.radians(degrees)), share * np.sin(np.radians(degrees))
    rows = {"x": (c, -s, 1 - c + 2 * s), "y": (s, c, 2 - s - 2 * c)}
    keys = (1, 0), (0, 1), (0, 0)
    images = {name: {key: Fraction(value) for key, value in zip(keys, row, strict=True)} for name, row in rows.items()}
    return PolyMap.of_monomials(("x", "y"), images, [[-9, 9], [-9, 9]])


def test_a_stable_point_whose_worst_case_expands_has_no_box_of_any_sides() -> None:
    """0.84 of a turn by 45 degrees: multipliers of size 0.84, |J| all 0.594, whose spectral radius is 1.188."""
    return_map = turning(0.84, 45)
    domain = attracting_domain(return_map, [[0, 2], [1, 3]])
    assert not domain.forward_invariant
    said = "at its stable fixed point (x = 1, y = 2) the absolute derivatives have spectral radius 1.188, more than 1"
    assert f"; {said}: no small box about it is carried into itself, whatever its sides; cells " in domain.reason
    assert domain.reason.endswith("`morse_sets`")
    for aspect in np.geomspace(1e-3, 1e3, 41):
        half = 0.1 * np.array([aspect, 1 / aspect])
        box = np.array([1, 2])[:, None] + half[:, None] * [-1, 1]
        assert not attracting_domain(return_map, box, max_updates=1).forward_invariant


@pytest.mark.parametrize(("share", "degrees"), [(0.7, 40), (0.5, 80), (0.65, 10)])
def test_sides_that_are_told_are_those_of_a_box_that_is_trapped(share: float, degrees: float) -> None:
    """In units of x in which a square is not forward invariant, as its image is wider than it is high."""
    plain = turning(share, degrees)
    rows = np.array([plain([[1.0, 2.0 + k]])[0] for k in (0, 1)]), np.array([plain([[1.0 + k, 2.0]])[0] for k in (0, 1)])
    j = np.column_stack([np.diff(rows[1], axis=0)[0], np.diff(rows[0], axis=0)[0]])
    unit = 20.0
    scaled = np.array([[j[0, 0], j[0, 1] * unit], [j[1, 0] / unit, j[1, 1]]])
    images = {name: {(1, 0): Fraction(a), (0, 1): Fraction(b)} for name, (a, b) in zip("xy", scaled.tolist(), strict=True)}
    return_map = PolyMap.of_monomials(("x", "y"), images, [[-9, 9], [-9, 9]])
    domain = attracting_domain(return_map, [[-1, 1], [-1, 1]], max_updates=1)
    radius = np.abs(np.linalg.eigvals(np.abs(scaled))).max()
    assert radius < 1
    assert not domain.forward_invariant
    assert f"spectral radius {radius:.4g}, less than 1" in domain.reason
    sides = [float(side) for side in re.search(r"sides as (\S+) : (\S+) are", domain.reason).groups()]
    box = 0.01 * np.array(sides)[:, None] * [-1, 1]
    assert attracting_domain(return_map, box, max_updates=1).forward_invariant


def test_of_a_fit_that_stands_for_another_map_the_derivative_is_not_told() -> None:
    box, error = [[0, 2], [1, 3]], ErrorBound(np.full(2, 1e-3), "held-out")
    assert "spectral radius" not in attracting_domain(turning(0.84, 45), box, error=error).reason
    assert "spectral radius" in attracting_domain(turning(0.84, 45), box, grow=True).reason


def test_a_point_outside_of_the_box_or_unstable_gives_no_reason() -> None:
    assert "spectral" not in attracting_domain(turning(0.84, 45), [[3, 4], [1, 3]]).reason
    assert "spectral" not in attracting_domain(Henon(1.4), [[0, 1], [-0.2, 0.4]]).reason


@dataclass
class Spiral(ReturnMap):
    """r' = 0.9 (r cos 1 - sin 1 (phi - 7)), phi' - 7 = 0.9 (r sin 1 + cos 1 (phi - 7)), phi an angle near 7."""

    coordinates: tuple = ("r", Angle("phi"))
    slope = 0.9 * np.array([[np.cos(1), -np.sin(1)], [np.sin(1), np.cos(1)]])

    def first_return(self, states, derivative=False):
        x = np.asarray(states, float)
        about = np.column_stack([x[:, 0], np.mod(x[:, 1] - 7 + np.pi, 2 * np.pi) - np.pi])
        slopes = np.broadcast_to(self.slope, (len(x), 2, 2)) if derivative else None
        return plain_returns(self.coordinates, x, about @ self.slope.T + [0, 7], slopes)


def test_the_point_is_told_on_the_turn_of_the_box() -> None:
    radius = np.abs(np.linalg.eigvals(np.abs(Spiral.slope))).max()
    domain = attracting_domain(Spiral(), [[-0.5, 0.5], [6.5, 7.5]], max_updates=1, n_samples=21)
    assert not domain.forward_invariant
    assert "(r = " in domain.reason
    assert f"phi = 7) the absolute derivatives have spectral radius {radius:.4g}, more than 1" in domain.reason


class Unknown(Henon):
    """Henon's map at a = 0.2, of which an enclosure knows nothing on boxes that meet x = 1."""

    def image_boxes(self, boxes):
        plain = super().image_boxes(boxes)
        return one_each(plain.images.copy(), ~((boxes[:, 0, 0] <= 1) & (boxes[:, 0, 1] >= 1)))


def test_an_enclosure_that_knows_nothing_is_no_state_without_image() -> None:
    domain = attracting_domain(Unknown(0.2), [[0.5, 1.5], [0, 0.5]])
    assert not domain.forward_invariant
    assert "some states of the box have no image" not in domain.reason
    unknown = "the enclosure does not decide for all states of the box where, or whether, they have an image"
    assert domain.reason.startswith(f"update 1: {unknown}; all 1004 states tried in it have one")
    none, why = smallest_box(Unknown(0.2), [[0.8, 1.2], [0.1, 0.2]])
    assert none is None
    assert "no image" not in why
    assert f"{unknown}; all 1004 states tried in it have one" in why


class Holed(Unknown):
    """The same, that indeed has no image where x < 0.75."""

    def first_return(self, states, derivative=False):
        made = super().first_return(states, derivative)
        made.image[made.start[:, 0] < 0.75] = np.nan
        return made


def test_a_state_without_image_is_named() -> None:
    reason = attracting_domain(Holed(0.2), [[0.5, 1.5], [0, 0.5]]).reason
    count = int(re.search(r"update 1: (\d+) of 1004 states tried in the box have no image, as \(x = 0.5, y = 0\)", reason)[1])
    assert count == pytest.approx(252, abs=60)
