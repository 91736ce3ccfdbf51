"""The impact oscillator against its characteristic roots in 40 digits, an ODE solver and numbers of the literature."""

import mpmath as mp
import numpy as np
import pytest
from messages import message
from nsmaps_impact_oscillator import ImpactOscillator
from pydantic import ValidationError
from scipy.integrate import solve_ivp

import nsmaps
from nsmaps.coordinates import TWO_PI
from nsmaps.dynamics.continuation.follow import continue_branch
from nsmaps.exact.outcome import Outcome

KNOWN = {"A": 0.3475333988945534, "v": 0.065303988295362, "multipliers": (-0.99999666, -0.43549184)}
B_FORM = {"zeta": 0.02, "w": 0.81, "wall": 1, "r": 0.9}  # x'' + 0.04 x' + x = -1 + A cos(0.81 t), wall at zero
REGIMES = {
    "under": ImpactOscillator(zeta=0.05, w=0.81, A=0.7, wall=0.6),
    "critical": ImpactOscillator(zeta=1, w=1.7, A=3, wall=0.1, damping="critical"),
    "over": ImpactOscillator(zeta=1.6, w=2.5, A=4, wall=-0.05, r=0.7, damping="over"),
    "undamped": ImpactOscillator(zeta=0, w=2.2, A=1, wall=0, r=0.6),
    "pressed": ImpactOscillator(zeta=0.1, w=1.3, A=2, wall=-0.5, r=0.8),
}


def motion(system, t0, z, u):
    """x and x' as functions of the time since t0, from the complex roots of the characteristic equation, in mpmath."""
    zeta, w, amplitude = mp.mpf(system.zeta), mp.mpf(system.w), mp.mpf(system.A)
    gain = amplitude * mp.expj(w * t0) / (1 - w**2 + 2j * zeta * w)
    z, u = z - mp.re(gain), u - mp.re(1j * w * gain)
    root = mp.sqrt(zeta**2 - 1)
    if root == 0:
        free = lambda s: mp.exp(-s) * (z + (u + z) * s)  # noqa: E731
    else:
        fast, slow = -zeta - root, -zeta + root
        free = lambda s: mp.re(((u - fast * z) * mp.exp(slow * s) - (u - slow * z) * mp.exp(fast * s)) / (2 * root))  # noqa: E731
    return lambda s: free(s) + mp.re(gain * mp.expj(w * s))


def reached(system, v, phi, s):
    """The end of a flight of time s near a return: its root nearby and the impact speed there."""
    x = motion(system, mp.mpf(phi) / mp.mpf(system.w), mp.mpf(system.wall), -mp.mpf(system.r) * mp.mpf(v))
    s = mp.findroot(lambda s: x(s) - mp.mpf(system.wall), mp.mpf(s), tol=1e-60)
    return s, mp.diff(x, s), x


@pytest.mark.parametrize("regime", REGIMES)
def test_returns_are_on_the_wall_and_none_came_before(regime):
    system = REGIMES[regime]
    rng = np.random.default_rng(5)
    states = np.column_stack([rng.uniform(0.2, 2, 12), rng.uniform(0, TWO_PI, 12)])
    returns = system.first_return(states)
    assert returns.valid.sum() >= 8
    with mp.workdps(40):
        for (v, phi), time, image, ok in zip(states, returns.time, returns.image, returns.valid, strict=True):
            if ok:
                s, speed, x = reached(system, v, phi, time)
                assert abs(s - time) < 1e-11 * (1 + 1 / speed)
                assert abs(speed - image[0]) < 1e-11 * (1 + 1 / speed)
                assert max(x(s * k / 200) for k in range(1, 200)) < system.wall


@pytest.mark.parametrize("regime", REGIMES)
def test_returns_are_those_of_an_ode_solver(regime):
    system = REGIMES[regime]

    def force(t, x):
        return [x[1], system.A * np.cos(system.w * t) - 2 * system.zeta * x[1] - x[0]]

    def touches(t, x):
        return x[0] - system.wall

    touches.terminal, touches.direction = True, 1
    for v, phi in [(1.5, 0.5), (1.0, 2.5), (2.0, 5.0)]:
        t0, start = phi / system.w, [system.wall - 1e-14, -system.r * v]
        options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 0.05}
        flown = solve_ivp(force, (t0, t0 + 400), start, events=touches, **options)
        image = system.first_return([[v, phi]]).lifted[0]
        if len(flown.t_events[0]):
            t, (_, speed) = flown.t_events[0][0], flown.y_events[0][0]
            assert image == pytest.approx([speed, t * system.w], abs=1e-8)
        else:
            assert np.isnan(image).all()


@pytest.mark.parametrize(
    ("zeta", "damping", "off"), [(1 - 1e-8, "under", 5e-14), (1 + 1e-4, "over", 2e-12), (1 + 1e-8, "over", 1e-10)]
)
def test_next_to_critical_damping(zeta, damping, off):
    system = ImpactOscillator(zeta=zeta, w=1.7, A=3, wall=0.1, damping=damping)
    states = np.column_stack([np.linspace(0.2, 2, 12), np.linspace(0, 6, 12)])
    returns = system.first_return(states)
    with mp.workdps(50):
        for (v, phi), time, image in zip(states, returns.time, returns.image, strict=True):
            s, speed, _ = reached(system, v, phi, time)
            assert max(abs(s - time), abs(speed - image[0])) < off


def test_the_orbit_of_the_literature():
    """At its A: impact speed and multipliers, found here and, from characteristic roots in 40 digits, apart."""
    system = ImpactOscillator(A=KNOWN["A"], **B_FORM)
    orbit = nsmaps.periodic_orbit(system, [0.065, 0.08], tolerance=1e-12)
    assert orbit.converged
    assert (orbit.label, orbit.words) == ("1:0/2T", ("BB",))
    assert orbit.states[0, 0] == pytest.approx(KNOWN["v"], abs=1e-12)  # the published digits are 7e-13 off
    assert orbit.multipliers.real == pytest.approx(KNOWN["multipliers"], abs=1e-8)
    with mp.workdps(40):
        time = 4 * mp.pi / mp.mpf(system.w)

        def step(v, phi):
            s, speed, _ = reached(system, v, phi, time)
            return speed, mp.mpf(phi) + (s - time) * mp.mpf(system.w)

        fixed = mp.findroot(lambda v, phi: [a - b for a, b in zip(step(v, phi), (v, phi), strict=True)], tuple(orbit.states[0]))
        assert float(fixed[0]) == pytest.approx(KNOWN["v"], abs=1e-12)
        assert orbit.states[0] == pytest.approx([float(x) for x in fixed], abs=1e-13)
        h = mp.mpf("1e-12")
        columns = [
            [(a - b) / (2 * h) for a, b in zip(step(*(fixed + d)), step(*(fixed - d)), strict=True)]
            for d in (mp.matrix([h, 0]), mp.matrix([0, h]))
        ]
        values = sorted(mp.re(x) for x in mp.eig(mp.matrix(columns).T)[0])
        assert [float(x) for x in values] == pytest.approx(orbit.multipliers.real, abs=1e-9)


def test_its_doubling_is_there():
    start = nsmaps.periodic_orbit(ImpactOscillator(A=0.3477, **B_FORM), [0.07, 0.08])
    branch = continue_branch(lambda a: ImpactOscillator(A=a, **B_FORM), "a", start, 0.3477, (0.3474, 0.3477), direction="down")
    (found,) = branch.of_kind("period doubling")
    assert found.value == pytest.approx(KNOWN["A"], abs=2e-9)  # its multiplier is 3.3e-6 from -1
    assert found.orbit.states[0, 0] == pytest.approx(KNOWN["v"], abs=1e-7)
    assert found.orbit.label == "1:0/2T"


@pytest.mark.parametrize("regime", ["under", "critical"])
def test_the_grazing_amplitude(regime):
    """The largest place of the steady motion, by a long integration without the wall."""
    system = REGIMES[regime]
    grazing = system.grazing_amplitude()
    assert grazing == pytest.approx(system.wall * np.sqrt((1 - system.w**2) ** 2 + (2 * system.zeta * system.w) ** 2), rel=1e-15)

    def force(t, x):
        return [x[1], grazing * np.cos(system.w * t) - 2 * system.zeta * x[1] - x[0]]

    end = 60 / system.zeta
    last = np.linspace(end - TWO_PI / system.w, end, 2000)
    flown = solve_ivp(force, (0, end), [0, 0], method="DOP853", t_eval=last, rtol=1e-11, atol=1e-13)
    assert flown.y[0].max() == pytest.approx(system.wall, rel=1e-5)


def test_below_grazing_orbits_leave_the_wall_and_above_none_does():
    grazing = ImpactOscillator(A=1, **B_FORM).grazing_amplitude()
    starts = np.column_stack([np.full(40, 0.4), np.linspace(0, 6.28, 40)])
    below = nsmaps.orbit(ImpactOscillator(A=0.9 * grazing, **B_FORM), starts, 200)
    assert np.isnan(below.states[-1]).all()
    assert set(below.outcome[-1]) == {Outcome.escaped}
    above = nsmaps.orbit(ImpactOscillator(A=1.001 * grazing, **B_FORM), starts, 400)
    assert np.isfinite(above.states[-1]).all()


@pytest.mark.parametrize(("zeta", "damping"), [(1, "critical"), (1.3, "over")])
def test_flights_that_never_reach_the_wall_escape(zeta, damping):
    """Not `undecided`: they are followed for the horizon of 1000 periods, however the period depends on w."""
    slow = ImpactOscillator(zeta=zeta, w=0.81, A=1, wall=1, damping=damping)
    starts = np.column_stack([np.full(100, 2.1), np.linspace(0, 6.28, 100)])
    assert slow.first_return(starts).counts() == {"escaped": 100}


def test_the_square_root_at_grazing():
    """Strong damping brings each flight to the steady motion, which meets the wall at w sqrt((A/A_graze)^2 - 1) wall."""
    system = ImpactOscillator(zeta=1, w=0.2, A=1, wall=1, r=0.5, damping="critical")
    grazing = system.grazing_amplitude()
    beyond = np.geomspace(1e-7, 1e-3, 5)
    speeds = []
    for share in beyond:
        orbit = nsmaps.orbit(system.at(A=grazing * (1 + share)), [0.3, 0.0], 300, chatter=np.inf)
        speeds.append(orbit.states[200:, 0].max())
    assert speeds == pytest.approx(0.2 * np.sqrt((1 + beyond) ** 2 - 1), rel=1e-6)
    assert np.polyfit(np.log(beyond), np.log(speeds), 1)[0] == pytest.approx(0.5, abs=1e-4)


def test_the_map_is_infinitely_steep_at_grazing():
    """The derivative of the orbit of one impact a period grows as one over its impact speed."""
    grazing = ImpactOscillator(A=1, **B_FORM).grazing_amplitude()
    guess, found = [0.0059, 0.0926], []
    for a in grazing + np.geomspace(2.1e-3, 1e-5, 12):
        orbit = nsmaps.periodic_orbit(ImpactOscillator(A=a, **B_FORM), guess)
        assert orbit.converged
        assert orbit.exists
        beside = ImpactOscillator(A=a, **B_FORM).first_return(orbit.states + np.array([0, 1e-9]), derivative=True)
        assert not nsmaps.dynamics.PeriodicOrbit(beside, orbit.tolerance, orbit.scale).converged
        guess = orbit.states[0] * [0.6, 1]
        found.append([orbit.states[0, 0], abs(orbit.multipliers[0])])
    (v, steep) = np.array(found).T
    assert v[-1] < v[0] / 15
    assert np.polyfit(np.log(v[-4:]), np.log(steep[-4:]), 1)[0] == pytest.approx(-1, abs=0.01)


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"zeta": 1.2}, message("plugins.damping", damping="over")),
        ({"zeta": 1}, message("plugins.damping", damping="critical")),
        ({"zeta": 0.3, "damping": "over"}, message("plugins.damping", damping="under")),
        ({"zeta": 0, "w": 1}, message("plugins.resonance")),
        ({"zeta": -0.1}, message("others.at-least", bound=0)),
    ],
)
def test_what_is_refused(values, why):
    with pytest.raises(ValidationError, match=why):
        ImpactOscillator(**{"w": 0.81, "A": 1, "wall": 1, "zeta": 0.1, **values})
