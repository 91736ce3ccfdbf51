"""check_system passes what is right, and says of each common mistake what it is."""

import re
import warnings

import numpy as np
import pytest
import sympy as sp
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_vi_pair import VIPair
from pydantic import Field
from systems import Table

from nsmaps.errors import CheckError, SystemDefinitionError
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall
from nsmaps.testing import check_system

BALL = {"Gamma": 1.3, "r": 0.5}
PAIR = {"d": 0.35, "r": 0.5, "g_bar": 0.2113}


def pair_acceleration(t, z, w, g_bar=0.2113):
    return g_bar + sp.cos(sp.pi * t)


@pytest.mark.parametrize(
    ("system", "acceleration"),
    [
        (BouncingBall(**BALL), lambda t, x, u: -1 + 1.3 * sp.sin(t)),
        (BouncingBall(Gamma=5, r=0), lambda t, x, u: -1 + 5 * sp.sin(t)),
        (VIPair(**PAIR), pair_acceleration),
        (ImpactOscillator(zeta=0.05, w=0.81, A=0.7, wall=0.6), lambda t, x, u: 0.7 * sp.cos(0.81 * t) - 0.1 * u - x),
        (ImpactOscillator(zeta=1, w=1.7, A=3, wall=0.1, damping="critical"), lambda t, x, u: 3 * sp.cos(1.7 * t) - 2 * u - x),
        (ImpactOscillator(zeta=1.6, w=2.5, A=4, wall=-0.05, damping="over"), lambda t, x, u: 4 * sp.cos(2.5 * t) - 3.2 * u - x),
        (ImpactOscillator(zeta=0, w=2.2, A=1, wall=0, r=1), lambda t, x, u: sp.cos(2.2 * t) - x),
    ],
    ids=lambda value: repr(value)[:40] if isinstance(value, ImpactSystem) else "",
)
def test_what_is_right_passes_without_a_word(system, acceleration):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_system(system, acceleration)


def test_an_acceleration_of_numpy_is_told_what_to_take():
    with pytest.raises(CheckError, match=message("testing.numbers")):
        check_system(BouncingBall(**BALL), lambda t, x, u: -1 - 1.3 * np.sin(t))


class TableTheOtherWay(BouncingBall):
    """A table that moves as -Gamma sin t: wrong in every term alike, so that the formulas agree with one another."""

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + (hit.w - self.Gamma * sp.cos(hit.t)) * s - s**2 / 2 + self.Gamma * (sp.sin(t) - sp.sin(hit.t))


def test_without_the_acceleration_it_is_said_what_could_not_be_checked():
    """The one sign that formulas alone do not show: the plain call passes, and says what it did not look at."""
    with pytest.warns(UserWarning, match=message("testing.no-acceleration")) as told:
        check_system(TableTheOtherWay(**BALL))
    assert [warning.filename for warning in told] == [__file__]
    with pytest.raises(CheckError, match=message("testing.equation")):
        check_system(TableTheOtherWay(**BALL), lambda t, x, u: -1 + 1.3 * sp.sin(t))


class WrongSignOfGravity(BouncingBall):
    """A ball that falls upwards."""

    def displacement(self, t, hit):
        return BouncingBall.displacement(self, t, hit) + (t - hit.t) ** 2


class WrongSignOfTheTable(BouncingBall):
    """A table whose velocity is taken off instead of added."""

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + (hit.w - self.Gamma * sp.cos(hit.t)) * s - s**2 / 2 - self.Gamma * (sp.sin(t) - sp.sin(hit.t))


class WrongSignOfTheVelocity(BouncingBall):
    """A ball thrown down by the table."""

    def displacement(self, t, hit):
        s = t - hit.t
        lift = -hit.w + self.Gamma * sp.cos(hit.t)
        return hit.z + lift * s - s**2 / 2 - self.Gamma * (sp.sin(t) - sp.sin(hit.t))


class WrongSide(BouncingBall):
    """A table that stops what rises."""

    def walls(self):
        return {"B": Wall(at=0, side=1)}


class WrongSignOfTilt(VIPair):
    """A capsule tilted the other way: the ball comes back all the same."""

    def displacement(self, t, hit):
        return VIPair.displacement(self, t, hit) - self.g_bar * (t - hit.t) ** 2


class WrongSignOfDamping(ImpactOscillator):
    """An oscillator that is driven by its own velocity."""

    def _free(self, s, z, w):
        k = sp.sqrt(1 - self.zeta**2)
        return sp.exp(self.zeta * s) * (z * sp.cos(k * s) + (w - self.zeta * z) * sp.sin(k * s) / k)


class NoReversal(BouncingBall):
    """An impact law that turns the velocity round, which the wall does already."""

    def rebound(self, speed, wall):
        return -self.r * speed


class NoWall(BouncingBall):
    """A table that may be left out."""

    walled: bool = True

    def walls(self):
        return BouncingBall.walls(self) if self.walled else {}


class BottomForgotten(VIPair):
    """The capsule without its bottom."""

    def walls(self):
        return {"T": Wall(at=-self.d / 2, side=-1)}


class TopForgotten(VIPair):
    """The capsule without its top: the ball comes back by gravity."""

    def walls(self):
        return {"B": Wall(at=self.d / 2, side=1)}


class CeilingForgotten(Table):
    """A room without its ceiling."""

    def walls(self):
        return {"F": Wall(at=0, side=-1)}


class PeriodOfOne(BouncingBall):
    """A table whose period is not that of its motion."""

    def period(self):
        return sp.Integer(1)


class PeriodTwice(BouncingBall):
    """A table whose period is twice that of its motion."""

    def period(self):
        return 4 * sp.pi


class NotTheRate(BouncingBall):
    """The table's own velocity is forgotten."""

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + hit.w * s - s**2 / 2 - self.Gamma * (sp.sin(t) - sp.sin(hit.t))


class Ignored(BouncingBall):
    """A ball with a drag that no formula has."""

    drag: float = 0.1


class OtherPlace(BouncingBall):
    """A flight that always starts at zero."""

    def displacement(self, t, hit):
        return BouncingBall.displacement(self, t, hit) - hit.z


class Memory(BouncingBall):
    """A force that grows since the last impact."""

    def displacement(self, t, hit):
        return BouncingBall.displacement(self, t, hit) - (t - hit.t) ** 3


class Crossed(VIPair):
    """A capsule whose top is below its bottom."""

    def walls(self):
        return {"B": Wall(at=-self.d / 2, side=1), "T": Wall(at=self.d / 2, side=-1)}


class Unwound(BouncingBall):
    """A period that is none."""

    def period(self):
        return -2 * sp.pi


@pytest.mark.parametrize(
    ("system", "why"),
    [
        (WrongSignOfGravity(**BALL), message("testing.wrong-side", away="growing")),
        (WrongSide(**BALL), message("testing.wrong-side", away="falling", side="+1", stops="growing")),
        (WrongSignOfTheTable(**BALL), message("testing.start-of-flight", what="velocity")),
        (WrongSignOfTheVelocity(**BALL), message("testing.opposite-sign", what="velocity")),
        (NoReversal(**BALL), message("testing.not-reversed", system="NoReversal")),
        (NoWall(**BALL, walled=False), message("exact.no-walls")),
        (BottomForgotten(**PAIR), message("testing.wrong-side")),
        (TopForgotten(**PAIR), message("testing.no-effect-of-formula", name="d")),
        (CeilingForgotten(height=0.6), message("testing.ignored", name="height")),
        (PeriodOfOne(**BALL), message("testing.wrong-period", factor="2 pi", period=6.28319)),
        (PeriodTwice(**BALL), message("testing.shorter-period", after=6.28319, times=2, period=12.5664)),
        (NotTheRate(**BALL), message("testing.start-with-rate")),
        (Ignored(**BALL), message("testing.ignored", system="Ignored", name="drag")),
        (OtherPlace(**BALL), message("testing.start-of-flight", what="place")),
        (Memory(**BALL), message("testing.restarted")),
        (Crossed(**PAIR), message("testing.no-room", wall="B", place=-0.175)),
        (Unwound(**BALL), message("testing.period", system="Unwound", period="-2*pi")),
        (ImpactOscillator(zeta=2, w=0.1, A=0.001, wall=50, damping="over"), message("testing.none-comes-back", number=144)),
        (BouncingBall, message("testing.not-a-system")),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, ImpactSystem) else "",
)
def test_a_mistake_is_told_in_plain_words(system, why):
    with (
        pytest.warns() if isinstance(system, CeilingForgotten | Ignored | NoWall) else warnings.catch_warnings(),
        pytest.raises(SystemDefinitionError if isinstance(system, NoWall) else CheckError, match=why),
    ):
        check_system(system)


def test_growth_of_the_wrong_sign_is_refused():
    with pytest.raises(CheckError, match=message("testing.unbounded")):
        check_system(WrongSignOfDamping(zeta=0.2, w=0.81, A=0.7, wall=0.6))


@pytest.mark.thorough
def test_a_wrong_sign_that_lets_the_ball_come_back_takes_the_equation():
    with pytest.warns(UserWarning, match=message("testing.no-acceleration")):
        check_system(WrongSignOfTilt(**PAIR))
    with pytest.raises(CheckError, match=message("testing.equation")):
        check_system(WrongSignOfTilt(**PAIR), pair_acceleration)
    with pytest.raises(CheckError, match=message("testing.equation-wrong-sign")):
        check_system(VIPair(d=0.35, g_bar=0), lambda t, x, u: -sp.cos(sp.pi * t))


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore:Table")
def test_an_impact_that_gains_energy_and_what_nobody_described_are_warned_of():
    class Kicked(BouncingBall):
        def rebound(self, speed, wall):
            return self.r * speed + sp.Rational(1, 10)

    gains = message("testing.gains", system="Kicked", speed=0, wall="B", after=0.1)
    with (
        pytest.warns(UserWarning, match=message("testing.no-docstring", system="Kicked")),
        pytest.warns(UserWarning, match=gains),
    ):
        check_system(Kicked(**BALL))
    with pytest.warns(UserWarning, match=message("testing.no-description", names=re.compile("Table.height.*"))):
        check_system(Table(height=0.6))


@pytest.mark.filterwarnings("ignore:Table passes")
def test_states_may_be_given():
    """A ceiling that only fast balls reach."""
    with pytest.warns(UserWarning, match=message("testing.no-description")):
        check_system(Table(height=1e5), states=[[1000.0, 0.0], [2.0, 1.0]])
    with (
        pytest.warns(UserWarning, match=message("testing.no-description")),
        pytest.raises(CheckError, match=message("testing.no-effect-of-formula", name="height")),
    ):
        check_system(Table(height=1e5))


class Swing(ImpactSystem):
    """x'' = -(x - c) + b cos t above a wall at -1, whose natural period is that of the forcing: b makes it swing ever wider."""

    r: float = Field(0.7, description="restitution")
    b: float = Field(0.0, description="forcing")
    c: float = Field(0.2, description="place at rest")

    def walls(self):
        return {"B": Wall(at=-1, side=-1)}

    def period(self):
        return 2 * sp.pi

    def displacement(self, t, hit):
        s = t - hit.t
        return (
            self.c + (hit.z - self.c) * sp.cos(s) + (hit.w - self.b * sp.sin(hit.t) / 2) * sp.sin(s) + self.b * s * sp.sin(t) / 2
        )


@pytest.mark.parametrize("b", [0.1, 1.0])
def test_undamped_and_resonant_flights_return(b):
    """Where places a hundred and two hundred periods later differ by rounding, or grow with every period."""
    check_system(Swing(b=b), lambda t, x, v: -(x - 0.2) + b * sp.cos(t))


def test_a_force_of_the_wrong_sign_is_still_found():
    class Lifted(Swing):
        """x'' = g."""

        def displacement(self, t, hit):
            s = t - hit.t
            return hit.z + hit.w * s + self.c * s**2 / 2 + self.b * (sp.cos(hit.t) - sp.cos(t) - s * sp.sin(hit.t))

    with pytest.raises(CheckError, match=message("testing.never-return", gone=144, number=144, system="Lifted", wall="B")):
        check_system(Lifted(b=0.01))
