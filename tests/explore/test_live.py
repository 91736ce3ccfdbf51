"""Live exploration: scenes of studies, their pictures as arrays, and what a page does with them, without a browser."""

from dataclasses import replace

import numpy as np
import pytest
from messages import message

import nsmaps
from nsmaps.explore.live import pictures
from nsmaps.explore.live.scene import scene_of, span, study_of
from nsmaps.study.store.archive import resolved

FORM = """
from nsmaps import PiecewiseMap

class Form(PiecewiseMap):
    a: float
    c: float = -1.2
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"L": (x.x <= 0, {"x": self.a * x.x + x.y + 1, "y": -0.3 * x.x}),
                "R": (True, {"x": self.c * x.x + x.y + 1, "y": -0.4 * x.x})}
"""
STUDIES = ("vi_pair/bifurcation", "bouncing_ball/auto", "recoil_pair/diagram", "soft_impact/domain", "belt/diagram")


@pytest.fixture(scope="module", params=STUDIES)
def scene(request):
    return scene_of(nsmaps.load_study(request.param))


def test_a_scene_is_that_of_its_study():
    study = nsmaps.load_study("vi_pair/bifurcation")
    scene = scene_of(study)
    assert (scene.parameter, scene.values) == ("d", (0.26, 0.35))
    assert scene.plane == {"v": (0.0033, 1.0), "phi": (0.0, np.pi)}
    assert scene.system == study.system_object()
    np.testing.assert_array_equal(scene.start, [0.83, 0.36])


def test_axes_without_a_study_s_own_hold_the_attractors(scene):
    found = pictures.diagram(scene, 50, 80)
    k = list(scene.coordinates).index(scene.coordinate)
    heights = found.states.states[:, 0, :, k]
    assert found.counts.sum() == (np.isfinite(heights)).sum()


def test_a_diagram_counts_the_states_of_each_cell(scene):
    found = pictures.diagram(scene, 23, 40)
    (low, high), (bottom, top) = scene.values, scene.heights
    edges = np.linspace(low, high, 24)
    assert np.all((edges[:-1] < found.states.values) & (found.states.values < edges[1:]))
    k = list(scene.coordinates).index(scene.coordinate)
    for column, states in enumerate(found.states.states[:, 0, :, k]):
        expected = np.histogram(states[np.isfinite(states)], np.linspace(bottom, top, 41))[0]
        assert np.abs(np.cumsum(found.counts[:, column]) - np.cumsum(expected)).max() <= 1  # on an edge to the last digit
    shade = found.shade
    assert np.isnan(shade[found.counts == 0]).all()
    assert np.nanmax(shade) == 1


def test_a_diagram_is_followed_up_or_down():
    """Of two coexisting attractors each way shows the one that it came from."""
    scene = scene_of(nsmaps.load_study("vi_pair/bistable"))
    ways = {way: pictures.diagram(scene, 24, 40, direction=way) for way in (None, "up", "down")}
    for way, shown in ways.items():
        how = {"n_returns": pictures.RETURNS, "transient": pictures.DISCARDED, "direction": way}
        found = nsmaps.bifurcation_diagram(scene.system, "d", shown.states.values, scene.start, **how)
        np.testing.assert_array_equal(shown.states.states, found.states)
    assert not np.array_equal(ways["up"].counts, ways["down"].counts)


def test_a_plane_has_the_word_of_each_cell_s_middle(scene):
    found = pictures.words(scene, 24)
    (x0, x1), (y0, y1) = scene.plane.values()
    rng = np.random.default_rng(1)
    for row, column in rng.integers(0, 24, (40, 2)):
        there = scene.placed(x0 + (column + 0.5) * (x1 - x0) / 24, y0 + (row + 0.5) * (y1 - y0) / 24)
        returns = scene.system.first_return(there.start[np.newaxis])
        word = returns.words[0] or nsmaps.Outcome(int(returns.outcome[0])).name
        assert found.names[found.areas[row, column]] == word


def test_a_scene_saved_is_a_study_that_runs(tmp_path):
    scene = scene_of(nsmaps.load_study("vi_pair/bifurcation")).at(d=0.3).placed(0.5, 0.7)
    path = tmp_path / "mine.yaml"
    path.write_text(resolved(study_of(scene, "mine", "down")))
    study = nsmaps.load_study(path)
    assert (study.system_object().d, study.bifurcation_diagram.direction) == (0.3, "down")
    assert study.title == "vi_pair at d = 0.3, r = 0.5, g_bar = 0.211328, explored by hand"
    again = scene_of(study)
    assert (again.parameter, again.values, again.plane) == (scene.parameter, scene.values, scene.plane)
    np.testing.assert_array_equal(again.start, scene.start)


def test_a_point_of_a_diagram_is_a_state_of_its_attractor():
    scene = scene_of(nsmaps.load_study("vi_pair/bifurcation"))
    shown = pictures.diagram(scene, 40, 50)
    value = shown.states.values[7]
    upper, lower = (pictures.nearest(shown, scene, value, height) for height in (0.82, 0.68))
    assert upper[0] > 0.76 > lower[0]
    image = scene.system.at(d=float(value)).first_return(lower[np.newaxis]).image[0]
    assert np.abs(image[0] - 0.78) < 0.03


def test_cycles_are_those_of_the_map():
    scene = scene_of(nsmaps.load_study("vi_pair/bifurcation")).at(d=0.3)
    found = pictures.cycles(scene)
    assert {len(one.states) for one in found} >= {1, 2}
    marks = pictures.by_stability(found, 2)
    assert len(marks["stable"]) == 2
    for one in found:
        np.testing.assert_allclose(scene.system.first_return(one.states).image, np.roll(one.states, -1, axis=0), atol=1e-9)
        assert one.label in pictures.cycle_text(one)


def test_the_motion_of_a_scene_is_that_of_its_system(scene):
    found = pictures.followed(scene)
    assert found.ends is not None
    assert found.ends.text in found.text
    assert found.time is not None
    assert all(curve.shape == found.time.shape for curve in found.curves.values())


def test_basins_are_named_by_their_attractors():
    scene = scene_of(nsmaps.load_study("gear_rattle/basins"))
    found = pictures.reached(scene, 20)
    assert len(found.names) > 1
    assert found.areas.max() == len(found.names) - 1


def test_basins_do_not_contradict_what_an_orbit_ends_on(monkeypatch):
    """States that reach nothing in the first returns are followed further: here beside a doubling, after few returns."""
    monkeypatch.setattr(pictures, "RETURNS", 20)
    scene = scene_of(nsmaps.load_study("vi_pair/bifurcation")).at(d=0.277)
    assert (nsmaps.basins(scene.system, scene.grid(10), max_returns=20).label < 0).any()
    assert pictures.reached(scene, 10).names == ("1:1/2T (1)",)
    monkeypatch.setattr(pictures, "RETURNS", 300)
    assert pictures.followed(scene).ends.text.startswith("stable cycle of 2 returns, 1:1/2T")


def test_a_picture_is_given_up_from_its_progress():
    scene = scene_of(nsmaps.load_study("vi_pair/bifurcation"))

    class StopError(Exception):
        pass

    def stop(fraction):
        raise StopError

    with pytest.raises(StopError):
        pictures.diagram(scene, 50, 50, stop)


def test_sliders_stay_within_the_bounds_of_a_system():
    for name in STUDIES:
        system = nsmaps.load_study(name).system_object()
        for parameter, value in system.parameters.items():
            low, high = span(system, parameter)
            assert low < value < high or value in (low, high)
            for end in (low, high):
                system.at(**{parameter: end})


def test_a_slider_made_longer_by_a_typed_value_is_as_before_after_back(scene, tmp_path, monkeypatch):
    app_of = pytest.importorskip("nsmaps.explore.live.app").App
    monkeypatch.setattr(app_of, "_refresh", lambda app, *keys: None)
    app, name = app_of(scene, tmp_path), next(iter(scene.system.parameters))
    slider = app.page.sliders[name]
    before = slider.start, slider.end, slider.value
    typed = slider.end + 1.0
    app.page.entries[name].value = typed
    assert (slider.end, slider.value) == (typed, typed)
    app._back()
    assert (slider.start, slider.end, slider.value) == before


def test_what_cannot_be_explored_is_refused(tmp_path):
    path = tmp_path / "one.py"
    path.write_text(ONE)
    (tmp_path / "one.yaml").write_text("system: one.py:Ticks\nparameters: {}\n")
    with pytest.raises(nsmaps.NsmapsError, match=message("explore.live")):
        scene_of(nsmaps.load_study(tmp_path / "one.yaml"))


ONE = '''
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall


class Ticks(ImpactSystem):
    """A ball without parameters."""

    def walls(self):
        return {"B": Wall(at=0, side=-1)}

    def period(self):
        from sympy import pi

        return 2 * pi

    def rebound(self, speed, wall):
        return speed / 2

    def displacement(self, t, hit):
        from sympy import cos, sin

        s = t - hit.t
        return hit.z + (hit.w + cos(hit.t)) * s - s**2 / 2 - (sin(t) - sin(hit.t))
'''


def test_a_map_by_formula_is_explored_from_its_file(tmp_path, monkeypatch):
    """A system alone with parameters set; the fixed point on the right is 1/2.6, -0.4/2.6."""
    from nsmaps.cli.exploring import _study

    (tmp_path / "form.py").write_text(FORM)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(nsmaps.NsmapsError, match=message("parameters.missing", name="a")):
        _study("form.py:Form", [], False)
    scene = scene_of(_study("form.py:Form", ["a=0.9"], False))
    assert list(scene.plane) == ["x", "y"]
    found = pictures.followed(scene)
    assert (found.time[-1], list(found.curves)) == (60.0, ["x", "y"])
    np.testing.assert_array_equal(found.curves["y"], found.orbit.states[:61, 1])
    assert "R" in found.text
    scene = replace(scene, plane={"x": (-1.0, 1.0), "y": (-1.0, 1.0)})
    shown = pictures.words(scene, 10)
    assert (shown.kind, set(shown.names)) == ("First returns by word", {"L", "R"})
    assert pictures.diagram(scene, 20, 20).counts.sum() > 0
    fixed = [one for one in pictures.cycles(scene) if one.period == 1]
    assert min(np.abs(one.states[0] - [1 / 2.6, -0.4 / 2.6]).max() for one in fixed) < 1e-12
    path = tmp_path / "mine.yaml"
    path.write_text(resolved(study_of(scene, "mine")))
    assert nsmaps.load_study(path).system_object() == scene.system
