"""Systems with modes in reversed time: forward and back is the identity, and what has no past is refused."""

import numpy as np
import pytest
import sympy as sp
from hybrid import Friction
from messages import message
from nsmaps_belt import Belt
from nsmaps_bouncing_ball import BouncingBall
from nsmaps_duffing import DuffingStop
from nsmaps_recoil_pair import RecoilPair
from nsmaps_rocking_block import RockingBlock
from nsmaps_soft_impact import SoftImpact
from nsmaps_two_masses import TwoMasses
from systems import BallInModes

import nsmaps
from nsmaps import Guard, HybridSystem, PoincareSection
from nsmaps.errors import NsmapsError
from nsmaps.exact.systems.reversed import reversed_system


class Swing(HybridSystem):
    """A pendulum with a stop, which a gust pushes away from it in the other half of its range."""

    r: float = 0.8
    states = ("x", "v")

    def period(self):
        return 2 * sp.pi / sp.Rational(7, 10)

    def modes(self, t, y):
        force = -sp.sin(y.x) - y.v / 10 + sp.cos(sp.Rational(7, 10) * t) / 2
        return {"near": {"x": y.v, "v": force}, "far": {"x": y.v, "v": force - y.x**2 / 5}}

    def guards(self, t, y):
        return {
            "B": Guard("near", sp.Rational(1, 2) - y.x, reset={"v": -self.r * y.v}),
            "f": Guard("near", y.x, to="far"),
            "n": Guard("far", -y.x, to="near"),
        }

    def section(self, t, y):
        return PoincareSection("B", ("v", "phi"))


class Either(RecoilPair):
    """The pair seen before an impact on either wall."""

    def section(self, t, y):
        return PoincareSection(("B", "T"), ("x", "v", "X", "V", "phi"))


CASES = [
    (RecoilPair(eta=0.3, kappa=0.4, Lambda=0.1, d=0.35, g_bar=0.2, r=0.5), [0.05, -0.3, -0.3], [1, 0.3, 0.3]),
    (RecoilPair(eta=0.3, kappa=0.4, Lambda=0.1, d=0.35, g_bar=0.2, r=0.5, contact=True), [0.4, -0.1, -0.1], [1, 0.1, 0.1]),
    (TwoMasses(b=0.05, w=0.9, f=1.5, d=0.1, r=0.8, k2=2.0), [0.05, -0.5, -0.5], [1, 0.5, 0.5]),
    (SoftImpact(xi=0.01, e=1.26, a=0.7, beta=29.0, w=0.75), [0.2], [2]),
    (RockingBlock(a=0.3, w=4.0, r=0.9), [0.2], [0.4]),
    pytest.param(Swing(), [0.1], [1.5], marks=pytest.mark.thorough),
    (DuffingStop(c=0.1, a=-1.0, b=1.0, f=0.7, w=1.2, d=0.9, r=0.8), [0.1], [1.5]),
]


@pytest.mark.parametrize(("system", "low", "high"), CASES, ids=lambda case: type(case).__name__)
def test_reversed_after_forward_is_the_identity(system, low, high):
    smooth = isinstance(system, Swing | DuffingStop)
    if smooth:
        pytest.importorskip("heyoka")
    states = np.random.default_rng(0).uniform([*low, 0], [*high, 2 * np.pi], (20 if smooth else 100, len(low) + 1))
    there = system.first_return(states, derivative=not smooth)
    moving = there.outcome == 0
    there, inverse = there.select(moving), system.inverse()
    back = inverse.first_return(there.image, derivative=not smooth)
    assert moving.sum() >= 10
    assert (back.outcome == 0).all()
    assert np.abs(system.coordinates.difference(back.image, states[moving])).max() < 1e-12
    assert (back.turns == -there.turns).all()
    assert back.time == pytest.approx(there.time, abs=1e-12)
    if not smooth:
        product = back.derivative @ there.derivative
        assert product == pytest.approx(np.broadcast_to(np.eye(len(low) + 1), product.shape), abs=1e-9)


def test_states_and_words_are_those_of_the_system():
    system, state = CASES[0][0], np.array([[0.9, 0.1, 0.2, 1.0]])
    there = system.first_return(state)
    back = system.inverse().first_return(there.image)
    assert back.image == pytest.approx(state)
    assert back.words.tolist() == [there.words[0][::-1]]


def test_a_section_at_two_walls_leads_back_too():
    pair = Either(eta=0.3, kappa=0.4, Lambda=0.1, d=0.35, g_bar=0.2, r=0.5)
    states = pair.orbits([[0.175, 0.8, 0.1, 0.2, 1.0]], 30).start
    there = pair.first_return(states)
    back = pair.inverse().first_return(there.image)
    assert set(there.words.tolist()) >= {"BT", "TB"}
    assert np.abs(pair.coordinates.difference(back.image, states)).max() < 1e-12


class Ball(BallInModes):
    """With other events or another reset, or with a table that nothing rests on."""

    kind: str = ""

    def modes(self, t, y):
        flight = {"x": y.v, "v": -1 + self.Gamma * sp.sin(t)}
        return {"flight": flight, **({"other": flight} if self.kind else {})}

    def guards(self, t, y):
        if self.kind == "two":
            hit = {"v": -self.r * y.v}
            return {
                "B": Guard("flight", y.x, reset=hit, to="flight"),
                "C": Guard("other", y.x, reset=hit, to="flight"),
                "D": Guard("flight", 9 - y.x, to="other"),
            }
        speed = sp.exp(y.v) - 1 if self.kind == "bent" else -self.r * y.v
        again = {"E": Guard("other", y.x, ends=True)} if self.kind else {}
        return {"B": Guard("flight", y.x, reset={"v": speed}), **again}


def test_the_stable_manifold_is_that_of_the_impact_system():
    """States near the saddle of the ball, which their images approach."""
    plain, ball = BouncingBall(Gamma=1.3, r=0.5), Ball(Gamma=1.3, r=0.5)
    saddle = nsmaps.periodic_orbit(plain, [4.18879, 5.64897])
    same = nsmaps.periodic_orbit(ball, saddle.states * [-1, 1])
    found = nsmaps.manifold(ball, same, "stable", length=2)
    assert len(found.states) > 50
    states = found.states
    for _ in range(6):
        states = ball.first_return(states).image
    off = np.abs(ball.coordinates.difference(states, same.states))
    assert off.max() < 1e-5
    assert np.abs(ball.coordinates.difference(found.states, same.states)).max() > 1
    other = nsmaps.manifold(plain, saddle, "stable", length=3)
    lines = other.states * [-1, 1]
    for state in found.states[::10]:
        assert np.linalg.norm(ball.coordinates.difference(lines, state) / other.scale, axis=1).min() < other.gap


@pytest.mark.parametrize(
    ("system", "said"),
    [
        (Ball(Gamma=1.3, r=0.0), message("exact.reset-to-one-state", system="Ball", guard="B")),
        (Ball(Gamma=1.3, r=0.5, kind="bent"), message("exact.reset-not-reversed", guard="B")),
        (
            Ball(Gamma=1.3, r=0.5, kind="two"),
            message("exact.mode-before", guard="C", mode="flight", before="other", other="flight"),
        ),
        (Friction(mu=0.5), message("exact.one-future", surface="stick")),
        (Belt(zeta=0.02, vb=0.5, A=0.3, w=1.3, mu_k=0.6, mu_s=0.7), message("exact.reset-to-one-state")),
    ],
)
def test_what_has_no_past_is_refused_with_its_guard(system, said):
    with pytest.raises(NsmapsError, match=said):
        reversed_system(system)
