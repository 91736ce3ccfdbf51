"""Impact systems by their definition with modes: the same returns as by their flights, and starts between the walls."""

from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
from messages import message
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_impact_oscillator import ImpactOscillator
from nsmaps_vi_pair import VIPair
from systems import Table

from nsmaps import ImpactSystem, Wall
from nsmaps.errors import NsmapsError, StateError, SystemDefinitionError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.trajectory import track


class Curved(VIPair):
    """Restitution that depends on the speed and the wall, and none on a wall that throws the ball back."""

    def rebound(self, speed, wall):
        return self.r * speed / (1 + speed / 10) if wall == "B" else self.r * speed**2 / (1 + speed) + sp.Rational(1, 10)


class Held(VIPair):
    """A second harmonic in the force, and damping of the velocity relative to the capsule."""

    def walls(self):
        return {"lower": Wall(at=-self.d / 2, side=-1), "upper": Wall(at=self.d / 2, side=1)}

    def displacement(self, t, hit):
        steady = lambda x: self.g_bar * x + sp.sin(2 * sp.pi * x) * self.d - sp.cos(sp.pi * x) / 9  # noqa: E731
        x = sp.Dummy()
        z, w = hit.z - steady(hit.t), hit.w - steady(x).diff(x).subs(x, hit.t)
        return steady(t) + z + w * (1 - sp.exp(-(t - hit.t) / 2)) * 2


SYSTEMS = {
    "pair": VIPair(d=0.35, g_bar=0.2113),
    "from the top": VIPair(d=0.3, g_bar=-0.3, base="T"),
    "resting": VIPair(d=0.3, g_bar=1.2),
    "curved": Curved(d=0.3, g_bar=0.2),
    "damped": Held(d=0.3, g_bar=-0.4, r=0.7),
    "ball": BouncingBall(Gamma=1.3, r=0.5),
    "elastic": BouncingBall(Gamma=0.4, r=1.0),
    "oscillator": ImpactOscillator(zeta=0.05, w=0.81, A=0.7, wall=0.6),
    "near resonance": ImpactOscillator(zeta=1e-3, w=0.999, A=0.01, wall=0.7),
    "inelastic": ImpactOscillator(zeta=0.1, w=1.3, A=0.7, wall=-0.5, r=0),
    "critical": ImpactOscillator(zeta=1, w=1.7, A=3, wall=0.1, damping="critical"),
    "overdamped": ImpactOscillator(zeta=1.6, w=2.5, A=4, wall=-0.05, r=0.7, damping="over"),
    "parabolas": Table(height=0.6),
}


def starts(n):
    """Random states, a quarter of them slow and a few at rest."""
    rng = np.random.default_rng(4)
    states = np.column_stack([rng.uniform(0, 1.5, n), rng.uniform(-7, 20, n)])
    states[: n // 4, 0] = 10 ** rng.uniform(-14, -1, n // 4)
    states[: n // 50, 0] = 0
    return states


@pytest.mark.parametrize("name", SYSTEMS)
def test_returns_are_those_of_the_flights(name):
    system, states = SYSTEMS[name], starts(300)
    found, expected = (
        system._kernel().modes.first_returns(states, True, SUMMED_SPEED),
        system.first_return(states, derivative=True),
    )
    decided = (found.outcome != Outcome.undecided) & (expected.outcome != Outcome.undecided)
    assert decided.sum() >= 280  # of slow impacts with equal rates the flight by exponentials leaves some undecided
    assert found.outcome[decided].tolist() == expected.outcome[decided].tolist()
    ok = expected.valid & decided
    assert ok.sum() > 150
    assert found.words[ok].tolist() == expected.words[ok].tolist()
    size = np.maximum(1, np.abs(expected.derivative).max(axis=(1, 2)))[:, None]
    assert (np.abs(found.lifted - expected.lifted) <= 1e-13 * size)[ok].all()
    assert (np.abs(found.time - expected.time)[:, None] <= 1e-13 * size * (1 + expected.time)[:, None])[ok].all()
    off = np.abs(found.derivative - expected.derivative).max(axis=2)
    assert (off <= 1e-12 * size**2)[ok].all()


@pytest.mark.parametrize("name", ["pair", "curved", "damped", "oscillator"])
def test_derivatives_by_parameters_are_those_of_the_flights(name):
    system, states = SYSTEMS[name], starts(100)[25:]
    size = np.maximum(1, np.abs(system.first_return(states, derivative=True).derivative).max(axis=(1, 2)))[:, None]
    for parameter in system.parameter_names():
        found = system._kernel().modes.sensitivities(states, system.direction({parameter: 0.7}), SUMMED_SPEED)
        expected = system.sensitivity(states, {parameter: 0.7})
        assert np.isfinite(expected).all(axis=1).sum() > 60
        assert not (np.abs(found - expected) > 1e-11 * size**2).any()


@pytest.mark.parametrize("name", ["pair", "damped", "oscillator", "parabolas"])
def test_motions_from_between_the_walls_meet_the_first_one(name):
    """The class's own formula is the flight from any place and velocity."""
    system, rng = SYSTEMS[name], np.random.default_rng(3)
    walls, side = system.walls(), next(iter(system.walls().values())).side
    low, high = (min(float(wall.at) for wall in walls.values()) - (len(walls) < 2), max(float(w.at) for w in walls.values()))
    rows = np.column_stack([rng.uniform(low, high, 40), rng.uniform(-1, 1, 40), rng.uniform(-4, 10, 40)])
    found = system.arrivals(rows, derivative=True)
    assert found.names.names == ("place", "v", "phi")
    assert set(found.mode) == {"flight"}
    t, start, place, velocity = sp.symbols("t start place velocity", real=True)
    formula = system.displacement(t, SimpleNamespace(t=start, z=place, w=velocity))
    at = sp.lambdify((t, start, place, velocity), [formula, sp.diff(formula, t)])
    base, alone = next(iter(walls)), 0
    for k, (z, v, phi) in enumerate(rows):
        if found.words[k] == base:
            begin = phi / system.phase_rate()
            times = begin + found.time[k] * np.linspace(1e-6, 1 - 1e-6, 300)
            path, end = at(times, begin, z, side * v)[0], at(begin + found.time[k], begin, z, side * v)
            assert all((wall.side * (float(wall.at) - path) > 0).all() for wall in walls.values())
            assert end[0] == pytest.approx(float(walls[base].at), abs=1e-13)
            assert side * end[1] == pytest.approx(found.image[k, 0], abs=1e-12)
            alone += 1
    assert alone > 10
    h = 1e-6
    for j in range(3):
        ahead, behind = (system.arrivals(rows + sign * h * np.eye(3)[j]) for sign in (1, -1))
        same = found.valid & (ahead.codes == found.codes) & (behind.codes == found.codes) & (found.image[:, 0] > 0.1)
        differences = (ahead.image + 2 * np.pi * ahead.turns - behind.image - 2 * np.pi * behind.turns) / (2 * h)
        assert same.sum() > 20
        assert found.derivative[same, :, j] == pytest.approx(differences[same], rel=1e-6, abs=1e-6)


def test_a_start_on_the_base_wall_goes_on_as_the_return():
    system, states = SYSTEMS["pair"], starts(40)[10:]
    after = np.column_stack([np.full(30, 0.35 / 2), -0.5 * states[:, 0], states[:, 1]])
    found, expected = system.arrivals(after), system.first_return(states)
    assert [word[1:] for word in expected.words] == found.words.tolist()
    assert found.image == pytest.approx(expected.image, abs=1e-12)


def test_motions_that_end_are_told_by_wall_mode_and_time():
    free = ImpactOscillator(zeta=0.05, w=0.81, A=0.01, wall=0.6)
    assert "no guard of the mode 'flight' is met: within the horizon of" in free.reasons([[0.0, 0.0]])[0]
    assert SYSTEMS["pair"].reasons([[0.5, 0.3]]) == (Outcome.returned.advice,)
    assert "stays in contact, in the mode 'rest on B'" in SYSTEMS["resting"].reasons([[0.0, 1.0]])[0]
    assert "expected: a finite number" in SYSTEMS["pair"].reasons([[np.nan, 0.0]])[0]
    outside = SYSTEMS["pair"].arrival_reasons([[0.5, 0.0, 1.0]])[0]
    assert "in the mode 'flight' the guard 'B' is -0.325" in outside
    with pytest.raises(StateError, match=message("exact.not-a-mode", name="fly")):
        SYSTEMS["pair"].arrivals([[0.0, 0.0, 1.0]], "fly")


class Open(VIPair):
    """A pair that loses the ball at the top."""

    def walls(self):
        bottom, top = super().walls().items()
        return {bottom[0]: bottom[1], top[0]: Wall(at=top[1].at, side=top[1].side, ends=True)}


def test_motions_end_at_a_wall_that_ends_them():
    system, whole, states = Open(d=0.35, g_bar=0.2113), SYSTEMS["pair"], starts(80)
    found, expected = system.first_return(states, derivative=True), whole.first_return(states, derivative=True)
    lost = np.char.find(expected.words, "T") >= 0
    assert 0 < lost.sum() < 80
    assert (found.outcome == np.where(lost, Outcome.escaped, expected.outcome)).all()
    assert found.image[~lost] == pytest.approx(expected.image[~lost], abs=1e-12)
    assert np.isnan(found.image[lost]).all()
    assert found.certified[~lost].all()
    k = int(np.argmax(lost))
    impacts, all_impacts = system.impacts(states[k], 9), whole.impacts(states[k], 9)
    top = int(np.argmax(all_impacts.wall))
    assert len(impacts.time) == top + 1
    assert impacts.speed == pytest.approx(all_impacts.speed[: top + 1], abs=1e-12)
    assert f"The guard 'T' ends the motion, {impacts.time[-1]:.10g} after the start." == system.reasons(states[k : k + 1])[0]
    assert track(system, states[k], 9, n_samples=5).velocity == pytest.approx(
        track(whole, states[k], top + 1, n_samples=5).velocity, abs=1e-12
    )
    with pytest.raises(NsmapsError, match=message("exact.motions-end", what="grazing curves", system="Open", wall="T")):
        system.grazing_curves({"v": (0.1, 1), "phi": (0, 1)})


def test_a_base_wall_does_not_end_motions():
    walls = {"walls": lambda self: {"B": Wall(at=0, side=-1, ends=True)}, "__module__": __name__}
    with pytest.raises(SystemDefinitionError, match=message("exact.ending-base", cls="Gone", wall="B")):
        type("Gone", (BouncingBall,), walls)


class Trapped(ImpactSystem):
    """A ball that a floor throws up at a speed with which it never comes back to the wall above, where it started."""

    def walls(self):
        return {"B": Wall(at=1, side=1), "F": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def rebound(self, speed, wall):
        return speed / 2 if wall == "B" else sp.sqrt(1 + speed**2) / 2 + sp.Rational(3, 10)  # to 0.898, below sqrt(2)

    def displacement(self, t, hit):
        return hit.z + hit.w * (t - hit.t) - (t - hit.t) ** 2 / 2


def test_more_impacts_than_are_followed_are_endless_by_both_engines():
    system, start = Trapped(), np.array([[1.0, 0.0]])
    assert system.first_return(start).outcome.tolist() == [Outcome.endless]
    assert system._kernel().modes.first_returns(start, False, SUMMED_SPEED).outcome.tolist() == [Outcome.endless]
    assert "Of its first 5,000 events the last are 'F'" in system.reasons(start)[0]
