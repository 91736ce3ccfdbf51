"""Systems that are given by their acceleration: against closed forms of the same systems, and what they refuse."""

import subprocess
import sys
from math import pi

import numpy as np
import pytest
import sympy as sp
from by_equation import TINY, Oscillator, Pair
from messages import message
from nsmaps_duffing import DuffingStop
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_vi_pair import VIPair
from scipy.optimize import brentq

import nsmaps
from nsmaps.coordinates import TWO_PI
from nsmaps.errors import CheckError, NsmapsError, ProofError, SystemDefinitionError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.trajectory import track
from nsmaps.testing import check_system

pytest.importorskip("heyoka")


class CurvedPair(VIPair):
    """Restitution that depends on the speed and the wall."""

    def rebound(self, speed, wall):
        return self.r * speed / (1 + speed / 10) if wall == "B" else self.r * speed**2 / (1 + speed)


class IntegratedCurvedPair(CurvedPair):
    """The same by its equation of motion."""

    def acceleration(self, t, place, velocity):
        return self.g_bar + sp.cos(sp.pi * t) + TINY * place**3


BOTH = {
    "pair": (Pair(d=0.35, g_bar=0.2113), VIPair(d=0.35, g_bar=0.2113)),
    "short": (Pair(d=0.26, g_bar=0.1), VIPair(d=0.26, g_bar=0.1)),
    "upside down": (Pair(d=0.3, g_bar=-0.3), VIPair(d=0.3, g_bar=-0.3)),
    "resting": (Pair(d=0.3, g_bar=1.2), VIPair(d=0.3, g_bar=1.2)),
    "curved": (IntegratedCurvedPair(d=0.3, g_bar=0.2), CurvedPair(d=0.3, g_bar=0.2)),
    **{
        name: (Oscillator(**values), ImpactOscillator(**values))
        for name, values in {
            "oscillator": {"zeta": 0.05, "w": 0.81, "A": 0.7, "wall": 0.6},
            "undamped": {"zeta": 0, "w": 2.2, "A": 1, "wall": 0, "r": 0.6},
            "pressed": {"zeta": 0.1, "w": 1.3, "A": 2, "wall": -0.5, "r": 0.8},
            "inelastic": {"zeta": 0.1, "w": 1.3, "A": 0.7, "wall": -0.5, "r": 0},
            "overdamped": {"zeta": 1.6, "w": 2.5, "A": 4, "wall": -0.05, "r": 0.7, "damping": "over"},
        }.items()
    },
}


def starts(n):
    """Random states, a quarter of them slow and a few at rest."""
    rng = np.random.default_rng(4)
    states = np.column_stack([rng.uniform(0, 1.5, n), rng.uniform(-7, 20, n)])
    states[: n // 4, 0] = 10 ** rng.uniform(-14, -1, n // 4)
    states[: n // 100, 0] = 0
    return states


def near(got, expected, slopes):
    """Whether images agree up to rounding, which a return multiplies by its slope."""
    return np.abs(got - expected) <= 1e-13 * np.maximum(1, np.abs(slopes).max(axis=(1, 2)))[:, None]


@pytest.mark.parametrize("name", BOTH)
def test_returns_are_those_of_the_closed_form(name):
    integrated, exact = BOTH[name]
    states = starts(1000)
    got, expected = (system.first_return(states, derivative=True) for system in (integrated, exact))
    ok = expected.valid
    assert got.words[ok].tolist() == expected.words[ok].tolist()
    assert got.outcome.tolist() == expected.outcome.tolist()
    assert (got.valid == ok).all()
    assert near(got.lifted, expected.lifted, expected.derivative)[ok].all()
    assert near(got.time[:, None], expected.time[:, None], expected.derivative)[ok].all()
    size = np.maximum(1, np.abs(expected.derivative).max(axis=(1, 2)))
    steep = np.abs(got.derivative - expected.derivative).max(axis=(1, 2)) / size**2  # a slope falls with the speed, here squared
    assert (steep[ok] < 3e-12).all()
    assert not got.certified.any()
    assert expected.certified.any() or name == "resting"


@pytest.mark.parametrize("name", BOTH)
def test_margins_and_itineraries_are_those_of_the_closed_form(name):
    integrated, exact = BOTH[name]
    states = starts(400)[100:]
    got, expected = (system.itineraries(states) for system in (integrated, exact))
    alone, towards_walls = len(exact.walls()) == 1, np.char.replace(expected.words, "^", "v")
    if alone:  # below which the displacement has its maxima
        towards_walls = np.char.replace(np.char.replace(expected.words, "v", ""), "^", "v")
    plain = np.char.isalpha(np.char.replace(expected.words, "^", ""))  # whole words without chatter and rest
    assert plain.sum() > 100 or name in ("resting", "inelastic")
    if alone:
        assert got.words[plain].tolist() == towards_walls[plain].tolist()
    assert got.turns[plain].tolist() == np.char.count(towards_walls[plain], "v").tolist()
    assert got.clearance[plain] == pytest.approx(expected.clearance[plain], abs=1e-12)
    assert got.slowest[plain] == pytest.approx(expected.slowest[plain], abs=1e-12)


@pytest.mark.parametrize("name", BOTH)
def test_sensitivities_are_those_of_the_closed_form(name):
    integrated, exact = BOTH[name]
    states = starts(200)[50:]
    for parameter in exact.parameter_names():
        got, expected = (system.sensitivity(states, {parameter: 0.7}) for system in (integrated, exact))
        known = np.isfinite(expected)  # releases, which have derivatives too, are left out there
        assert known.sum() > 100 or name == "inelastic"
        assert got[known] == pytest.approx(expected[known], rel=3e-9, abs=1e-11)


@pytest.mark.parametrize("state", [(0.2, 0.1), (0.43, 0.26), (1.62, 4.993), (0, 1.0)])
def test_impacts_and_tracks_are_those_of_the_closed_form(state):
    got, expected = (system.impacts(state, 40) for system in BOTH["pair"])
    first, second = ((found.speed > 1e-5) | (found.mark != "") for found in (got, expected))  # slower ones of chatter are summed
    first, second = np.flatnonzero(first)[:25], np.flatnonzero(second)[:25]
    assert [*got.wall[first], *got.mark[first]] == [*expected.wall[second], *expected.mark[second]]
    for field in ("time", "phase", "speed"):
        assert getattr(got, field)[first] == pytest.approx(getattr(expected, field)[second], abs=1e-12)
    one, other = (track(system, state, 6, n_samples=9) for system in BOTH["pair"])
    assert one.displacement == pytest.approx(other.displacement, abs=1e-13)
    assert one.velocity == pytest.approx(other.velocity, abs=1e-13)


def test_impacts_end_where_the_ball_rests_for_all_times():
    got, expected = (system.impacts([0.1, 0.3], 500) for system in BOTH["resting"])
    assert len(got.time) == len(expected.time) < 500
    assert got.mark.tolist() == expected.mark.tolist()


def test_hard_cases_have_the_right_words(reference):
    rows = reference("hard_returns")
    assert len(rows) == 60
    for row in rows:
        tilt = {"pi/3": pi / 3, "pi/6": pi / 6}[row["beta"]]
        got = Pair(d=row["d"], r=row["r"], M=0.1245, g=9.8, beta=tilt, F=5).first_return([[row["v"], row["phi"]]])
        assert got.words[0] == row["word"]
        # a unit in the last place of the start moves the image of one graze by 1.2e-8 of itself
        assert got.image[0, 0] == pytest.approx(float(row["v1"]), rel=1e-12 if row["kind"] == "tiny" else 5e-8)


def test_orbits_are_successive_first_returns():
    system = BOTH["pair"][0]
    states = starts(20)
    orbits = system.orbits(states, 5, derivative=True)
    single = system.first_return(states, derivative=True)
    for k in range(5):
        part = orbits.select(np.arange(20 * k, 20 * (k + 1)))
        assert np.array_equal(part.image, single.image, equal_nan=True)
        assert np.array_equal(part.derivative, single.derivative, equal_nan=True)
        single = system.first_return(single.image, derivative=True)


def test_an_orbit_that_ends_repeats_its_outcome():
    system = DuffingStop(c=0.1, a=1, b=-1, f=0.3, w=1.2, d=0.4, r=0.9)
    start = [[3.0, 1.0], [np.nan, 0.0], [-1.0, 0.0]]
    orbits = system.orbits(start, 3)
    names = [Outcome(outcome).name for outcome in orbits.outcome]
    assert names == ["escaped", "invalid", "invalid"] * 3
    assert not orbits.valid.any()


def test_a_softening_spring_lets_go():
    returns = DuffingStop(c=0.1, a=1, b=-1, f=0.3, w=1.2, d=0.4, r=0.9).first_return([[0.1, 1.0], [3.0, 1.0]])
    assert returns.counts() == {"returned": 1, "escaped": 1}


def test_flights_beyond_the_range_of_floats_leave_the_others_alone():
    system = DuffingStop(c=0.1, a=1, b=-1, f=0.3, w=1.2, d=0.4, r=0.9)
    states = starts(40)
    alone = system.first_return(states)
    mixed = system.first_return(np.insert(states, range(0, 40, 2), [1e150, 1.0], axis=0))
    assert mixed.counts()["escaped"] == alone.counts().get("escaped", 0) + 20
    again = system.first_return(states)
    assert np.array_equal(again.image, alone.image, equal_nan=True)
    ordinary = mixed.start[:, 0] < 1e150
    assert np.array_equal(mixed.image[ordinary], alone.image, equal_nan=True)


def test_no_impact_within_the_horizon_is_an_escape():
    class Short(DuffingStop):
        horizon = 30

    assert Short(c=0.3, a=1, b=1, f=0.1, w=1.2, d=2).first_return([[1.0, 1.0]]).counts() == {"escaped": 1}


def test_a_graze_within_rounding_is_undecided():
    system = BOTH["pair"][0]
    low, high = np.array([0.3, 0.3]), np.array([0.6, 1.0])
    for _ in range(60):
        middle = (low + high) / 2
        codes = system.first_return([low, middle, high]).codes
        low, high = (middle, high) if codes[0] == codes[1] else (low, middle)
    assert Outcome.undecided in system.first_return([low, high]).outcome


def test_chaos_before_an_impact_is_undecided():
    """Between two wells, far from the stop, errors of rounding grow by e every few time units until an excursion reaches it."""
    system = DuffingStop(c=0.15, a=-1, b=1, f=0.3, w=1, d=1.52)
    returns = system.first_return(np.column_stack([np.linspace(0.1, 1, 60), np.linspace(0, 6, 60)]))
    long = returns.time > 100
    assert long.sum() > 15
    assert (returns.outcome[long] == Outcome.undecided).all()
    assert (returns.outcome[returns.time < 28] == Outcome.returned).all()


class Pressed(VIPair):
    """A ball on its base under a force with two harmonics."""

    def acceleration(self, t, place, velocity):
        return self.g_bar + sp.cos(sp.pi * t) + 4 * sp.sin(3 * sp.pi * t) / 5 + TINY * place**3


def test_a_ball_is_pressed_between_the_zeros_of_the_force():
    force = lambda phi: 0.3 + np.cos(phi) + 0.8 * np.sin(3 * phi)  # noqa: E731
    phi, fine = np.linspace(0, TWO_PI, 200, endpoint=False), np.linspace(0, 2 * TWO_PI, 400_001)
    found = Pressed(d=50.0, g_bar=0.3).first_return(np.column_stack([0 * phi, phi]))
    held = force(phi) > 0
    assert 50 < held.sum() < 150
    assert (found.outcome[held] == Outcome.stuck).all()
    assert (found.words[held] == "B_").all()
    assert not np.char.startswith(found.words[~held], "B_").any()
    falls = fine[1:][np.diff(np.sign(force(fine))) < 0]
    expected = [
        float(brentq(force, falls[falls > start][0] - 1e-3, falls[falls > start][0] + 1e-3, xtol=1e-15)) for start in phi[held]
    ]
    assert found.lifted[held, 1] == pytest.approx(expected, abs=1e-12)
    assert Pressed(d=50.0, g_bar=2.0).first_return([[0.0, 1.0]]).outcome[0] == Outcome.rests


def test_what_needs_a_closed_form_is_refused():
    system = BOTH["pair"][0]
    with pytest.raises(ProofError, match=message("exact.accelerated", what="images of boxes", system="Pair")):
        system.image_boxes([[[0.5, 0.6], [0.2, 0.3]]])
    with pytest.raises(NsmapsError, match=message("exact.accelerated", what="grazing curves")):
        system.grazing_curves({"v": (0.1, 1), "phi": (0, 1)})
    with pytest.raises(NsmapsError, match=message("exports.accelerated")):
        nsmaps.export(system, "latex")


def test_a_class_with_both_is_followed_by_its_displacement():
    class Twice(VIPair):
        def displacement(self, t, hit):
            return VIPair.displacement(self, t, hit)

        def acceleration(self, t, place, velocity):
            raise AssertionError("not called")

    assert Twice(d=0.3, g_bar=0.2).first_return([[0.5, 0.3]]).certified.all()


@pytest.mark.parametrize(
    ("formula", "said"),
    [
        (
            lambda self, t, place, velocity: -1 - sp.sign(velocity),
            message("exact.own-jump"),
        ),
        (lambda self, t, place, velocity: sp.cos(t), message("exact.not-periodic")),
        (
            lambda self, t, place: -place,
            message("exact.not-called-so", formula="acceleration", arguments="(self, t, place, velocity)"),
        ),
        (lambda self, t, place, velocity: -sp.Symbol("q") * place, message("exact.unknown-symbols", symbols="q")),
        (lambda self, t, place, velocity: "x", message("exact.not-a-formula")),
    ],
)
def test_an_acceleration_that_cannot_be_followed_is_refused(formula, said):
    with pytest.raises(SystemDefinitionError, match=said):  # when the class is defined, or at its first return
        type("Wrong", (VIPair,), {"acceleration": formula, "__module__": __name__})(d=0.3, g_bar=0.2).first_return([[1.0, 1.0]])


def test_powers_and_constants_have_series_at_zero():
    class Odd(DuffingStop):
        def acceleration(self, t, place, velocity):
            drag = velocity**3 / 3 + sp.pi * place**3 / 7 + place / (1 + place**2) ** 2 + place * sp.sqrt(2 + place**2)
            return self.f * sp.cos(self.w * t) - drag

    returns = Odd(c=0.1, a=1, b=0, f=1.5, w=1.2, d=0).first_return([[0.5, 0.3], [1.0, 2.0]], derivative=True)
    assert np.isfinite(returns.derivative).all()


def test_without_heyoka_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)

    class Other(DuffingStop):
        def acceleration(self, t, place, velocity):
            return -sp.sin(place) / 3

    with pytest.raises(NsmapsError, match=message("exact.no-heyoka")):
        Other(c=0, a=1, b=1, f=1, w=1, d=1).first_return([[1.0, 1.0]])


def test_heyoka_is_loaded_by_the_first_return_alone():
    program = (
        "import sys; from nsmaps_duffing import DuffingStop; from nsmaps_vi_pair import VIPair; "
        "s = DuffingStop(c=0.1, a=1, b=1, f=1, w=1, d=1); print('heyoka' in sys.modules); "
        "VIPair(d=0.3, g_bar=0.2).first_return([[1, 1]]); print('heyoka' in sys.modules); "
        "s.first_return([[1, 1]]); print('heyoka' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "True"]


def test_systems_are_checked_by_an_integrator():
    system = DuffingStop(c=0.1, a=-1, b=1, f=0.4, w=1.2, d=0.9, r=0.7)
    check_system(system)
    with pytest.raises(CheckError, match=message("testing.equation")):
        check_system(system, acceleration=lambda t, place, velocity: -place)


def test_slips_in_an_acceleration_are_reported():
    class Early(DuffingStop):
        """A period that is not that of the forcing."""

        def period(self):
            return sp.pi / self.w

    class Undamped(DuffingStop):
        """The damping is forgotten."""

        def acceleration(self, t, place, velocity):
            return self.f * sp.cos(self.w * t) - self.a * place - self.b * place**3

    values = {"c": 0.1, "a": -1, "b": 1, "f": 0.4, "w": 1.2, "d": 0.9, "r": 0.7}
    with pytest.raises(CheckError, match=message("testing.wrong-period", system="Early", factor=2)):
        check_system(Early(**values))
    with pytest.raises(CheckError, match=message("testing.ignored", name="c", motion="acceleration")):
        check_system(Undamped(**values))
