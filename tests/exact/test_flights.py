"""Flights of systems of every kind against the user's own formula in 40 digits, edge inputs, and what is refused."""

import importlib
import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
from digits import in_balls, number
from flint import ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from messages import message
from pydantic import ValidationError
from systems import BouncingBall, Oscillator, Table

from nsmaps.coordinates import TWO_PI
from nsmaps.errors import NsmapsError, ParameterError, StateError, SystemDefinitionError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall
from nsmaps.exact.words import decode, encode

SYSTEMS = {
    "bouncing ball": (BouncingBall(a=1.3), 3.0),
    "elastic ball": (BouncingBall(a=0.4, r=1.0), 3.0),
    "underdamped": (Oscillator(zeta=0.05, w=0.81, gap=0.7), 2.0),
    "overdamped": (Oscillator(zeta=1.1, w=2.5, gap=0.04, r=0.95, damping="over"), 1.0),
    "critical": (Oscillator(zeta=1.0, w=1.7, gap=0.1, damping="critical"), 1.0),
    "near resonance": (Oscillator(zeta=1e-3, w=0.999, gap=0.7), 2.0),
    "parabolas": (Table(height=0.6), 2.0),
}
KINDS = [*SYSTEMS, "vi pair"]


def system_of(kind, pair):
    return (pair(0.3), 1.3) if kind == "vi pair" else SYSTEMS[kind]


def formula(system):
    """The user's displacement and its rate as functions of (t, t0, z0, w0) in balls: independent of the kernel."""
    t, t0, z0, w0 = sp.symbols("t t0 z0 w0", real=True)
    expr = system.displacement(t, SimpleNamespace(t=t0, z=z0, w=w0))
    return tuple(in_balls((t, t0, z0, w0), each) for each in (expr, sp.diff(expr, t)))


@pytest.mark.parametrize("kind", KINDS)
def test_impacts_are_on_the_walls_and_none_was_missed(kind, pair):
    """Every impact lies on its wall, has its speed, and no wall was crossed on the way: the formula itself, in 40 digits."""
    system, top = system_of(kind, pair)
    place, velocity = formula(system)
    walls = list(system.walls().values())
    loss = 50 if kind == "near resonance" else 1  # there terms of size 500 cancel in the formula itself
    rng = np.random.default_rng(5)
    with ctx.workdps(40):
        for v, phi in zip(rng.uniform(0.02, top, 12), rng.uniform(0, TWO_PI, 12), strict=True):
            hits = system.impacts([v, phi], 4)
            for i in range(len(hits.time) - 1):
                if hits.mark[i + 1]:
                    continue
                wall, name = walls[hits.wall[i]], system.letters[hits.wall[i]]
                t0 = number(hits.phase[i]) / number(system.phase_rate())
                flown = number(hits.time[i + 1]) - number(hits.time[i])
                start = (t0, number(wall.at), -wall.side * number(system.rebound(hits.speed[i], name)))
                end = walls[hits.wall[i + 1]]
                speed = velocity(t0 + flown, *start)
                assert abs(place(t0 + flown, *start) - end.at) < 2e-14 * loss * (1 + hits.time[i + 1]) * (1 + abs(speed))
                assert abs(end.side * speed - hits.speed[i + 1]) < 1e-13 * loss * (1 + hits.time[i + 1])
                for share in np.linspace(0.002, 0.998, 60):
                    z = place(t0 + flown * number(share), *start)
                    assert all(side.side * (side.at - z) > -1e-15 * loss for side in walls)


@pytest.mark.parametrize("kind", KINDS)
def test_derivative_by_differences(kind, pair):
    system, top = system_of(kind, pair)
    rng = np.random.default_rng(6)
    states = np.column_stack([rng.uniform(0.1, top, 200), rng.uniform(0, TWO_PI, 200)])
    returns = system.first_return(states, derivative=True)
    h = 1e-5
    columns = []
    smooth = returns.valid & (returns.outcome == Outcome.returned)
    for step in np.eye(2) * h:
        sides = [system.first_return(states + k * step) for k in (-2, -1, 1, 2)]
        for side in sides:
            smooth &= side.codes == returns.codes
        a, b, c, d = (side.lifted for side in sides)
        columns.append((a - 8 * b + 8 * c - d) / (12 * h))
    numeric = np.stack(columns, axis=2)
    size = np.abs(returns.derivative).max(axis=(1, 2))
    error = np.abs(numeric - returns.derivative).max(axis=(1, 2)) / np.maximum(size, 1e-300)
    calm = smooth & (size < 50) & (size > 1e-3)
    assert calm.sum() > 60
    assert np.quantile(error[calm], 0.9) < 1e-7


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(KINDS),
    v=st.one_of(st.floats(0, 3), st.sampled_from([0.0, 5e-324, 1e-300, 1e-15])),
    phi=st.one_of(st.floats(-50, 50), st.sampled_from([0.0, np.pi, TWO_PI, np.nextafter(TWO_PI, 0)])),
)
def test_any_state_has_an_answer_inside_the_walls(kind, v, phi, pair):
    system, _ = system_of(kind, pair)
    returns = system.first_return([[v, phi]])
    if returns.valid[0]:
        assert returns.image[0, 0] >= 0
        assert 0 <= returns.image[0, 1] < TWO_PI
        assert returns.lifted[0, 1] >= min(phi, returns.lifted[0, 1])
    else:
        assert returns.outcome[0] in (Outcome.rests, Outcome.escaped)
    t, z = system.trajectory([v, phi], 12)
    assert (np.diff(t) >= -1e-300).all()  # linspace between denormal numbers
    for wall in system.walls().values():
        assert (wall.side * (wall.at - z) > -1e-12 * (1 + np.abs(z).max(initial=0))).all()


def test_edge_inputs_are_data(pair):
    states = [[np.nan, 0], [0.1, np.inf], [-0.1, 1], [np.inf, 1], [0.1, 1e300], [0.43, 0.26 - 2 * TWO_PI]]
    returns = pair(0.35).first_return(states)
    assert returns.outcome.tolist() == [Outcome.invalid] * 5 + [Outcome.returned]
    assert np.isnan(returns.image[:5]).all()
    far = pair(0.35).first_return([[0.43, 9.9e9], [0.43, 1.4e10]])  # more turns than 32 bits hold
    assert far.outcome.tolist() == [Outcome.returned, Outcome.invalid]
    assert far.turns[0, 1] == round(9.9e9 / TWO_PI)
    plain = pair(0.35).first_return([[0.43, 0.26]])
    assert returns.image[5] == pytest.approx(plain.image[0], abs=1e-14)
    assert returns.lifted[5, 1] == pytest.approx(plain.lifted[0, 1] - 2 * TWO_PI, abs=1e-13)
    assert len(pair(0.35).first_return(np.empty((0, 2)))) == 0


@pytest.mark.parametrize("states", [[0.1, 0.2], [[0.1]], [[0.1, 0.2, 0.3]], 1.0])
def test_wrong_shape_is_an_error(pair, states):
    with pytest.raises(StateError, match=message("errors.shape", what="states have", expected="shape (N, 2)")):
        pair(0.35).first_return(states)


def test_rest_at_r_zero_and_for_ever(pair):
    dead = pair(0.35, r=0.0)
    returns = dead.first_return([[0.3, 1.0]])
    assert returns.words[0] == "B_"
    assert returns.outcome[0] == Outcome.stuck
    assert returns.image[0] == pytest.approx([0, np.arccos(-dead.g_bar)], abs=1e-14)
    heavy = type(dead)(d=0.35, r=0.5, g_bar=1.5)  # the forcing never lifts the ball off
    assert heavy.first_return([[0.0, 1.0]]).outcome[0] == Outcome.rests
    assert heavy.first_return([[1e-13, 1.0]]).outcome[0] == Outcome.rests
    parabola = Table(height=10.0).first_return([[1.0, 0.0], [0.0, 0.0]])
    assert parabola.time[0] == pytest.approx(1.8, rel=1e-15)
    assert parabola.outcome.tolist() == [Outcome.returned, Outcome.rests]


def test_chatter_on_the_other_wall_is_completed_within_a_return(pair):
    """Fast starts at d = 0.26: impacts accumulate on T, the ball rests there, is released and comes back to B."""
    rng = np.random.default_rng(4)
    states = np.column_stack([rng.uniform(1.2, 1.5, 20_000), rng.uniform(0, TWO_PI, 20_000)])
    returns = pair(0.26).first_return(states)
    long = returns.has_word("BT~B")
    assert long.sum() > 5
    assert returns.valid.all()
    # what comes after the rest does not depend on how the ball came to it
    assert np.ptp(returns.image[long], axis=0).max() < 1e-12


def test_words_have_one_grammar():
    for word in ("BB", "BTB", "BTTB", "BBTB", "B~", "B_", "BT~B"):
        assert decode(encode(word, ("B", "T")), ("B", "T")) == word
    with pytest.raises(StateError, match=message("exact.letter", letter="XB")):
        encode("BXB", ("B", "T"))


def test_a_parameter_is_validated_and_unknown_ones_are_named(pair):
    with pytest.raises(NsmapsError, match=message("errors.unknown-near", kind="parameter", name="dd")):
        pair(0.35).at(dd=1)
    with pytest.raises(ParameterError, match=message("errors.value", name="d", value=-1, at="VIPair")):
        pair(0.35).at(d=-1)
    assert pair(0.35).at(d=0.3).d == 0.3
    with pytest.raises(ValidationError, match=message("exact.not-used")):
        type(pair(0.3))(d=0.3, g_bar=0.2, s=1)
    with pytest.raises(ValidationError, match=message("exact.positive", name="M", value=-1)):
        type(pair(0.3))(d=0.3, M=-1, g=9.8, beta=1, F=5)


def test_physical_parameters_are_eq_impact(pair):
    system = type(pair(0.3))(s=0.5, M=0.1245, omega=5 * np.pi, F=5, g=9.8, beta=np.pi / 3)
    assert system.d == pytest.approx(0.5 * 0.1245 * 25 / 5, rel=1e-15)
    assert system.g_bar == pytest.approx(0.211327519, abs=1e-9)


def broken(body):
    class Broken(Table):
        def displacement(self, t, hit):
            return body(self, t - hit.t, t, hit)

    return Broken(height=1.0)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (lambda self, s, t, hit: hit.z + hit.w * s + sp.sin(t**2), message("exact.not-linear-in-time")),
        (lambda self, s, t, hit: hit.z + hit.w * s + sp.sqrt(1 + s), message("exact.not-followed")),
        (lambda self, s, t, hit: hit.z - hit.w * s - s**2, message("exact.velocity-of-flight")),
        (lambda self, s, t, hit: hit.z + 1 + hit.w * s, message("exact.start-of-flight")),
        (lambda self, s, t, hit: hit.z + hit.w * s if self.height > 2 else hit.z, message("exact.branches")),
        (lambda self, s, t, hit: hit.z + hit.w * s - sp.Symbol("q") * s**2, message("exact.unknown-symbols", symbols="q")),
        (
            lambda self, s, t, hit: hit.z + hit.w * s + sp.cos(t) - sp.cos(hit.t) + s * sp.sin(hit.t),
            message("exact.second-forcing"),
        ),
        (lambda self, s, t, hit: hit.z + hit.w * s - s**3, message("exact.restarted")),
    ],
)
def test_formulas_that_cannot_be_certified_are_refused_by_name(body, why):
    with pytest.raises(SystemDefinitionError, match=why):
        broken(body).first_return([[0.1, 0.1]])


def test_classes_made_by_a_function_have_kernels_of_their_own():
    def falling(gravity):
        class Fall(Table):
            def displacement(self, t, hit):
                s = t - hit.t
                return hit.z + hit.w * s - gravity * s**2 / 2

        return Fall(height=10.0)

    times = [falling(g).first_return([[1.0, 0.0]]).time[0] for g in (1, 2)]
    assert times == pytest.approx([1.8, 0.9])


def test_a_constant_in_another_file_is_part_of_the_formula(tmp_path, monkeypatch):
    """A kernel is found again by the text of all that its formulas are made of."""
    (tmp_path / "constants_of_fall.py").write_text("G = 1\n")
    (tmp_path / "fall_system.py").write_text(
        "from systems import Table\nfrom constants_of_fall import G\n\n\nclass Fall(Table):\n"
        "    def displacement(self, t, hit):\n        s = t - hit.t\n        return hit.z + hit.w * s - G * s**2 / 2\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    times = []
    for text in ("G = 1\n", "G = 2  # another planet\n"):
        (tmp_path / "constants_of_fall.py").write_text(text)
        for name in ("constants_of_fall", "fall_system"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
        times.append(importlib.import_module("fall_system").Fall(height=10.0).first_return([[1.0, 0.0]]).time[0])
    assert times == pytest.approx([1.8, 0.9])


def test_a_class_without_a_file_works():
    code = (
        "import sys; sys.path[:0] = sys.argv[1:]\nfrom systems import Table\n"
        "class Mine(Table):\n    pass\n"
        "print(Mine(height=10.0).first_return([[1.0, 0.0]]).time[0])"
    )
    env = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run([sys.executable, "-c", code, *sys.path], env=env, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert float(run.stdout) == pytest.approx(1.8)


def test_two_walls_on_one_side_are_refused():
    with pytest.raises(SystemDefinitionError, match=message("exact.sides")):

        class Odd(Table):
            def walls(self):
                return {"A": Wall(at=0, side=-1), "C": Wall(at=1, side=-1)}


def test_a_system_without_an_impact_law_is_refused_when_defined():
    with pytest.raises(SystemDefinitionError, match=message("exact.no-restitution")):

        class Lawless(ImpactSystem):
            walls = period = displacement = Table.displacement


def test_many_threads_give_what_one_gives(pair):
    rng = np.random.default_rng(2)
    states = np.column_stack([rng.uniform(0, 1.5, 60_000), rng.uniform(0, TWO_PI, 60_000)])
    whole = pair(0.26).first_return(states)
    part = pair(0.26).first_return(states[40_000:40_500])
    assert np.array_equal(whole.image[40_000:40_500], part.image)
    assert np.array_equal(whole.codes[40_000:40_500], part.codes)
