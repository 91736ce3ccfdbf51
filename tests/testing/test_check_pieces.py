"""check_system of maps given by formulas: each mistake in pieces, in a map that has no other."""

import re
import warnings

import pytest
import sympy as sp
from messages import message

from nsmaps import Angle, PiecewiseMap
from nsmaps.errors import CheckError
from nsmaps.testing import check_system


class Sound(PiecewiseMap):
    """A kinked map with an angle and a border that depends on a parameter, of which the others change one part."""

    a: float = 0.5
    s: float = 0.25
    coordinates = ("x", Angle("phi"))

    def pieces(self, x):
        turned = x.phi + self.a * sp.sin(x.phi)
        return {
            "L": (x.x + self.a * sp.cos(x.phi) <= self.s, {"x": self.a * x.x, "phi": turned}),
            "R": (True, {"x": -self.a * x.x, "phi": turned + 1}),
        }


class Gapped(PiecewiseMap):
    s: float = 0.25
    coordinates = ("x",)

    def pieces(self, x):
        return {"L": (x.x < self.s, {"x": x.x / 2}), "R": (x.x > self.s, {"x": -x.x / 3})}


class Partial(PiecewiseMap):
    """A map on x < 4."""

    s: float = 0.25
    coordinates = ("x",)

    def pieces(self, x):
        return {"L": (x.x <= self.s, {"x": x.x / 2}), "R": ((x.x > self.s) & (x.x < 4), {"x": -x.x / 3})}


class Hidden(Gapped):
    def pieces(self, x):
        return {"L": (x.x <= self.s, {"x": x.x / 2}), "R": (True, {"x": -x.x / 3}), "S": (x.x > 3, {"x": x.x})}


class Complex(Gapped):
    def pieces(self, x):
        return {"L": (x.x <= self.s, {"x": sp.sqrt(x.x)}), "R": (True, {"x": -x.x / 3})}


class Rooted(Gapped):
    def pieces(self, x):
        return {"L": (x.x < self.s, {"x": x.x / 2}), "R": (True, {"x": 1 - sp.sqrt(x.x - self.s)})}


class Unturned(Sound):
    coordinates = ("x", "phi")


class Backwards(PiecewiseMap):
    """On either side x -> 2 x + 1, -x/2: images of both have preimages, in the wrong piece on the left."""

    a: float = 2.0
    coordinates = ("x",)

    def pieces(self, x):
        return {"L": (x.x <= 0, {"x": self.a * x.x}), "R": (True, {"x": x.x / 3})}

    def preimages(self, x):
        return {"L": {"x": x.x / self.a}, "R": {"x": 2 * x.x}}


def test_a_sound_map_passes():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", "no description of")
        check_system(Sound())
        check_system(Partial(), box={"x": (-1, 3)})


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(
    ("return_map", "how", "text"),
    [
        (Partial(), {"box": {"x": (-1, 8)}}, message("testing.in-no-piece", system="Partial", name="x")),
        (
            Partial(),
            {"states": [[0.0], [5.0]]},
            message("testing.in-no-piece", lost=1, number=2, system="Partial", name="x", value=5),
        ),
        (Hidden(), {}, message("testing.never-applies", letter="R", system="Hidden", after="S")),
        (Complex(), {}, message("testing.no-finite-image", system="Complex", name="x")),
        (Backwards(), {}, message("testing.preimages", system="Backwards")),
    ],
)
def test_a_mistake_in_pieces_is_named(return_map, how, text):
    with pytest.raises(CheckError, match=text):
        check_system(return_map, **how)


@pytest.mark.parametrize(
    ("return_map", "text"),
    [
        (Gapped(), r"states with equality in x < s are in no piece of Gapped, although both sides are"),
        (Partial(), r"\d+ of 200 states of Partial are in no piece, such as .*; their orbits end there as `uncovered`"),
        (Rooted(), r"the derivative of Rooted is not finite where equality holds in x < s, as of a square root"),
        (Unturned(), r"the same a whole turn further in 'phi', which is not an angle; expected: Angle\(\"phi\"\)"),
    ],
)
def test_what_may_be_a_mistake_is_a_warning(return_map, text):
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        check_system(return_map)
    assert any(re.search(text, str(each.message)) for each in given), [str(each.message) for each in given]
