"""User-defined maps: a class with `coordinates` and `first_return`, by a formula."""

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps import Angle, Returns, System
from nsmaps.dynamics.diagrams.windows import windows
from nsmaps.errors import NsmapsError, StateError, SystemDefinitionError
from nsmaps.exact import Along
from nsmaps.exact.batches import divided_returns
from nsmaps.exact.trajectory import track
from nsmaps.parallel import fingerprint


class Sine(System):
    """x -> a sin(pi x), with a derivative or without."""

    a: float = 0.6
    smooth: bool = True
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        slopes = (np.pi * self.a * np.cos(np.pi * states))[:, :, None] if derivative and self.smooth else None
        return Returns.of_map(self.coordinates, states, self.a * np.sin(np.pi * states), slopes)


class Rotor(System):
    """The circle map with a tongue of rotation number 0 up to tau = b / (2 pi)."""

    tau: float
    b: float = 0.4
    coordinates = (Angle("angle"),)

    def first_return(self, states, derivative=False):
        slopes = (1 - self.b * np.cos(states))[:, :, None]
        image = states + 2 * np.pi * self.tau - self.b * np.sin(states)
        return Returns.of_map(self.coordinates, states, image, slopes if derivative else None)


class Bare(System):
    """A map that returns an array."""

    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        return states / 2


def test_a_map_in_a_few_lines_is_a_return_map():
    returns = Rotor(tau=0.3).first_return([[6.0], [np.nan]], derivative=True)
    assert returns.turns.ravel().tolist() == [1, 0]
    assert returns.image[0, 0] == pytest.approx(6.0 + 0.6 * np.pi - 0.4 * np.sin(6.0) - 2 * np.pi, abs=1e-14)
    assert returns.counts() == {"returned": 1, "invalid": 1}
    assert nsmaps.bifurcation_diagram(Sine(), "a", [0.6, 0.8], [0.3]).labels.tolist() == [["period 1"], ["period 2"]]


class Lozi(System):
    """x -> 1 - a |x| + y, y -> b x, on the left and on the right of x = 0."""

    a: float = 1.0
    b: float = 0.3
    coordinates = ("x", "y")

    def first_return(self, states, derivative=False):
        assert np.isfinite(states).all()
        x, y = states.T
        image = np.stack([1 - self.a * np.abs(x) + y, self.b * x], axis=1)
        slopes = np.zeros((len(x), 2, 2))
        slopes[:, 0, 0], slopes[:, 0, 1], slopes[:, 1, 0] = -self.a * np.sign(x), 1, self.b
        return Returns.of_map(self.coordinates, states, image, slopes, np.where(x < 0, "L", "R").tolist(), ("L", "R"))


class Duck:
    """What looks like a return map, and does not inherit from one."""

    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        return Returns.of_map(self.coordinates, states, np.asarray(states) / 2)


def test_rows_without_a_state_do_not_reach_a_map():
    """The second row has the image of x = 0.5, y = 0.2 by hand; the others are invalid in all fields, derivatives too."""
    returns = Lozi().first_return([[np.nan, 0.0], [0.5, 0.2], [np.inf, 0.0]], derivative=True)
    assert returns.image[1] == pytest.approx([0.7, 0.15], abs=1e-15)
    assert returns.derivative[1].tolist() == [[-1, 1], [0.3, 0]]
    assert returns.words.tolist() == ["", "R", ""]
    assert returns.counts() == {"returned": 1, "invalid": 2}
    assert np.isnan(returns.derivative[[0, 2]]).all()
    assert np.isnan(returns.start[0, 0])
    assert len(Lozi().first_return(np.empty((0, 2)))) == 0
    with pytest.raises(StateError, match=message("errors.shape", what="states have", shape="(2,)")):
        Lozi().first_return([0.1, 0.2])


def test_a_batch_of_returns_is_that_of_single_ones():
    starts = np.random.default_rng(5).uniform(-1, 1, (5, 2))
    whole = Lozi().orbits(starts, 4, derivative=True)
    parts = divided_returns(Lozi(), starts, 4, True, parallel=nsmaps.Parallel(part=2))
    x = starts
    for k in range(4):
        x = np.column_stack([1 - np.abs(x[:, 0]) + x[:, 1], 0.3 * x[:, 0]])
        for found in (parts, whole):
            assert np.array_equal(found.image[5 * k : 5 * k + 5], x)
    assert np.array_equal(parts.derivative, whole.derivative)


def test_the_partition_of_a_map_in_two_pieces_is_this_map():
    axes = {name: nsmaps.Axis(low=low, high=high, points=41) for name, low, high in (("x", -1, 1.5), ("y", -0.5, 0.5))}
    found = nsmaps.partition(Lozi(), nsmaps.Grid(axes=axes), nsmaps.Partition(tolerance=1e-9))
    states = np.random.default_rng(1).uniform([-1, -0.5], [1.5, 0.5], (500, 2))
    states = states[np.abs(states[:, 0]) > 0.01]
    image = np.column_stack([1 - np.abs(states[:, 0]) + states[:, 1], 0.3 * states[:, 0]])
    assert {piece.word for piece in found.composite.pieces} == {"L", "R", ""}
    assert np.abs(found.composite.first_return(states).image - image).max() < 1e-12


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda return_map: nsmaps.reduced.strip_map(return_map, {"x": (0.1, 1), "y": (0, 1)}, 1e-6),
            message("exact.no-motion", what="a map of strips", map="Lozi"),
        ),
        (lambda return_map: track(return_map, [0.1, 0.1], 5), message("exact.no-motion", what="a trajectory", map="Lozi")),
        (lambda return_map: nsmaps.export(return_map, "c"), message("exports.by-program", map="Lozi", language="c")),
        (lambda return_map: nsmaps.export(return_map, "latex"), message("exports.by-program", map="Lozi", language="latex")),
        (nsmaps.dynamics.CompleteChatter, message("exact.no-motion", what="complete chatter", map="Lozi")),
    ],
)
def test_what_rests_on_a_motion_is_refused_with_the_reason(call, said):
    with pytest.raises(NsmapsError, match=said):
        call(Lozi())


@pytest.mark.parametrize(
    "call",
    [
        lambda return_map: nsmaps.observe(return_map, [0.1, 0.1], "impacts", n_returns=5),
        lambda return_map: nsmaps.parameter_plane(
            return_map, {"a": [0.5, 1.0], "b": [0.2, 0.4]}, [0.1, 0.1], observables=["impacts"]
        ),
        lambda return_map: nsmaps.optimize(return_map.at, "impacts", {"a": (0.5, 1)}, guess={"a": 0.6}, start=[0.1, 0.1]),
    ],
)
def test_observables_of_motions_are_none_of_a_map(call):
    with pytest.raises(NsmapsError, match=message("exact.observable", name="impacts", map="Lozi", known="x, y")):
        call(Lozi())


def test_noise_of_motions_is_none_of_a_map():
    with pytest.raises(NsmapsError, match=message("dynamics.no-motion-for-noise", tau=0.1, map="Lozi")):
        nsmaps.noisy_orbits(Lozi(), [0.1, 0.1], nsmaps.Noise(sigma=0.1, tau=0.1), n_returns=5)


@pytest.mark.parametrize(
    "call",
    [
        lambda return_map: nsmaps.orbit(return_map, [0.1], 5),
        lambda return_map: nsmaps.periodic_orbit(return_map, [0.1]),
        lambda return_map: nsmaps.lyapunov(return_map, starts=[0.1], n_returns=50),
        lambda return_map: nsmaps.bifurcation_diagram(lambda a: return_map, "a", [0.1, 0.2], [0.1]),
        lambda return_map: nsmaps.basins(return_map, nsmaps.Grid(axes={"x": nsmaps.Axis(low=0, high=1, points=5)})),
        lambda return_map: nsmaps.attracting_domain(return_map, [[0, 1]]),
        lambda return_map: nsmaps.dynamics.IteratedMap(return_map, 2),
    ],
)
def test_a_class_that_does_not_inherit_is_refused(call):
    with pytest.raises(NsmapsError, match=message("exact.of-no-system", map="Duck")):
        call(Duck())
    with pytest.raises(NsmapsError, match=message("exact.varied", map="Duck")):
        nsmaps.parameter_plane(Duck(), {"a": [0.1], "b": [0.2]}, [0.1])


def test_a_chart_needs_parameters():
    square = nsmaps.reduced.PolyMap.of_monomials(("x",), {"x": {(2,): 1.0}}, [[0, 1]])
    whole = nsmaps.CompositeMap(
        nsmaps.exact.Coordinates(("x",)), (), (nsmaps.reduced.Piece("R", nsmaps.Box.of(("x",), [[0, 1]]), square),)
    )
    with pytest.raises(NsmapsError, match=message("exact.varied", what="parameters", map="CompositeMap")):
        nsmaps.parameter_plane(whole, {"a": [0.5, 0.6], "b": [0.1, 0.2]}, [0.3])
    with pytest.raises(NsmapsError, match=message("exact.of-class", what="parameters", map="Lozi")):
        nsmaps.parameter_plane(Lozi, {"a": [0.5, 0.6], "b": [0.1, 0.2]}, [0.3, 0.1])
    with pytest.raises(NsmapsError, match=message("errors.no-such", kind="parameter", name="c")):
        nsmaps.parameter_plane(Lozi(), {"a": [0.5, 0.6], "c": [0.1, 0.2]}, [0.3, 0.1])
    with pytest.raises(NsmapsError, match=message("dynamics.plane", names="no parameter")):
        nsmaps.parameter_plane(Bare(), {}, [0.3])


def test_an_edited_map_is_another_one(tmp_path):
    """A checkpoint of one is not resumed with the other, although both have the same name and parameters."""
    texts = []
    for factor in (2, 3):
        body = f"        return Returns.of_map(self.coordinates, states, states / {factor})"
        head = "from nsmaps import Returns, System\nclass Line(System):\n    coordinates = ('x',)\n"
        (tmp_path / "line.py").write_text(f"{head}    def first_return(self, states, derivative=False):\n{body}\n")
        texts.append(fingerprint(nsmaps.load_system(f"{tmp_path / 'line.py'}:Line")))
    assert texts[0] != texts[1]
    assert fingerprint(Lozi()) == fingerprint(Lozi()) != fingerprint(Lozi(a=2.0))


def test_a_class_without_coordinates_is_refused():
    with pytest.raises(SystemDefinitionError, match=message("exact.no-names", cls="Nameless")):

        class Nameless(System):
            def first_return(self, states, derivative=False):
                return Returns.of_map(("x",), states, states)


def test_what_a_map_lacks_is_named():
    for call in (nsmaps.periodic_orbit, lambda return_map, state: nsmaps.lyapunov(return_map, starts=state, n_returns=100)):
        with pytest.raises(NsmapsError, match=message("exact.no-derivative")):
            call(Sine(smooth=False), [0.4])
    with pytest.raises(NsmapsError, match=message("exact.no-function-of-map", given="ndarray", map="Bare")):
        nsmaps.orbit(Bare(), [0.3], 3)
    with pytest.raises(StateError, match=message("exact.shapes")):
        Returns.of_map(("x",), [[0.1]], [0.1])


class Shifted(System):
    """x -> a x (1 - x) + b, whose period doublings at b = 0 lie at a = 3 and 1 + sqrt(6)."""

    a: float = 2.5
    b: float = 0.0
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        slopes = (self.a * (1 - 2 * states))[..., None] if derivative else None
        return Returns.of_map(self.coordinates, states, self.a * states * (1 - states) + self.b, slopes)


def test_a_map_with_parameters_has_a_chart():
    plane = nsmaps.parameter_plane(Shifted(), {"a": [2.5, 3.2, 3.5, 4.0], "b": [-0.05, 0.0]}, [0.3], n_returns=500, transient=500)
    assert [plane.motions[k].label for k in plane.motion[1, :, 0]] == ["period 1", "period 2", "period 4", "C"]
    assert plane.exponent[1, :2, 0] == pytest.approx([np.log(0.5), np.log(0.16) / 2], abs=1e-9)  # 2 - a; 4 + 2 a - a^2
    assert plane.exponent[1, 3, 0] == pytest.approx(np.log(2), abs=0.02)


@pytest.mark.parametrize(("count", "direction"), [pytest.param(33, "up", marks=pytest.mark.thorough), (36, "down")])
def test_the_windows_of_the_quadratic_map_end_at_its_doublings(count, direction):
    values = np.linspace(2.5, 3.52, count)
    made = nsmaps.bifurcation_diagram(Shifted(), "a", values, [0.3], transient=1000, direction=direction)
    one, two, *_ = windows(made, Along(Shifted(), "a"), np.array([0.3]), 1000, direction)
    for border, value, kind in (
        (one.high, 3.0, "period doubling"),
        (two.low, 3.0, "period halving"),
        (two.high, 1 + np.sqrt(6), "period doubling"),
    ):
        assert (border.kind, border.value) == (kind, pytest.approx(value, abs=border.precision + 1e-12))
        assert border.precision < 1e-8


def test_chaos_begins_where_doublings_accumulate():
    """At 3.569945671870944901842 (Feigenbaum), though long cycles and motion that is not resolved lie before the chaos."""
    made = nsmaps.bifurcation_diagram(Shifted(), "a", np.linspace(3.53, 3.61, 17), [0.3], transient=500, direction="down")
    *_, chaos = windows(made, Along(Shifted(), "a"), np.array([0.3]), 500, "down")
    assert (chaos.label, chaos.low.kind) == ("C", "accumulation of period doublings from period 4 on")
    assert abs(chaos.low.value - 3.569945671870945) <= chaos.low.precision <= 1e-5


def test_a_domain_names_its_map():
    assert nsmaps.attracting_domain(Sine(), [[0.1, 0.9]]).of == "map Sine"


@pytest.mark.parametrize(("count", "direction"), [(24, "up"), (41, "down")])
def test_the_windows_of_a_map_without_words(count, direction):
    """The sine map doubles where -1 is the derivative, a cos(pi x) pi = -1 with x = a sin(pi x): tan(pi x) = -pi x."""
    from scipy.optimize import brentq

    x = brentq(lambda x: np.tan(np.pi * x) + np.pi * x, 0.55, 0.9)
    doubling = x / np.sin(np.pi * x)
    map_of = Along(Sine(), "a")
    made = nsmaps.bifurcation_diagram(
        map_of, "p", np.linspace(0.65, 0.8, count), [0.3], n_returns=40, transient=300, direction=direction
    )
    first, second = windows(made, map_of, np.array([0.3]), 300, direction)
    for border, kind in ((first.high, "period doubling"), (second.low, "period halving")):
        assert (border.kind, abs(border.value - doubling) <= border.precision + 1e-14, border.precision < 1e-9) == (
            kind,
            True,
            True,
        )


@pytest.mark.thorough
def test_a_tongue_in_which_the_cycle_moves_far_between_two_values():
    map_of = Along(Rotor(tau=0.0), "tau")
    made = nsmaps.bifurcation_diagram(map_of, "p", np.linspace(0.0, 0.11, 12), [0.1], n_returns=40, transient=300, direction="up")
    tongue = windows(made, map_of, np.array([0.1]), 300, "up")[0]
    assert (tongue.high.kind, tongue.high.precision < 1e-9) == ("fold", True)
    assert abs(tongue.high.value - 0.4 / (2 * np.pi)) <= tongue.high.precision + 1e-15


class Tent(System):
    """x -> s min(x, 1 - x)."""

    s: float = 1.5
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        slopes = np.where(states < 0.5, self.s, -self.s)[:, :, None] if derivative else None
        return Returns.of_map(self.coordinates, states, self.s * np.minimum(states, 1 - states), slopes)


class Cubic(System):
    """x -> a x - x^3, with a pitchfork at a = 1."""

    a: float = 1.2
    coordinates = ("x",)

    def first_return(self, states, derivative=False):
        slopes = (self.a - 3 * states**2)[:, :, None] if derivative else None
        return Returns.of_map(self.coordinates, states, self.a * states - states**3, slopes)


@pytest.mark.thorough
def test_an_orbit_does_not_stay_on_an_unstable_cycle():
    """The tent map: 0 attracts up to s = 1; beyond there is chaos, which rounding ends at s = 2, where it leads to 0."""
    values = np.linspace(0.55, 2.0, 15)
    made = nsmaps.bifurcation_diagram(Tent(), "s", values, [0.3], n_returns=40, transient=200, direction="up")
    labels = made.labels[:, 0]
    assert set(labels[values < 0.99]) == {"period 1"}
    assert set(labels[(values > 1.01) & (values < 1.99)]) == {"C"}
    assert labels[-1] == "unresolved"
    made = nsmaps.bifurcation_diagram(Tent(), "s", values[:11], [0.3], n_returns=40, transient=200, direction="up")
    zero, chaos, *_ = windows(made, Along(Tent(), "s"), np.array([0.3]), 200, "up")
    for border in (zero.high, chaos.low):
        assert abs(border.value - 1) <= border.precision


def test_both_halves_of_a_pitchfork_are_found_from_the_middle():
    values = np.array([0.5, 0.9, 1.2, 1.5])
    made = nsmaps.bifurcation_diagram(Cubic(), "a", values, [0.0], n_returns=10, transient=1000, direction="up")
    assert np.abs(made.states[:, 0, -1, 0]) == pytest.approx(np.sqrt(np.maximum(values - 1, 0)), abs=1e-9)
    assert set(made.labels[:, 0]) == {"period 1"}
