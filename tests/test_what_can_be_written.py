"""The table of what can be written: each row is tried, and what it promises compared with a value known otherwise."""

import math
import re
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from messages import message
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from systems import Logistic

import nsmaps
from nsmaps import Guard, HybridSystem, ImpactSystem, Noise, PoincareSection, Returns, SlidingSurface, Wall
from nsmaps.errors import SystemDefinitionError
from nsmaps.exact.trajectory import track
from nsmaps.exports.languages import LANGUAGES
from nsmaps.proof.maps.prove import prove_map
from nsmaps.verify.certificate import verify

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "systems.md"
TABLE = PAGE.read_text(encoding="utf-8").split("| system | can it be written? |\n|---|---|\n")[1].split("\n\n")[0]
ROWS = [line.strip("| ").split(" | ")[0] for line in TABLE.splitlines()]


def impact_system(displacement=None, **formulas):
    """A class of a ball above a floor at 0, with these formulas."""
    given = {
        "walls": lambda self: {"B": Wall(at=0, side=-1)},
        "period": lambda self: 2 * sp.pi,
        "rebound": lambda self, speed, wall: speed / 2,
        "__module__": __name__,
    }
    if displacement is not None:
        given["displacement"] = displacement
    return type("Ball", (ImpactSystem,), given | formulas)


def falling(self, t, hit):
    return hit.z + hit.w * (t - hit.t) - (t - hit.t) ** 2 / 2


def hybrid(states, modes, guards, section, period=None, **others):
    """A class of a system with modes."""
    given = {
        "states": states,
        "modes": lambda self, t, y: modes(t, y),
        "guards": lambda self, t, y: guards(t, y),
        "section": lambda self, t, y: section,
        "period": lambda self: period,
        "__module__": __name__,
    }
    return type("Modes", (HybridSystem,), given | others)()


def gravity_and_springs():
    """x'' = -1 - 4 x from v = 1/2: back where sin 2t = 1 - cos 2t, after pi/4; with damping of 2 x' and 5 x' an integrator."""

    def spring(self, t, hit):
        s, a = t - hit.t, sp.Rational(1, 4)
        return -a + (hit.z + a) * sp.cos(2 * s) + hit.w / 2 * sp.sin(2 * s)

    def under(self, t, hit):
        s, a, b = t - hit.t, sp.Rational(1, 4), sp.sqrt(3)
        return -a + sp.exp(-s) * ((hit.z + a) * sp.cos(b * s) + (hit.w + hit.z + a) / b * sp.sin(b * s))

    def over(self, t, hit):
        s, a, w = t - hit.t, hit.z + sp.Rational(1, 4), hit.w
        return -sp.Rational(1, 4) + ((4 * a + w) * sp.exp(-s) - (a + w) * sp.exp(-4 * s)) / 3

    assert impact_system(spring)().first_return([[1.0, 0.0]]).time == pytest.approx([math.pi / 4])
    for damping, flight in ((2, under), (5, over)):
        one = impact_system(flight)().first_return([[1.0, 0.0]])
        rates = lambda t, y: [y[1], -1 - 4 * y[0] - damping * y[1]]  # noqa: B023, E731
        later = solve_ivp(rates, (0, one.time[0]), [0, 0.5], rtol=1e-12, atol=1e-13)
        assert later.y[:, -1] == pytest.approx([0, -one.image[0, 0]], abs=1e-10)


def harmonics_or_none():
    """x'' = -1 + sin 3t/2: the same after 2 pi, and a ball without forcing after any time."""
    wave = lambda t: -sp.sin(3 * t) / 18  # noqa: E731
    forced = impact_system(
        lambda self, t, hit: falling(self, t, hit) + wave(t) - wave(hit.t) + sp.cos(3 * hit.t) / 6 * (t - hit.t)
    )
    one = forced().first_return([[2.0, 0.3]])
    later = solve_ivp(lambda t, y: [y[1], -1 + math.sin(3 * t) / 2], (0.3, 0.3 + one.time[0]), [0, 1], rtol=1e-12, atol=1e-12)
    assert later.y[:, -1] == pytest.approx([0, -one.image[0, 0]], abs=1e-10)
    assert impact_system(falling, period=lambda self: 5)().first_return([[2.0, 0.0]]).image[0, 0] == pytest.approx(1.0)


def two_periods():
    """x'' = -1 + cos t/5 + cos(sqrt(2) t)/5 above a floor, from both phases: an integrator."""
    w = sp.sqrt(2)
    made = hybrid(
        ("x", "v", "p", "q"),
        lambda t, y: {"fly": {"x": y.v, "v": -1 + (sp.cos(t) + y.p) / 5, "p": -w * y.q, "q": w * y.p}},
        lambda t, y: {"B": Guard("fly", y.x, reset={"v": -0.8 * y.v})},
        PoincareSection("B", ("v", "p", "q", "phi")),
        period=2 * sp.pi,
    )
    one = made.first_return([[-1.0, 1.0, 0.0, 0.0]])
    force = lambda t, y: [y[1], -1 + (math.cos(t) + math.cos(math.sqrt(2) * t)) / 5]  # noqa: E731
    later = solve_ivp(force, (0, one.time[0]), [0, 0.8], rtol=1e-12, atol=1e-13)
    assert later.y[:, -1] == pytest.approx([0, one.image[0, 0]], abs=1e-9)
    assert one.image[0, 1:3] == pytest.approx([math.cos(math.sqrt(2) * one.time[0]), math.sin(math.sqrt(2) * one.time[0])])


def noise():
    """Without strength it changes nothing, in flights and modes; on images it is a normal deviate of its standard deviation."""
    pair, given = nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113), {"eta": 0, "kappa": 0, "Lambda": 0, "d": 0.35}
    for system, start in (
        (pair, [0.8, 0.3]),
        (nsmaps.load_system("recoil_pair", **given, r=0.5, g_bar=0.2113), [0.5, 0.1, -0.6, 1.0]),
    ):
        quiet = nsmaps.noisy_orbits(system, start, Noise(sigma=0, tau=0.5), n_returns=1)
        assert quiet.states[1, 0] == pytest.approx(system.first_return([start]).image[0], abs=1e-9)
    for system, start, scale in ((pair, [0.8, 0.3], {"v": 1, "phi": 1}), (Logistic(r=2.5), [0.5], None)):
        kicks = (
            nsmaps.noisy_orbits(system, start, Noise(sigma=1e-3, scale=scale), n_returns=1, n_realisations=4000).states[1]
            - system.first_return([start]).image
        )
        assert kicks.std(axis=0) == pytest.approx(np.full(len(start), 1e-3), rel=0.06)  # five standard errors of 1/sqrt(8000)


def moving_walls():
    """The ball on a shaken table, locked once a period: v (1 + r) is gravity times the period."""
    table = nsmaps.load_system("bouncing_ball", Gamma=1.3, r=0.5)
    orbit = nsmaps.periodic_orbit(table, [2 * math.pi / 1.5, 0.5])
    assert orbit.states[0, 0] == pytest.approx(2 * math.pi / 1.5)


def walls_that_move_apart():
    """A floor of speed 1/2 up and a ceiling at 2: up with 1 from 0, the floor is met where t/2 = t - t^2/2."""
    made = hybrid(
        ("x", "v", "f"),
        lambda t, y: {"fly": {"x": y.v, "v": -1, "f": sp.Rational(1, 2)}},
        lambda t, y: {
            "F": Guard("fly", y.x - y.f, reset={"v": 1 - y.v, "x": 0, "f": 0}),
            "C": Guard("fly", 2 - y.x, reset={"v": -y.v}),
        },
        PoincareSection("F", ("x", "v")),
    )
    assert made.first_return([[0.0, 0.0]]).time == pytest.approx([1.0])


def law_of_the_speed():
    law = impact_system(falling, rebound=lambda self, speed, wall: speed / (1 + speed))
    assert law().first_return([[2.0, 0.0]]).image[0, 0] == pytest.approx(2 / 3)


def law_of_the_phase():
    """A restitution of 1/2 + sin(t)/4 at t = 1."""
    made = hybrid(
        ("x", "v"),
        lambda t, y: {"fly": {"x": y.v, "v": -1}},
        lambda t, y: {"B": Guard("fly", y.x, reset={"v": -(sp.Rational(1, 2) + sp.sin(t) / 4) * y.v})},
        PoincareSection("B", ("v", "phi")),
        period=2 * sp.pi,
    )
    r = 0.5 + math.sin(1.0) / 4
    assert made.first_return([[-1.0, 1.0]]).image[0] == pytest.approx([-r, 1 + 2 * r])


def chatter():
    """On a floor that stands still a ball rests; on one that moves as 2 sin t it leaves where sin t = 1/2."""
    assert impact_system(falling)().first_return([[1e-15, 0.3]]).counts() == {"rests": 1}
    table = nsmaps.load_system("bouncing_ball", Gamma=2, r=0.5).first_return([[1e-15, 0.1]])
    assert (table.counts(), table.image[0, 1]) == ({"stuck": 1}, pytest.approx(math.pi / 6))


def growing_flights():
    """x'' = x - 1 above a floor, up with 1/2: back after 2 atanh(1/2) = ln 3."""
    made = impact_system(lambda self, t, hit: 1 + (hit.z - 1) * sp.cosh(t - hit.t) + hit.w * sp.sinh(t - hit.t), horizon=20)
    assert made().first_return([[1.0, 0.0]]).time == pytest.approx([math.log(3)])


def acceleration():
    """The pendulum x'' = -sin(x + 1): an integrator."""
    pytest.importorskip("heyoka")
    made = impact_system(acceleration=lambda self, t, place, velocity: -sp.sin(place + 1))
    one = made().first_return([[1.0, 0.0]])
    later = solve_ivp(lambda t, y: [y[1], -math.sin(y[0] + 1)], (0, one.time[0]), [0, 0.5], rtol=1e-12, atol=1e-13)
    assert later.y[:, -1] == pytest.approx([0, -one.image[0, 0]], abs=1e-9)
    assert not one.certified.any()


def kinks():
    """x'' = -1 - max(v, -v/2) from v = 1; and with the drag v |v| back with the speed 1/sqrt(2)."""
    ball = {
        "states": ("x", "v"),
        "guards": lambda t, y: {"B": Guard("fly", y.x, reset={"v": -y.v})},
        "section": PoincareSection("B", ("v",)),
    }
    made = hybrid(modes=lambda t, y: {"fly": {"x": y.v, "v": -1 - sp.Max(y.v, -y.v / 2)}}, **ball)
    top = 1 - math.log(2)
    fall = brentq(lambda s: top + 2 * (s - 2 * (math.exp(s / 2) - 1)), 0.1, 2)
    assert made.first_return([[-1.0]]).image[0, 0] == pytest.approx(-2 * (math.exp(fall / 2) - 1))
    pytest.importorskip("heyoka")
    made = hybrid(modes=lambda t, y: {"fly": {"x": y.v, "v": -1 - y.v * abs(y.v)}}, **ball)
    assert made.first_return([[-1.0]]).image[0, 0] == pytest.approx(-math.sqrt(0.5), abs=1e-14)


def switches():
    """Dry friction of 1/2 stops a speed of 1 after 2, before the next impulse at 3; a wall is a spring, x'' = -1 - 9 x."""
    wall = hybrid(
        ("x", "v"),
        lambda t, y: {"free": {"x": y.v, "v": -1}, "contact": {"x": y.v, "v": -1 - 9 * y.x}},
        lambda t, y: {"C": Guard("free", y.x, to="contact"), "F": Guard("contact", -y.x, to="free")},
        PoincareSection("F", ("v",)),
    )
    bounce = wall.first_return([[1.0]])
    assert (bounce.image[0, 0], bounce.time[0]) == pytest.approx((1, 2 + 2 / 3 * (math.pi - math.atan(3))))
    made = hybrid(
        ("v", "c"),
        lambda t, y: {"slip": {"v": -sp.Rational(1, 2), "c": 1}, "back": {"v": sp.Rational(1, 2), "c": 1}},
        lambda t, y: {
            "stick": SlidingSurface("slip", "back", y.v),
            "J": Guard(("slip", "stick"), 3 - y.c, to="slip", reset={"v": y.v + 1, "c": 0}),
        },
        PoincareSection("J", ("v",)),
    )
    assert made.first_return([[0.0]]).image == pytest.approx(np.zeros((1, 1)), abs=1e-15)


def two_bodies():
    """Equal balls that exchange their speeds between walls: the left one is at 0 after 1, they meet after 4/3."""
    made = hybrid(
        ("x", "y", "u", "v"),
        lambda t, y: {"fly": {"x": y.u, "y": y.v, "u": 0, "v": 0}},
        lambda t, y: {
            "M": Guard("fly", y.y - y.x, reset={"u": y.v, "v": y.u}),
            "L": Guard("fly", y.x, reset={"u": -y.u}),
            "R": Guard("fly", 1 - y.y, reset={"v": -y.v}),
        },
        PoincareSection("M", ("x", "u", "v")),
    )
    assert made.first_return([[0.5, 1.0, -0.5]]).image[0] == pytest.approx([1 / 6, 0.5, -1], abs=1e-15)
    pytest.importorskip("heyoka")
    spring = hybrid(  # their distance d'' = -2 d^3 is zero after a quarter of the lemniscate's length
        ("x", "y", "u", "v"),
        lambda t, y: {"fly": {"x": y.u, "y": y.v, "u": (y.y - y.x) ** 3, "v": (y.x - y.y) ** 3}},
        lambda t, y: {"M": Guard("fly", y.y - y.x)},
        PoincareSection("M", ("x", "u", "v")),
    )
    met = spring.arrivals([[0.0, 1.0, 0.5, 0.5]])
    quarter = math.gamma(1 / 4) ** 2 / (4 * math.sqrt(2 * math.pi))
    assert (met.time[0], *met.image[0]) == pytest.approx((quarter, (1 + quarter) / 2, 1, 0), abs=1e-14)


def delay():
    for late, said in (
        (lambda t, y: y.x(t - 1), message("exact.delay")),
        (lambda t, y: sp.Function("x")(t - 1), message("exact.delayed-state", state="v")),
    ):
        made = hybrid(
            ("x", "v"),
            lambda t, y, late=late: {"fly": {"x": y.v, "v": -late(t, y)}},
            lambda t, y: {"B": Guard("fly", y.x, reset={"v": -y.v})},
            PoincareSection("B", ("v",)),
        )
        with pytest.raises(SystemDefinitionError, match=said):
            made.first_return([[-1.0]])


class InPython(nsmaps.System):
    """The same as a program."""

    a: float
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        slopes = (self.a * (1 - 2 * states))[:, :, None] if derivative else None
        return Returns.of_map(self.coordinates, states, self.a * states * (1 - states), slopes)


def cam_of_polynomials():
    """The gap above a cubic spline, whose second derivative is 2 to -2 and back: a flight, and release where it is -1."""
    follower = hybrid(
        ("z", "u", "th"),
        lambda t, y: {"air": {"z": y.u, "u": -1 - sp.Piecewise((2 - 2 * y.th, y.th < 2), (2 * y.th - 6, True)), "th": 1}},
        lambda t, y: {
            "B": Guard("air", y.z, reset={"u": -y.u / 2}, rests="cam"),
            "turn": Guard(("air", "cam"), 4 - y.th, reset={"th": 0}, letter=""),
        },
        PoincareSection("B", ("u", "th")),
    )
    flight = follower.first_return([[-1.0, 0.1]])
    time = 1.5 * (1.4 - math.sqrt(1.4**2 - 2 / 3))  # 0.5 s - 1.4 s**2 + s**3/3 is zero
    assert flight.image == pytest.approx(np.array([[0.5 - 2.8 * time + time**2, 0.1 + time]]), abs=1e-12)
    settling = nsmaps.orbit(follower, [-0.02, 0.2], 60)
    released = settling.outcome.tolist().index(nsmaps.Outcome.stuck)
    assert settling.states[released + 1] == pytest.approx([0, 1.5], abs=1e-12)


def own_map():
    """Its fixed point 1 - 1/a has the multiplier 2 - a, and so a deviate of 1/sqrt(1 - (2 - a)^2) of the noise."""
    for return_map in (Logistic(r=2.5), InPython(a=2.5)):
        orbit = nsmaps.periodic_orbit(return_map, [0.5])
        assert (orbit.states[0, 0], orbit.multipliers[0].real) == pytest.approx((0.6, -0.5))
        square = nsmaps.observe(return_map, [0.6], [{"name": "square", "formula": "x**2"}], n_returns=5)
        assert square.per_return.value == pytest.approx([0.36])
        noisy = nsmaps.noisy_orbits(return_map, [0.6], Noise(sigma=1e-4), n_returns=20, n_realisations=2000).states[-1]
        assert noisy.std() == pytest.approx(1e-4 / math.sqrt(0.75), rel=0.08)
        with pytest.raises(nsmaps.NsmapsError, match=message("exact.no-motion", what="a trajectory")):
            track(return_map, [0.5], 2)
    proved = verify(prove_map(Logistic(r=2.5), cycles=[([0.6], 1)]))
    assert [len(cycle.states) for cycle in proved.cycles] == [1]
    found = nsmaps.cells.find_cycles(Logistic(r=2.5), [[0.3, 0.9]], max_period=1)
    assert [cycle.states[0, 0] for cycle in found.cycles] == [pytest.approx(0.6)]
    assert all(nsmaps.export(Logistic(r=2.5), language) for language in LANGUAGES)
    exec(nsmaps.export(Logistic(r=2.5), "python"), program := {})
    assert program["logistic"]([[0.2]])[0] == pytest.approx(0.4)
    with pytest.raises(nsmaps.NsmapsError, match=message("exports.by-program", map="InPython", language="c")):
        nsmaps.export(InPython(a=2.5), "c")
    with pytest.raises(nsmaps.NsmapsError, match=message("enclosures.no-images-of-boxes", map="InPython")):
        nsmaps.cells.find_cycles(InPython(a=2.5), [[0.3, 0.9]], max_period=1)


CASES = {
    "gravity": gravity_and_springs,
    "forcing of harmonics": harmonics_or_none,
    "forcing of two incommensurate": two_periods,
    "forcing by noise": noise,
    "a wall that moves": moving_walls,
    "two walls that move relative": walls_that_move_apart,
    "a cam whose profile": cam_of_polynomials,
    "restitution that depends on the speed": law_of_the_speed,
    "restitution that depends on the phase": law_of_the_phase,
    "chatter": chatter,
    "flights that grow": growing_flights,
    "pendulum": acceleration,
    "forces with a kink": kinks,
    "compliant walls": switches,
    "two bodies": two_bodies,
    "equations with a delay": delay,
    "a return map without a flight": own_map,
}


def case_of(row):
    """The test of a row, which must be one."""
    (case,) = [case for name, case in CASES.items() if row.startswith(name)]
    return case


@pytest.mark.parametrize("row", ROWS, ids=lambda row: re.sub(r"\W+", " ", row)[:40])
def test_each_row_is_true(row):
    case_of(row)()


def test_no_test_is_of_a_row_that_is_gone():
    assert sorted(map(case_of, ROWS), key=repr) == sorted(CASES.values(), key=repr)


IN_WORDS = {2: "two", 4: "four", 11: "eleven", 12: "twelve", 29: "twenty-nine"}


def test_the_systems_that_are_listed_are_those_that_are_included():
    """Of each kind as many as the list of README states, and the plugin of each is named there or on the page of its kind."""
    points = tomllib.loads((PAGE.parents[2] / "pyproject.toml").read_text())["project"]["entry-points"]["nsmaps.systems"]
    kinds = Counter(kind_of(nsmaps.systems()[name]) for name in points)
    (listed,) = re.findall(
        r"^[\w-]+ systems are included.*?(?=\n\n|\Z)", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    stated = re.search(
        r"(\S+) systems are.* (\S+) have\s+impacts on walls.* (\S+) have\s+modes.* (\S+) are\s+integrated.* (\S+) are\s+maps",
        listed,
        re.DOTALL,
    )
    counts = [len(points), *(kinds[kind] for kind in ("walls", "modes", "integrated", "maps"))]
    assert [word.lower() for word in stated.groups()] == [IN_WORDS.get(count) for count in counts]
    pages = re.sub("[-_]", " ", listed + (PAGE.parent / "hybrid-systems.md").read_text(encoding="utf-8"))
    plugins = {point.split(":")[0].removeprefix("nsmaps_").replace("_", " ") for point in points.values()}
    assert [plugin for plugin in plugins if plugin not in pages] == []


def kind_of(cls):
    """What the list calls a class."""
    if issubclass(cls, ImpactSystem):
        return "walls" if cls.flight() == "displacement" else "integrated"
    return "modes" if issubclass(cls, HybridSystem) else "maps"
