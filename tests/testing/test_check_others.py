"""check_region, check_polyfit and check_family pass what is there, and say what is wrong with others."""

import re
from typing import ClassVar

import numpy as np
import pytest
import sympy as sp
from messages import message

import nsmaps
from nsmaps.coordinates import Angle
from nsmaps.errors import CheckError
from nsmaps.exact.surfaces.family import ReturnFamily, WordFamily
from nsmaps.reduced.conditions.region import Box, ConditionRegion, Region
from nsmaps.reduced.fit.basis import BasisFit, Fourier
from nsmaps.reduced.fit.polyfit import PolyFit, PolynomialFit, SeparableFit
from nsmaps.testing import check_family, check_polyfit, check_region

NAMES = ("v", Angle("phi"))
PLACE = r".*test_check_others\.py:\d+"


@pytest.mark.parametrize(
    "region",
    [
        Box(coordinates=NAMES, bounds={"v": (0.63, 0.94), "phi": (0.15, 0.45)}),
        Box(coordinates=NAMES, bounds={"v": (0.6, 0.9), "phi": (-0.4, 0.4)}),
        Box(coordinates=NAMES, bounds={"v": (0.6, 0.9), "phi": (-1, 6)}),
        ConditionRegion(text="v > 0.63 - 0.53*phi and 1.1 < phi < 2.5 and v < 0.55", coordinates=NAMES),
        ConditionRegion(text="not (v < 1 or phi != 2) or v**2 < phi", coordinates=NAMES),
    ],
)
def test_regions_that_are_there_pass(region):
    check_region(region)


class Disc(Region):
    """States near (0.5, 1)."""

    within: float = 0.3

    def contains(self, states):
        v, phi = np.asarray(states, float).T
        return (v - 0.5) ** 2 + (phi - 1) ** 2 < self.within**2

    def condition(self):
        v, phi = sp.symbols("v phi", real=True)
        return (v - 0.5) ** 2 + (phi - 1) ** 2 < self.within**2


class Larger(Disc):
    """In symbols another disc."""

    def condition(self):
        v, phi = sp.symbols("v phi", real=True)
        return (v - 0.5) ** 2 + (phi - 1) ** 2 < 2 * self.within**2


class Outside(Disc):
    """All but a disc, NaN with it."""

    def contains(self, states):
        return ~Disc.contains(self, states)


class Numbers(Disc):
    """Zeros and ones."""

    def contains(self, states):
        return Disc.contains(self, states).astype(float)


class Crowd(Disc):
    """Judged by the company."""

    def contains(self, states):
        return Disc.contains(self, states) & (len(states) != 1)


class Complex(Disc):
    """Symbols that are not real."""

    def condition(self):
        v, phi = sp.symbols("v phi")
        return sp.And(v > 0, phi > 0)


class Text(Disc):
    """No condition but its text."""

    def condition(self):
        return "v > 0"


@pytest.mark.parametrize(
    ("region", "why"),
    [
        (Larger, message("testing.two-sets", cls="Larger", number=10000, contained="False", held="True")),
        (Outside, message("testing.not-a-number-inside", cls="Outside", name="v", value="nan")),
        (Numbers, message("testing.contains", cls="Numbers", type="float64", shape="(10000,)", number=10000, what="states")),
        (Crowd, message("testing.one-by-one", cls="Crowd", among="True", number=10000, alone="False")),
        (Complex, message("testing.condition-symbols", cls="Complex", symbols="phi, v", names="v, phi")),
        (Text, message("testing.condition", cls="Text", given="'v > 0'")),
    ],
)
def test_a_region_that_is_none(region, why):
    with pytest.raises(CheckError, match=why):
        check_region(region(coordinates=NAMES))


def test_trial_states_of_a_region_may_be_given():
    check_region(Disc(coordinates=NAMES))
    small = Disc(coordinates=NAMES, within=1e-4)
    with pytest.raises(CheckError, match=message("testing.no-state-in-region", number=10000, cls="Disc")):
        check_region(small)
    check_region(small, [[0.5, 1.0], [0.6, 1.0]])
    with pytest.raises(CheckError, match=message("testing.not-a", kind="region", base="Region", given="'v > 0'")):
        check_region("v > 0")


class Joined(Disc):
    """Inequalities joined as numbers are."""

    def condition(self):
        v, phi = sp.symbols("v phi", real=True)
        return v > 0 and phi > 0


class Planar(Disc):
    """A method for one state."""

    def contains(self, states):
        v, phi = states
        return v > phi


class Special(Disc):
    """A function that conditions lack."""

    def contains(self, states):
        from scipy.special import gamma

        v, phi = np.asarray(states, float).T
        return np.isfinite(v) & np.isfinite(phi) & (gamma(np.abs(v) + 1) < 2)

    def condition(self):
        v = sp.Symbol("v", real=True)
        return sp.gamma(sp.Abs(v) + 1) < 2


class Across(Disc):
    """States near (0.5, 0), in the plane instead of on the cylinder."""

    def contains(self, states):
        v, phi = np.asarray(states, float).T
        return (v - 0.5) ** 2 + phi**2 < self.within**2

    def condition(self):
        v, phi = sp.symbols("v phi", real=True)
        return (v - 0.5) ** 2 + phi**2 < self.within**2


def test_errors_of_a_region_name_its_method_and_line():
    with pytest.raises(
        CheckError, match=message("testing.conditions-joined", cls="Joined", place=re.compile(PLACE), error="TypeError")
    ):
        check_region(Joined(coordinates=NAMES))
    with pytest.raises(CheckError, match=message("testing.raises", cls="Planar", place=re.compile(PLACE), error="ValueError")):
        check_region(Planar(coordinates=NAMES))
    with pytest.raises(CheckError, match=message("testing.outside-turn", cls="Disc")):
        check_region(Disc(coordinates=NAMES), [[0.5, -1.0]])


def test_a_region_whose_condition_has_no_text():
    states = np.random.default_rng(1).uniform(0, 2, (50, 2))
    with pytest.raises(CheckError, match=message("reduced.function", function="gamma", at="the region Special")):
        check_region(Special(coordinates=NAMES), states)


def test_a_region_across_zero_of_an_angle_gives_a_warning():
    with pytest.warns(UserWarning, match=message("testing.turned", cls="Across", state=re.compile(r"\[.*, -0.*\]"))):
        check_region(Across(coordinates=NAMES))
    check_region(Across(coordinates=("v", "phi")))


class Pair(nsmaps.System):
    """A linear map."""

    coordinates = ("x", "y")
    k: float = 0.5

    def first_return(self, states, derivative=False):
        return nsmaps.Returns.of_map(self.coordinates, states, self.k * states)


class Right(ReturnFamily):
    """Returns from the right."""

    def contains(self, returns):
        return returns.start[:, 0] > 0


class Median(Right):
    """Judged by the company."""

    def contains(self, returns):
        return returns.start[:, 0] > np.median(returns.start[:, 0])


class Counted(Right):
    """Zeros and ones."""

    def contains(self, returns):
        return (returns.start[:, 0] > 0).astype(int)


class Careless(Right):
    """A method that changes what it is given."""

    def contains(self, returns):
        returns.start[:] = np.abs(returns.start)
        return returns.start[:, 0] > 1


class Highest(Right):
    """A method that fails without returns."""

    def contains(self, returns):
        return returns.start[:, 0] > min(0, returns.start[:, 0].max())


class Never(Right):
    """No return."""

    def contains(self, returns):
        return np.zeros(len(returns), bool)


def test_families_pass():
    check_family(Right(name="right"), Pair())
    check_family(
        WordFamily(name="BB", words=("BB",)), nsmaps.load_system("bouncing_ball", Gamma=1.2, r=0.5), [[4.0, 0.5], [0.3, 1.0]]
    )
    with pytest.raises(CheckError, match=message("testing.not-a", kind="family", base="ReturnFamily", given="'right'")):
        check_family("right", Pair())


@pytest.mark.parametrize(
    ("family", "why"),
    [
        (
            Median,
            message("testing.returns-one-by-one", cls="Median", among="True", number=200, alone="False"),
        ),
        (Counted, message("testing.contains", cls="Counted", type="int64", shape="(200,)", number=200, what="returns")),
        (Careless, message("testing.changes-returns", cls="Careless")),
        (Highest, message("testing.fails-of-returns", cls="Highest", place=re.compile(PLACE), number=0, error="ValueError")),
        (Never, message("testing.no-return-in-family", number=200, cls="Never")),
    ],
)
def test_a_family_that_is_none(family, why):
    with pytest.raises(CheckError, match=why):
        check_family(family(name="own"), Pair())


@pytest.mark.parametrize(
    "fit",
    [
        PolynomialFit(degrees={"v": 3, "phi": 2}),
        PolynomialFit(degrees={"v": {"v": 5, "phi": 3}, "phi": {"v": 5, "phi": 4}}, absolute=("v",)),
        PolynomialFit(degrees={}),
        SeparableFit(degrees={"v": 5, "phi": 7}),
        SeparableFit(degrees={"v": 4, "phi": 3}, lines={"v": 0.7, "phi": 1.1}, absolute=("v",)),
    ],
)
def test_fits_that_are_there_pass(fit):
    check_polyfit(fit, NAMES)


def test_a_fit_in_other_coordinates():
    check_polyfit(PolynomialFit(degrees={"x": 2, "y": 1, "z": 1}), ("x", "y", "z"))


class Even(PolyFit):
    """Even powers of the first coordinate."""

    def exponents(self, coordinates, output):
        return np.array([[0, 0], [2, 0], [4, 0]])

    def data(self, surface, output):
        return np.ones(len(surface.start), bool)


class Twice(Even):
    """One monomial twice."""

    def exponents(self, coordinates, output):
        return np.array([[0, 0], [1, 0], [1, 0]])


class Negative(Even):
    """A negative power."""

    def exponents(self, coordinates, output):
        return np.array([[0, 0], [-1, 0]])


class Flat(Even):
    """Powers without their coordinate."""

    def exponents(self, coordinates, output):
        return np.arange(3)


class Nowhere(Even):
    """No data."""

    def data(self, surface, output):
        return np.zeros(len(surface.start), bool)


class Changing(Even):
    """Other monomials for the fit than for anyone else."""

    asked: ClassVar[list[int]] = []

    def exponents(self, coordinates, output):
        self.asked.append(1)
        return np.array([[0, 0], [2, 0], [4, 0]]) if len(self.asked) <= 2 else np.array([[0, 0], [1, 0]])


V, PHI = sp.symbols("v phi", real=True)


class Own(BasisFit):
    """Functions that a test states."""

    functions: ClassVar[tuple[object, ...]] = (1, sp.exp(-V), sp.sin(3 * PHI), V**2 * sp.sqrt(PHI))

    def basis(self, coordinates, output):
        return self.functions

    def data(self, surface, output):
        return np.ones(len(surface.start), bool)


class Wide(Own):
    """Exponents without the columns of its variables."""

    def exponents(self, coordinates, output):
        return np.eye(2, dtype=int)


@pytest.mark.parametrize(
    "fit", [Own(), Fourier(harmonics=5, degrees={"v": 2}), Fourier(harmonics={"phi": 2}, turns=2), Fourier(harmonics=0)]
)
def test_fits_in_other_functions_pass(fit):
    check_polyfit(fit, NAMES)
    check_polyfit(Fourier(harmonics=3), (Angle("phi"),))


@pytest.mark.parametrize(
    ("functions", "why"),
    [
        (
            (1, sp.sin(PHI) ** 2, sp.cos(PHI) ** 2),
            message("testing.dependent", number=3, terms=re.compile(r"sin\(phi\)\*\*2, cos.*")),
        ),
        ((1, V, 2 * V), message("testing.dependent", fit="Own", name="v", number=3)),
        ((1, sp.log(V - 1)), message("testing.variable", formula="log(v - 1)", where=re.compile("v = 0.5, .*"))),
        ((1, sp.Symbol("w") ** 2), message("reduced.not-a-coordinate", name="w", names="phi, v", at="Own: a variable of Own")),
        (("sin(phi)",), message("reduced.not-expressions", fit="Own", name="v", formula="sin(phi)", type="str")),
        ((), message("reduced.no-terms", fit="Own", name="v")),
    ],
)
def test_a_basis_that_is_none(functions, why, monkeypatch):
    monkeypatch.setattr(Own, "functions", functions)
    with pytest.raises(CheckError, match=why):
        check_polyfit(Own(), NAMES)


def test_a_box_and_the_shape_of_a_basis(monkeypatch):
    with pytest.raises(
        CheckError,
        match=message(
            "testing.exponents-in", fit="Wide", name="v", shape="(2, 2)", variables=re.compile(r".*exp\(-v\).*"), number=3
        ),
    ):
        check_polyfit(Wide(), NAMES)
    monkeypatch.setattr(Own, "functions", (1, sp.log(V - 1)))
    check_polyfit(Own(), NAMES, box={"v": (1.5, 2.5), "phi": (0.0, 1.0)})


@pytest.mark.parametrize(
    ("fit", "why"),
    [
        (Twice, message("testing.monomial-twice", name="v", powers="1, 0", times=2)),
        (Negative, message("testing.negative-exponents", type="int64", least=-1)),
        (Flat, message("testing.exponents", shape="(3,)", number=2)),
        (Nowhere, message("testing.data", fit="Nowhere", name="v", type="bool", number=0)),
        (Changing, message("testing.not-found-again")),
    ],
)
def test_a_fit_that_is_none(fit, why):
    check_polyfit(Even())
    with pytest.raises(CheckError, match=why):
        check_polyfit(fit())
    with pytest.raises(CheckError, match=message("testing.not-a", kind="fit", base="PolyFit")):
        check_polyfit(fit)
