"""Sections of systems with modes: where a start is, by closed forms and roots of 30 digits."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from messages import message
from nsmaps_recoil_pair import RecoilPair
from nsmaps_vi_pair import VIPair

import nsmaps
from nsmaps import Guard, HybridSystem, Outcome, PoincareSection, SlidingSurface, orbit, periodic_orbit
from nsmaps.errors import ProofError, SystemDefinitionError


def root(f, low, high):
    """The first zero of a function that falls from positive values, seen on a grid, in the digits of the context."""
    times = mp.linspace(low, high, 400)
    k = next(k for k in range(399) if f(times[k]) > 0 >= f(times[k + 1]))
    return mp.findroot(f, (times[k], times[k + 1]), solver="anderson")


class Plank(HybridSystem):
    """A block on a plank that is pushed: v' = a cos t - mu sgn v - c, seen once a period at the phase p."""

    a: float = 1.5
    mu: float = 0.7
    c: float = 0.1
    p: float = 0.4
    states = ("v",)

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        force = self.a * sp.cos(t) - self.c
        return {"right": {"v": force - self.mu}, "left": {"v": force + self.mu}}

    def guards(self, t, y):
        clock = Guard(("right", "left", "stick"), -sp.sin(t - self.p), letter="c")
        return {"stick": SlidingSurface("right", "left", y.v, letters={"stick": "K"}), "clock": clock}

    def section(self, t, y):
        return PoincareSection("clock", ("v",))


def plank_later(v, a, mu, c, p):
    """A period later, by the integral of the force in each slip and roots of where it ends."""
    t, end = mp.mpf(p), mp.mpf(p) + 2 * mp.pi
    force = lambda s: a * mp.cos(s) - c  # noqa: E731
    while t < end:
        if v == 0 and abs(force(t)) < mu:  # sticks until the force has the size of the friction
            ends = [s for s in mp.linspace(t, end, 4000) if abs(force(s)) > mu]
            if not ends:
                return mp.mpf(0)
            step = (end - t) / 3999
            t = mp.findroot(lambda s: mu - abs(force(s)), (ends[0] - step, ends[0]), solver="anderson")
            sign = mp.sign(force(t))
        else:
            sign = mp.sign(v) if v != 0 else mp.sign(force(t))
        speed = lambda s, t=t, v=v, sign=sign: v + a * (mp.sin(s) - mp.sin(t)) - (c + sign * mu) * (s - t)  # noqa: E731
        times = mp.linspace(t + mp.mpf("1e-6"), end, 4000)
        k = next((k for k in range(3999) if sign * speed(times[k]) > 0 >= sign * speed(times[k + 1])), None)
        if k is None:
            return speed(end)
        t, v = mp.findroot(speed, (times[k], times[k + 1]), solver="anderson"), mp.mpf(0)
    return v


@pytest.mark.parametrize("p", [0.0, 0.4, 2.0, 4.5])
def test_a_start_on_a_sliding_surface_returns_a_period_later(p):
    block = Plank(p=p)
    returns = block.first_return([[0.0], [0.3], [-0.2]])
    with mp.workdps(30):
        wanted = [
            plank_later(mp.mpf(v), mp.mpf(1.5), mp.mpf("0.7"), mp.mpf("0.1"), p) for v in (0, mp.mpf(3) / 10, -mp.mpf(2) / 10)
        ]
    assert returns.certified.all()
    assert returns.time == pytest.approx(2 * np.pi, abs=1e-14)
    assert returns.image.ravel() == pytest.approx([float(x) for x in wanted], abs=1e-13)
    assert block.arrivals([[0.0, p]]).image == pytest.approx(returns.image[:1], abs=1e-13)


def test_an_orbit_that_sticks_at_the_strobe_takes_a_period():
    still = periodic_orbit(Plank(a=0.9, mu=0.85, c=0.0, p=1.5), [0.0])
    assert still.returns.time == pytest.approx([2 * np.pi])
    assert abs(still.states).max() < 1e-15


def test_an_event_at_the_strobe_is_not_a_return():
    """A ball that is at a plate, and moves to it, when its section begins: the impact comes first, the section a unit later."""

    class Table(HybridSystem):
        states = ("x", "v")

        def period(self):
            return 1

        def modes(self, t, y):
            return {"up": {"x": y.v, "v": -2}}

        def guards(self, t, y):
            return {"L": Guard("up", y.x, reset={"v": -y.v / 2}), "c": Guard("up", -sp.sin(2 * sp.pi * t))}

        def section(self, t, y):
            return PoincareSection("c", ("x", "v"))

    returns = Table().first_return([[0.0, -3.0]])
    assert returns.words.tolist() == ["cLc"]
    assert returns.time.tolist() == [1.0]
    assert returns.image == pytest.approx(np.array([[0.5, -0.5]]), abs=1e-15)


class Late(HybridSystem):
    """x'' + 2 z x' + x = A cos w t above a wall at -1, seen where the clock falls: w t = pi + p."""

    z: float = 0.05
    A: float = 1.0
    w: float = 0.8
    p: float = 0.7
    states = ("x", "v")

    def period(self):
        return 2 * sp.pi / self.w

    def modes(self, t, y):
        return {"m": {"x": y.v, "v": self.A * sp.cos(self.w * t) - 2 * self.z * y.v - y.x}}

    def guards(self, t, y):
        return {"c": Guard("m", sp.sin(self.w * t - self.p)), "W": Guard("m", 1 + y.x, reset={"v": -0.7 * y.v})}

    def section(self, t, y):
        return PoincareSection("c", ("x", "v"))


def late_later(x, v, z, A, w, p):
    """A period after the clock, by the closed form of flights and roots."""
    start, d = (mp.pi + p) / w, mp.sqrt(1 - z * z)
    t, end = start, start + 2 * mp.pi / w
    b, g = 2 * z * w, 1 - w * w
    steady = lambda s: A * (g * mp.cos(w * s) + b * mp.sin(w * s)) / (g * g + b * b)  # noqa: E731
    while True:
        x0, v0 = x - steady(t), v - mp.diff(steady, t)
        place = lambda s, t=t, x0=x0, v0=v0: (  # noqa: E731
            steady(s) + mp.exp(-z * (s - t)) * (x0 * mp.cos(d * (s - t)) + (v0 + z * x0) / d * mp.sin(d * (s - t)))
        )
        times = mp.linspace(t + mp.mpf("1e-4"), end, 500)
        k = next((k for k in range(499) if place(times[k]) > -1 >= place(times[k + 1])), None)
        if k is None:
            return place(end), mp.diff(place, end)
        t = mp.findroot(lambda s, f=place: f(s) + 1, (times[k], times[k + 1]), solver="anderson")
        x, v = mp.mpf(-1), -mp.diff(place, t) * 7 / 10


def test_a_clock_at_any_phase():
    late, starts = Late(), np.array([[0.5, 0.3], [2.0, -1.0]])
    with mp.workdps(30):
        wanted = [late_later(*map(mp.mpf, start), mp.mpf(0.05), mp.mpf(1), mp.mpf(0.8), mp.mpf(0.7)) for start in starts.tolist()]
        h = mp.mpf("1e-8")
        up, down = (
            late_later(*map(mp.mpf, starts[0].tolist()), mp.mpf(0.05), mp.mpf(1), mp.mpf(0.8), mp.mpf(0.7) + s) for s in (h, -h)
        )
    assert late.first_return(starts).image == pytest.approx(np.array(wanted, float), abs=1e-13)
    slope = [float((a - b) / (2 * h)) for a, b in zip(up, down, strict=True)]
    assert late.sensitivity(starts[:1], {"p": 1.0})[0] == pytest.approx(slope, abs=1e-9)
    many = np.random.default_rng(0).uniform(0, 2, (20, 2))
    assert late.first_return(many).image == pytest.approx(np.vstack([late.first_return([row]).image for row in many]), abs=1e-13)
    with pytest.raises(ProofError, match=message("exact.phase-not-enclosed", system="Late", phase=3.84159)):
        late.image_boxes([[[0.5, 0.51], [0.3, 0.31]]])


class Turning(HybridSystem):
    """x'' + x = f at its turning points, of either direction: x is reflected at f, half a turn later."""

    f: float = 0.3
    states = ("x", "v")

    def modes(self, t, y):
        return {"m": {"x": y.v, "v": self.f - y.x}}

    def guards(self, t, y):
        return {"U": Guard("m", y.v), "D": Guard("m", -y.v)}

    def section(self, t, y):
        return PoincareSection(("U", "D"), ("x",))


def test_turning_points_of_either_direction():
    returns = Turning().first_return([[1.0], [-0.5], [0.1]], derivative=True)
    assert returns.words.tolist() == ["UD", "DU", "DU"]
    assert returns.image.ravel() == pytest.approx([-0.4, 1.1, 0.5], abs=1e-15)
    assert returns.time == pytest.approx(np.full(3, np.pi), abs=1e-14)
    assert returns.derivative.ravel() == pytest.approx([-1, -1, -1], abs=1e-14)
    assert orbit(Turning(), [1.0], 5).words.tolist() == ["UD", "DU"] * 2 + ["UD"]
    boxes = Turning().image_boxes([[[0.9, 1.0]], [[-0.5, -0.4]]])
    assert boxes.bounded.all()
    assert boxes.images[boxes.source == 0].ravel() == pytest.approx([-0.4, -0.3], abs=1e-9)


class Tube(HybridSystem):
    """A ball between two ends of a tube at -1 and 1, slowed down by c, seen at both: which end follows from its velocity."""

    c: float = 0.2
    states = ("x", "v")

    def modes(self, t, y):
        return {"fly": {"x": y.v, "v": -self.c * y.v}}

    def guards(self, t, y):
        return {"R": Guard("fly", 1 - y.x, reset={"v": -y.v}), "L": Guard("fly", 1 + y.x, reset={"v": -y.v})}

    def section(self, t, y):
        return PoincareSection(("R", "L"), ("v",))


def test_ends_that_a_velocity_tells_apart():
    """From end to end v loses 2 c."""
    returns = Tube().first_return([[2.0], [-2.0]])
    assert returns.words.tolist() == ["RL", "LR"]
    assert returns.image.ravel() == pytest.approx([-1.6, 1.6], abs=1e-15)
    assert orbit(Tube(), [2.0], 4).outcome.tolist() == [0] * 4


class Ramp(HybridSystem):
    """x' = 1 and u' = -x u, seen just after a reset that takes x from 3 to 1 and adds a to u."""

    a: float = 0.25
    states = ("x", "u")

    def modes(self, t, y):
        return {"run": {"x": 1, "u": -y.u}}

    def reset(self, y):
        return {"x": y.x - 2, "u": y.u + self.a}

    def guards(self, t, y):
        return {"J": Guard("run", 3 - y.x, reset=self.reset(y))}

    def section(self, t, y):
        return PoincareSection("J", ("u",), side="after")


class Set(Ramp):
    def reset(self, y):
        return {"x": 1, "u": y.u + self.a}


class Turned(Ramp):
    """Both coordinates change places: x comes from u, which the guard says nothing about, and u from x = 3."""

    def reset(self, y):
        return {"x": y.u, "u": y.x - sp.Rational(5, 2)}

    def section(self, t, y):
        return PoincareSection("J", ("x",), side="after")


class Root(Ramp):
    def reset(self, y):
        return {"x": y.x - 2, "u": y.u / (1 + y.u**2) + self.a}


@pytest.mark.parametrize(
    ("system", "start", "image", "time"),
    [
        (Ramp, 0.5, 0.5 * np.exp(-2) + 0.25, 2),
        (Set, 0.5, 0.5 * np.exp(-2) + 0.25, 2),
        (Turned, 1.5, 0.5 * np.exp(-1.5), 1.5),
        (Root, 0.5, 0.5 * np.exp(-2) / (1 + 0.25 * np.exp(-4)) + 0.25, 2),
    ],
)
def test_just_after_a_reset_that_moves_the_place(system, start, image, time):
    returns = system().first_return([[start]])
    assert returns.image.ravel() == pytest.approx([image], abs=1e-14)
    assert returns.time == pytest.approx([time], abs=1e-14)


def stated(base, section, guards=None):
    """A class with another section, and other guards."""
    given = {"section": lambda self, t, y: section} | (
        {} if guards is None else {"guards": lambda self, t, y: guards(self, t, y)}
    )
    return type("Stated", (base,), given)


def ends(self, t, y):
    """Two ends that are met in the same direction."""
    return {"R": Guard("fly", 1 - y.x, reset={"x": 0}), "F": Guard("fly", 2 - y.x, reset={"x": 0})}


@pytest.mark.parametrize(
    ("system", "why"),
    [
        (stated(Tube, PoincareSection(("R", "F"), ("v",)), ends), message("exact.two-zeros", guard="R", other="F", name="x")),
        (
            stated(Tube, PoincareSection("R", ())),
            message("exact.no-coordinates", names="x, v", example="('x',)"),
        ),
        (stated(Tube, PoincareSection("R", ("v",), states={"x": 2})), message("exact.none-before", guard="R", value=-1.0)),
        (stated(Tube, PoincareSection("R", ("v",), states={"y": 2})), message("exact.section-state", name="y")),
        (
            stated(Tube, PoincareSection("R", ("x",), states={"v": 0, "x": 1})),
            message("exact.section-formula"),
        ),
        (
            stated(Ramp, PoincareSection("J", ("x",), side="after")),
            message("exact.section-open", name="u"),
        ),
        (stated(Late, PoincareSection("W", ("v",))), message("exact.phase-not-fixed", guard="W")),
        (
            stated(Late, PoincareSection("c", ("x", "v")), lambda self, t, y: {"c": Guard("m", sp.sin(2 * self.w * t))}),
            message("exact.clock", guard="c", number=2),
        ),
    ],
)
def test_sections_that_are_refused(system, why):
    with pytest.raises(SystemDefinitionError, match=why):
        system().first_return([[1.0, 1.0][: len(system().coordinates)]])


class Boost(HybridSystem):
    """A current that rises to 2, and falls at the rate b until the next whole time."""

    b: float = 0.6
    states = ("i",)

    def period(self):
        return 1

    def modes(self, t, y):
        return {"on": {"i": 1}, "off": {"i": -self.b}}

    def guards(self, t, y):
        clock = -sp.sin(2 * sp.pi * t)
        return {"F": Guard("on", 2 - y.i, to="off"), "N": Guard("off", clock, to="on"), "P": Guard("on", clock)}

    def section(self, t, y):
        return PoincareSection(("N", "P"), ("i",))


def test_guards_met_at_once_at_the_section_where_both_orders_have_one_image():
    """The limit is met at the clock: 2 whether the switch or the clock is first, as from either side."""
    returns = Boost().first_return([[1.0], [1 - 1e-9], [1 + 1e-9]])
    assert returns.counts() == {"returned": 3}
    assert returns.image.ravel() == pytest.approx([2, 2 - 1e-9, 2 - 0.6e-9], abs=1e-15)


class Cart(HybridSystem):
    """A cart that is pushed whenever a clock of 2 strikes, in either of two modes, with v = 0 watched; drag fades its speed."""

    push: float = 0.5
    states = ("x", "v", "c")

    def modes(self, t, y):
        return {"slow": {"x": y.v, "v": -y.v, "c": 1}, "fast": {"x": y.v, "v": -y.v, "c": 1}}

    def guards(self, t, y):
        return {
            "push": Guard(("slow", "fast"), 2 - y.c, reset={"v": y.v + self.push, "c": 0}, to="fast"),
            "slower": Guard("fast", y.v - 1, to="slow"),
            "start": Guard(("slow", "fast"), -y.x, letter="o"),
        }

    def section(self, t, y):
        return PoincareSection("push", ("x", "v"), side="after")


def test_just_after_an_event_of_several_modes_and_of_parts_of_them():
    """From x = -1/2 with v = 3: through x = 0, and slower than 1 after ln 3."""
    returns = Cart().first_return([[-0.5, 3.0], [1.0, 2.0]])
    fade = np.exp(-2)
    assert returns.words.tolist() == ["posp", "psp"]
    assert returns.image == pytest.approx(
        np.array([[-0.5 + 3 * (1 - fade), 3 * fade + 0.5], [1 + 2 * (1 - fade), 2 * fade + 0.5]]), abs=1e-14
    )


def test_turning_points_are_never_undecided():
    """v and -v are zero at once at every turning point; one of both is the section, or both are."""

    class Top(Turning):
        def section(self, t, y):
            return PoincareSection("U", ("x",))

    starts = np.linspace(0.31, 3, 50)[:, None]
    for system, images in ((Top(), starts), (Turning(), 0.6 - starts)):
        returns = system.first_return(starts)
        assert returns.certified.all()
        assert returns.image == pytest.approx(images, abs=1e-14)


class Weights(HybridSystem):
    """A ball that falls on a floor, light for the first half of a period and heavy for the second; sections at its impacts."""

    light: float = 0.7
    heavy: float = 1.6
    e: float = 0.6
    modes_in_order: tuple[str, str] = ("light", "heavy")
    states = ("z", "w")

    def period(self):
        return 2 * sp.pi

    def modes(self, t, y):
        weights = {"light": self.light, "heavy": self.heavy}
        return {mode: {"z": y.w, "w": -weights[mode]} for mode in self.modes_in_order}

    def guards(self, t, y):
        rebound = {"w": -self.e * y.w}
        return {
            "L": Guard("light", y.z, reset=rebound),
            "H": Guard("heavy", y.z, reset=rebound),
            "on": Guard("light", sp.sin(t), to="heavy", letter="s"),
            "off": Guard("heavy", -sp.sin(t), to="light", letter="s"),
        }

    def section(self, t, y):
        return PoincareSection(("L", "H"), ("w", "phi"))

    def follow(self, z, v, phi, word):
        """The speed and the time of the next impact, and its word, from parabola to parabola."""
        time = 0.0
        while True:
            half = int((phi + time) // np.pi) % 2
            weight, left = (self.light, self.heavy)[half], np.pi - (phi + time) % np.pi
            s = (v + np.sqrt(v * v + 2 * weight * z)) / weight
            if s <= left:
                return v - weight * s, time + s, word + "LH"[half]
            z, v, time, word = z + v * left - weight * left**2 / 2, v - weight * left, time + left, word + "s"
            time = round((phi + time) / np.pi) * np.pi - phi


@pytest.mark.parametrize("modes", [("light", "heavy"), ("heavy", "light")])
def test_the_phase_distinguishes_modes_with_one_surface(modes):
    """A clock may be below zero in its mode, and one mode is as near as the other: it begins in that of its half."""
    ball, rng = Weights(modes_in_order=modes), np.random.default_rng(7)
    rows = np.column_stack([rng.uniform(-3, -0.3, 60), rng.uniform(0, 2 * np.pi, 60)])
    rows = np.concatenate([rows, [[-1.0, 0.0]]])
    wanted = [ball.follow(0.0, -ball.e * w, phi, "LH"[int(phi // np.pi)]) for w, phi in rows.tolist()]
    returns = ball.first_return(rows)
    assert returns.words.tolist() == [word for _, _, word in wanted]
    assert returns.image[:, 0] == pytest.approx([w for w, _, _ in wanted], abs=1e-13)
    assert returns.time == pytest.approx([time for _, time, _ in wanted], abs=1e-13)
    above = np.column_stack([rng.uniform(0.1, 2, 60), rows[:60]])
    wanted = [ball.follow(*row, "") for row in above.tolist()]
    arrivals = ball.arrivals(above)
    assert arrivals.words.tolist() == [word for _, _, word in wanted]
    assert arrivals.image[:, 0] == pytest.approx([w for w, _, _ in wanted], abs=1e-13)


def test_images_of_boxes_are_those_of_the_mode_that_the_phase_gives():
    ball = Weights()
    for w, phi in ((-1.0, 0.4), (-1.0, 5.0), (-2.0, 2.5)):
        box = np.array([[[w, w + 1e-3], [phi, phi + 1e-3]]])
        corner, image = ball.first_return(box[:, :, 0]), ball.image_boxes(box)
        assert image.words.tolist() == corner.words.tolist()
        assert not image.empty.any()
        assert np.ptp(image.images[0, 0]) < 0.01
        assert (image.images[0, :, 0] <= corner.image[0] + 1e-12).all()
        assert (image.images[0, :, 1] >= corner.image[0] - 1e-12).all()


class Held(HybridSystem):
    """A block on a spring, pushed and held by friction; seen whenever it begins to slip to the right."""

    mu: float = 0.5
    side: str = "before"
    states = ("x", "v")

    def period(self):
        return 5 * sp.pi / 2

    def modes(self, t, y):
        force = 0.8 * sp.cos(0.8 * t) - y.x - 0.8 * y.v
        return {"right": {"x": y.v, "v": force - self.mu}, "left": {"x": y.v, "v": force + self.mu}}

    def guards(self, t, y):
        return {"hold": SlidingSurface("right", "left", y.v)}

    def section(self, t, y):
        return PoincareSection("hold to right", ("phi",), side=self.side)


def test_a_start_just_after_an_event_without_a_reset_is_one_where_the_event_takes_place():
    """The push on the block, which is at 0.8 cos(phi) - mu, grows where sin(phi) < 0; elsewhere it stays held."""
    phases = np.linspace(0.05, 6.25, 31)[:, None]
    before, after = (Held(side=side).first_return(phases) for side in ("before", "after"))
    assert ((after.outcome == Outcome.invalid) == (np.sin(phases[:, 0]) > 0)).all()
    assert (after.outcome == before.outcome).all()
    assert after.image == pytest.approx(before.image, abs=1e-13, nan_ok=True)
    rises = Held(side="after").reasons([[1.0]])[0]
    assert "'hold to right' has a function that rises" in rises
    boxes = Held(side="after").image_boxes([[[1.0, 1.01]], [[4.0, 4.01]]])
    assert boxes.empty.tolist() == [True, False]


class Spokes(HybridSystem):
    """A wheel of spokes, 2 a apart, that rolls down a slope, in any unit of angle; seen at a step with angle and speed."""

    unit: float = 1.0
    a: float = 0.39
    side: str = "before"
    slope, k, c = 0.08, 9.81, 0.71
    states = ("th", "w")

    def modes(self, t, y):
        return {"roll": {"th": y.w, "w": self.k * y.th}}

    def guards(self, t, y):
        a, turned = self.a * self.unit, self.slope * self.unit
        return {
            "F": Guard("roll", turned + a - y.th, reset={"th": y.th - 2 * a, "w": self.c * y.w}),
            "B": Guard("roll", y.th + a - turned, reset={"th": y.th + 2 * a, "w": self.c * y.w}),
        }

    def section(self, t, y):
        return PoincareSection("F", ("th", "w"), side=self.side)


@pytest.mark.parametrize("unit", [1.0, 180 / np.pi, 1e-7])
@pytest.mark.parametrize("side", ["before", "after"])
def test_of_coordinates_that_are_not_free_rows_off_the_surface_are_no_starts(unit, side):
    wheel = Spokes(unit=unit, side=side)
    at, from_ = 0.47 if side == "before" else -0.31, -0.31
    speed = 1.5 if side == "before" else 1.5 * wheel.c
    rows = unit * np.array([[at, speed], [0.2, speed], [at + 1e-4, speed], [-at, speed]])
    returns = wheel.first_return(rows)
    assert returns.outcome.tolist() == [Outcome.returned] + [Outcome.invalid] * 3
    fallen = np.sqrt((wheel.c * 1.5) ** 2 + wheel.k * (0.47**2 - from_**2))
    assert returns.image[0] / unit == pytest.approx([at, fallen if side == "before" else wheel.c * fallen], rel=1e-14)
    assert wheel.on_section(rows[:3]) / unit == pytest.approx(np.array([[at, speed]] * 3), rel=1e-14)
    assert f"w = {rows[1, 1]:.10g} is not on the section" in wheel.reasons(rows)[1]
    assert f"such as th = {unit * at:.10g}" in wheel.reasons(rows)[1]


@pytest.mark.parametrize("side", ["before", "after"])
def test_newton_steps_and_sweeps_stay_on_the_surface(side):
    """The steady roll has w**2 = gained/(1 - c**2) before a step, with the gain k (4 a slope) of w**2 from spoke to spoke."""
    wheel = Spokes(side=side)
    share = 1.0 if side == "before" else wheel.c

    def steady(a):
        return [0.08 + a if side == "before" else 0.08 - a, share * np.sqrt(wheel.k * 4 * a * 0.08 / (1 - wheel.c**2))]

    orbit = nsmaps.periodic_orbit(wheel, [0.3, 1.6])
    assert orbit.converged
    assert orbit.states[0] == pytest.approx(steady(0.39), rel=1e-13)
    branch = nsmaps.continue_branch(wheel, "a", orbit, 0.39, (0.35, 0.42))
    assert branch.values[-1] == pytest.approx(0.42)
    assert branch.points[:, 0] == pytest.approx(np.array([steady(a) for a in branch.values]), rel=1e-10)
    swept = nsmaps.bifurcation_diagram(wheel, "a", [0.35, 0.37, 0.39], [0.3, 1.6], n_returns=2, transient=60, direction="up")
    assert swept.states[:, 0, -1] == pytest.approx(np.array([steady(a) for a in (0.35, 0.37, 0.39)]), rel=1e-12)


class Carried(Held):
    """The block, with its place as a coordinate that the phase gives: a force that it takes begins it to slip."""

    def section(self, t, y):
        return PoincareSection("hold to right", ("x", "phi"), side=self.side)


def test_a_coordinate_that_passes_zero_on_the_surface():
    phases = np.append(np.linspace(3.3, 6.1, 20), 2 * np.pi - np.arccos(0.5 / 0.8))  # at the last x is zero
    rows = np.column_stack([0.8 * np.cos(phases) - 0.5, phases])
    rows[-1, 0] = 3e-17
    returns, free = Carried().first_return(rows), Held().first_return(phases[:, None])
    assert returns.outcome.tolist() == free.outcome.tolist()
    assert (returns.outcome[-1], abs(rows[-1, 0])) == (Outcome.returned, 3e-17)
    assert returns.image[:, 1] == pytest.approx(free.image[:, 0], abs=1e-13, nan_ok=True)
    assert (Carried().first_return(rows + np.array([1e-3, 0])).outcome == Outcome.invalid).all()


class EitherWall(RecoilPair):
    """The pair seen just before an impact with either wall, which the sign of the relative speed distinguishes."""

    def section(self, t, y):
        return PoincareSection(("B", "T"), ("v", "X", "V", "phi"))


class EitherPlace(RecoilPair):
    """The same, where the place distinguishes the walls."""

    def section(self, t, y):
        return PoincareSection(("B", "T"), ("x", "v", "X", "V", "phi"))


class EitherAfter(RecoilPair):
    """The same, just after the impacts."""

    def section(self, t, y):
        return PoincareSection(("B", "T"), ("x", "v", "X", "V", "phi"), side="after")


@pytest.mark.parametrize("kind", [EitherWall, EitherPlace, EitherAfter])
def test_a_section_at_two_walls_begins_at_the_one_on_which_a_start_lies(kind):
    """Every impact of the vibro-impact pair, on both walls, whose numbers those of a light ball are."""
    values = {"d": 0.35, "g_bar": 0.2113, "r": 0.5}
    impacts = VIPair(**values).impacts([0.83, 0.36], 12)
    pair, share = kind(eta=0, kappa=0, Lambda=0, **values), -0.5 if kind is EitherAfter else 1.0
    start = [share * 0.83, 0.19, -0.67, 0.36] if kind is EitherWall else [0.175, share * 0.83, 0.19, -0.67, 0.36]
    orbit = pair.orbits([start], 11)
    towards = np.where(impacts.wall == 0, 1, -1)[1:]
    assert set(impacts.wall.tolist()) == {0, 1}
    assert orbit.words.tolist() == ["BT" if wall else "TB" for wall in impacts.wall[1:]]
    assert orbit.image[:, -4] == pytest.approx(share * towards * impacts.speed[1:], abs=1e-11)
    assert orbit.image[:, -1] == pytest.approx(impacts.phase[1:], abs=1e-11)
    if kind is not EitherWall:
        assert orbit.image[:, 0] == pytest.approx(0.175 * towards, abs=1e-15)
        assert pair.first_return([[0.1, *start[1:]]]).outcome.tolist() == [Outcome.invalid]
        assert "is not on the section" in pair.reasons([[0.1, *start[1:]]])[0]
