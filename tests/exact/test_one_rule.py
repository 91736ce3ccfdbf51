"""What all loops of the engine have in common: chatter, the horizon, and directions of parameters."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from by_equation import Pair
from hybrid import Friction
from messages import message
from nsmaps_vi_pair import VIPair
from pydantic import Field

import nsmaps
from nsmaps import Guard, HybridSystem, ImpactSystem, PoincareSection, Wall
from nsmaps.errors import ParameterError, SystemDefinitionError
from nsmaps.exact.outcome import Outcome


def starts(n):
    rng = np.random.default_rng(7)
    return np.column_stack(
        [np.append(10 ** rng.uniform(-8, -2, n // 4), rng.uniform(0, 1.2, n - n // 4)), rng.uniform(0, 6.28, n)]
    )


@pytest.mark.parametrize(
    ("kind", "r"), [(VIPair, 0.0), (VIPair, 0.6), (VIPair, 0.9999), pytest.param(Pair, 0.7, marks=pytest.mark.thorough)]
)
def test_returns_totals_itineraries_impacts_and_sensitivities_agree(kind, r):
    """Also where the ball chatters on the other wall, against which it is pressed."""
    pytest.importorskip("heyoka")
    system, states = kind(d=0.3, g_bar=-0.9, r=r), starts(12 if kind is VIPair else 5)
    found = system.first_return(states)
    assert any("T~" in word or "T_" in word for word in found.words) or r > 0.99
    seen = nsmaps.observe(system, states, ["loss"], n_returns=1, n_batches=1)
    assert seen.outcome.tolist() == found.outcome.tolist()
    assert seen.final == pytest.approx(found.image, abs=1e-12, nan_ok=True)
    known = found.outcome != Outcome.undecided
    assert system.itineraries(states).outcome[known].tolist() == found.outcome[known].tolist()
    free = found.valid & (np.char.find(found.words, "~") < 0) & (np.char.find(found.words, "_") < 0)
    assert np.isfinite(system.sensitivity(states, {"d": 1.0})).all(axis=1)[free].all()
    for k in np.flatnonzero(found.valid & known)[:3].tolist():
        impacts = system.impacts(states[k], 300)
        first = int(np.argmax((impacts.wall == 0) & (np.arange(len(impacts.wall)) > 0)))
        if first:
            assert [impacts.speed[first], impacts.phase[first]] == pytest.approx(found.image[k], abs=1e-12)
            assert impacts.time[first] == pytest.approx(found.time[k], abs=1e-12)


class Thrown(ImpactSystem):
    """A ball thrown up with the speed v comes back after 2 v; the horizon is pi."""

    horizon = 0.5
    r: float = Field(1.0, description="restitution")

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + hit.w * s - s**2 / 2


class ThrownByEquation(Thrown):
    horizon = 0.5

    def acceleration(self, t, place, velocity):
        return sp.Integer(-1)


class ThrownInModes(HybridSystem):
    horizon = 0.5
    states = ("x", "v")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        return {"fly": {"x": y.v, "v": -1 + 0 * sp.cos(t)}}

    def guards(self, t, y):
        return {"B": Guard("fly", y.x, reset={"v": -y.v})}

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


@pytest.mark.parametrize("number", [1, 40])
@pytest.mark.parametrize(("kind", "sign"), [(Thrown, 1), (ThrownByEquation, 1), (ThrownInModes, -1)])
def test_a_horizon_of_half_a_period_is_half_a_period(kind, sign, number):
    if kind is ThrownByEquation:
        pytest.importorskip("heyoka")
    speeds = np.repeat([1.0, 1.55, 1.6, 4.0], number)
    found = kind().first_return(np.column_stack([sign * speeds, 0 * speeds]))
    assert (found.outcome == np.where(speeds < np.pi / 2, Outcome.returned, Outcome.escaped)).all()


def test_a_horizon_is_a_positive_number():
    class Never(Thrown):
        horizon = 0.0

        def displacement(self, t, hit):
            return hit.z + hit.w * (t - hit.t) - (t - hit.t) ** 2 / 2

    with pytest.raises(SystemDefinitionError, match=message("exact.horizon", value=0.0)):
        Never().first_return([[1.0, 0.0]])


@pytest.mark.parametrize(
    "return_map",
    [
        VIPair(d=0.35, g_bar=0.2),
        Pair(d=0.35, g_bar=0.2),
        Friction(mu=0.5),
        nsmaps.dynamics.CompleteChatter(VIPair(d=0.35, g_bar=0.2)),
    ],
    ids=["closed form", "integrated", "modes", "complete chatter"],
)
def test_a_direction_has_parameters_alone(return_map):
    states = np.full((1, len(return_map.coordinates.names)), 0.3)
    with pytest.raises(ParameterError, match=message("errors.unknown", kind="parameter", name="nothing")):
        return_map.sensitivity(states, {"nothing": 1.0})
    with pytest.raises(ParameterError, match=message("exact.rate", value="nan")):
        return_map.sensitivity(states, {getattr(return_map, "system", return_map).parameter_names()[0]: np.nan})


class Shaken(ImpactSystem):
    """A ball between two walls, pressed against the upper one for half of each period."""

    d: float = Field(description="distance of the walls")
    r: float = Field(description="restitution")

    def walls(self):
        return {"B": Wall(at=0, side=-1), "T": Wall(at=self.d, side=1)}

    def period(self):
        return 2 * sp.pi

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + (hit.w + sp.cos(hit.t)) * s - sp.sin(t) + sp.sin(hit.t)


def shaken_sums(d, r, v, phase):
    """The sums over the impacts of one return of `Shaken` in 30 digits, which chatters on T until it rests: (speeds, losses, the
    phase of the return, its speed).
    """

    def impact(w, s, way):  # after a flight from `phase` over a distance, near s
        s = mp.findroot(lambda s: (w + mp.cos(phase)) * s - mp.sin(phase + s) + mp.sin(phase) - way, s)
        return w + mp.cos(phase) - mp.cos(phase + s), phase + s

    with mp.workdps(30):
        d, r, v, phase = map(mp.mpf, (d, r, v, phase))
        speeds, w, press = [v], r * v, mp.sin(phase)
        v, phase = impact(w, (mp.sqrt(w * w + 2 * press * d) - w) / press, d)
        while v > mp.mpf(10) ** -25:
            speeds.append(v)
            v, phase = impact(-r * v, 2 * r * v / mp.sin(phase), 0)
        assert len(speeds) > 20
        assert phase < mp.pi
        phase = mp.pi
        v, phase = impact(mp.mpf(0), mp.cbrt(6 * d), -d)
        return [float(x) for x in (sum(speeds), sum((1 - r * r) * x * x / 2 for x in speeds), phase, -v)]


@pytest.mark.parametrize(("d", "r"), [(1e-2, 0.3), (1e-4, 0.9), (1e-4, 0.97)])
def test_chatter_on_the_other_wall_is_that_of_a_bouncing_ball(d, r):
    """In `first_return` and in `observe`: hundreds of impacts one by one, and then their sum."""
    system, start = Shaken(d=d, r=r), [np.sqrt(d * (1 - r * r)) / 2, 1.2]
    speeds, losses, phase, speed = shaken_sums(d, r, *start)
    found = system.first_return([start])
    seen = nsmaps.observe(system, start, [{"name": "v", "formula": "v"}, "loss"], n_returns=1, n_batches=1)
    assert found.words.tolist() == ["BT~B"] or found.words[0].startswith("BTT")
    assert found.outcome.tolist() == [Outcome.returned]
    assert np.array_equal(seen.final, found.image[0])
    assert np.array_equal(seen.time, found.time)
    assert found.image[0] == pytest.approx([speed, phase], rel=1e-12)
    assert seen.totals[0] == pytest.approx([speeds, losses], rel=1e-9)


@pytest.mark.parametrize("r", [0.5, 0.99, 0.9995])
def test_returns_of_a_bouncing_ball_are_those_whose_observables_are_summed(r):
    """On a wall at rest speeds are v r^n, times 2 v r^(n + 1): until the impacts are summed, at 1e-12 of a radian's speed."""
    system, n = Thrown(r=r), int(np.log(1e-11) / np.log(r))
    found = system.orbits([[1.0, 0.3]], n)
    seen = nsmaps.observe(system, [1.0, 0.3], [{"name": "v", "formula": "v"}, "loss"], n_returns=n, n_batches=1)
    assert found.outcome.tolist() == [Outcome.returned] * n
    assert np.array_equal(seen.final, found.image[-1])
    assert found.image[:, 0] == pytest.approx(r ** np.arange(1, n + 1), rel=1e-10)
    assert seen.time[0] == pytest.approx(2 * r * (1 - r**n) / (1 - r), rel=1e-11)
    assert seen.totals[0] == pytest.approx([(1 - r**n) / (1 - r), (1 - r ** (2 * n)) / 2], rel=1e-11)
    assert system.first_return([[0.9e-12, 0.3]]).time[0] == pytest.approx(1.8e-12 * r / (1 - r), rel=1e-9)


class Growing(ImpactSystem):
    """Restitution that falls with the speed, and a force that presses for a part of each period."""

    q: float = Field(2e5, description="how fast it falls")

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        return 2 * sp.pi

    def rebound(self, speed, wall):
        return speed / (2 + self.q * speed)

    def displacement(self, t, hit):
        s = t - hit.t
        return hit.z + hit.w * s - s**2 / 2 + 3 * (sp.sin(hit.t) + sp.cos(hit.t) * s - sp.sin(t)) / 2


def test_chatter_is_not_summed_while_the_restitution_changes():
    """The sum of one ratio would shift the accumulation, and with it the phase at which the ball rests."""
    system, start = Growing(), [1e-5, 4.5]
    impacts = system.impacts(start, 60, chatter=np.inf)
    singly = system.impacts(start, 60, chatter=1e-12)
    ratios = impacts.speed[1:] / np.where(impacts.speed[:-1] > 0, impacts.speed[:-1], np.nan)
    last = int(np.argmax(impacts.mark != "")) - 1
    assert last >= 3
    assert abs(ratios[last - 1] - ratios[last - 2]) < 1e-3
    assert np.array_equal(impacts.speed[:last], singly.speed[:last])
