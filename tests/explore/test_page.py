"""The offline page of a run: written from its result, and used in a browser without a network."""

import base64
import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest
from messages import message
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.errors import NsmapsError
from nsmaps.explore.page.data import data_of
from nsmaps.explore.page.plots import plots_of
from nsmaps.explore.page.write import write_page

pytest.importorskip("plotly", reason="the package plotly is not installed")
DOUBLINGS = ["0.26833282", "0.27649856", "0.32418854"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "explore"
    for command in (["run", "vi_pair/explore", "--out", str(folder), "--no-figures"], ["explore", str(folder)]):
        assert CliRunner().invoke(app, [*command, "--quiet"]).exit_code == 0
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return nsmaps.read_result(folder)


AGAIN = """() => {
    document.activeElement.blur()
    clearTimeout(refined)
    Object.assign(state, {value: DATA.parameters[moved.name], start: [...DATA.start]})
    flown = false
    Object.entries({image: "0", sheets: "both", value: state.value}).forEach(([id, value]) => { byId(id).value = value })
    diagram.choose(0)
    diagram.show(diagram.whole())
    diagram.earlier = []
    draw(FINE, true)
}"""


@pytest.fixture(scope="module")
def once(new_page, folder):
    """The page, opened once."""
    page = new_page()
    page.goto((folder / "explore.html").as_uri())
    page.locator("#motion-name[data-period]").wait_for()
    page.begun = page.evaluate("() => ({read: 'Plotly' in window, due: !!due, shown: byId('surfaces').children.length})")
    yield page
    page.context.close()


@pytest.fixture
def opened(once):
    """The page as it was when it was opened."""
    once.set_viewport_size({"width": 1280, "height": 900})
    once.emulate_media(color_scheme="light")
    once.evaluate("scrollTo(0, 0)")
    once.evaluate(AGAIN)
    yield once
    assert once.problems == []


def show_surfaces(page):
    """Bring the surfaces into sight, and wait until they are drawn: low, as a processor alone fills their pixels."""
    page.evaluate("() => { document.getElementById('surfaces').style.height = '12rem' }")
    page.locator("#surfaces").scroll_into_view_if_needed()
    page.locator("#surfaces canvas").first.wait_for()
    page.wait_for_function("() => !due && document.getElementById('surfaces').listens")


def as_text(page, function):
    """What a function of the page gives: many numbers come sooner as one text, in which those that are not finite are null."""
    return json.loads(page.evaluate(f"() => JSON.stringify(({function})())"))


def test_the_report_has_a_link_to_the_page(folder):
    assert 'href="explore.html"' in (folder / "report.html").read_text()
    assert (folder / "explore.html").stat().st_size < 5e6


def test_orbits_of_the_page_are_those_of_the_map(opened, result):
    moved = result.parametric_map
    rng = np.random.default_rng(3)
    values, starts = rng.uniform(moved.low, moved.high, 12), rng.uniform([0.05, 0.05], [0.95, 3.0], (12, 2))
    compared, each = 0, list(zip(values.tolist(), starts.tolist(), strict=True))
    followed = opened.evaluate(
        "all => all.map(([value, start]) => { set(value); begin(start); return {states: orbit(12).states, value: state.value} })",
        each,
    )
    for (value, start), found in zip(each, followed, strict=True):
        assert found["value"] == value
        own = nsmaps.orbit(moved.at(value), start, 12).states
        states = np.array(found["states"])
        growth = np.cumprod(
            [1, *(1 + np.abs(moved.at(value).first_return(own[:-1], derivative=True).derivative).sum(axis=(1, 2)))]
        )
        gap = np.abs(states - own[: len(states)])
        gap[:, 1] = np.minimum(gap[:, 1], 2 * np.pi - gap[:, 1])
        assert (gap.max(axis=1) <= 1e-14 * growth[: len(states)] + 1e-12).all()
        compared += len(states)
    assert compared > 60


@pytest.mark.parametrize(("value", "period"), [(0.35, 1), (0.30, 2), (0.27, 4)])
def test_the_period_is_that_of_the_cascade(opened, value, period):
    opened.evaluate("value => set(value)", value)
    opened.locator(f"#motion-name[data-period='{period}']").wait_for()


def test_a_rectangle_dragged_on_the_diagram_lists_the_events_in_it(opened):
    box = opened.locator("#diagram").bounding_box()
    for doubling in DOUBLINGS:
        assert doubling in opened.inner_text("#events")

    def across(value):
        return box["x"] + opened.evaluate("value => diagram.frame.at(value, 0)[0]", value)

    opened.mouse.move(across(0.266), box["y"] + 20)
    opened.mouse.down()
    opened.mouse.move(across(0.277), box["y"] + 220, steps=5)
    opened.mouse.up()
    shown = opened.evaluate("() => diagram.frame.x")
    np.testing.assert_allclose(shown, [0.266, 0.277], atol=2e-4)
    assert "0.27649856" in opened.inner_text("#events")
    assert "0.32418854" not in opened.inner_text("#events")
    opened.locator("#diagram").dblclick()
    assert "0.32418854" in opened.inner_text("#events")


def test_a_rectangle_without_height_enlarges_the_parameter_alone(opened):
    """And a button that is released over the diagram, but was pressed elsewhere, does nothing."""
    box, (before, heights) = (
        opened.locator("#diagram").bounding_box(),
        opened.evaluate("() => [diagram.frame.x, diagram.frame.y]"),
    )
    left, top = box["x"] + 100, box["y"] + 100
    opened.locator("#about").hover()
    opened.mouse.down()
    opened.mouse.move(left, top, steps=3)
    opened.mouse.up()
    assert opened.evaluate("() => diagram.frame.x") == before
    opened.mouse.down()
    opened.mouse.move(left + 200, top, steps=3)
    opened.mouse.up()
    low, high = opened.evaluate("() => diagram.frame.x")
    assert before[0] < low < high < before[1]
    assert opened.evaluate("() => diagram.frame.y") == heights


def test_a_click_on_the_diagram_sets_the_parameter_and_keys_move_it(opened):
    box = opened.locator("#diagram").bounding_box()
    opened.mouse.click(box["x"] + opened.evaluate("() => diagram.frame.at(0.3, 0)[0]"), box["y"] + 50)
    before = opened.evaluate("() => state.value")
    assert abs(before - 0.3) < 2e-4
    opened.locator("#diagram").focus()
    opened.keyboard.press("ArrowRight")
    assert opened.evaluate("() => state.value") > before
    opened.locator("#value").focus()
    opened.keyboard.press("ArrowLeft")
    assert opened.evaluate("() => document.activeElement.matches(':focus-visible')")
    opened.locator("#plane").focus()
    start = opened.evaluate("() => [...state.start]")
    opened.keyboard.press("ArrowUp")
    assert opened.evaluate("() => state.start[1]") > start[1]


def test_a_click_on_the_plane_starts_there(opened):
    x, y = opened.evaluate("() => plane.at(0.5, 2)")
    opened.locator("#plane").click(position={"x": x, "y": y})
    np.testing.assert_allclose(opened.evaluate("() => state.start"), [0.5, 2], atol=0.02)
    opened.locator("#plane").click(position={"x": 3, "y": y})  # in the margin
    np.testing.assert_allclose(opened.evaluate("() => state.start"), [0.5, 2], atol=0.02)


def test_exact_flights_are_those_of_the_system(opened, result):
    opened.evaluate("() => set(0.35)")
    opened.get_by_text("The exact flight on the attractor at d = 0.35").wait_for()
    motion = opened.evaluate("() => motion.now")
    assert "".join(motion["letters"]).startswith("BTBTB")
    pair = result.system.at(d=motion["value"])
    impacts = pair.impacts(nsmaps.orbit(pair, result.orbits[0].start, 400).final, 13)
    np.testing.assert_allclose(motion["at"], impacts.time, rtol=1e-6)
    opened.locator("#word .met").nth(3).wait_for()


def test_surfaces_of_both_maps_name_word_piece_and_image(opened):
    show_surfaces(opened)
    shown = "() => document.getElementById('surfaces').data.map(each => [each.type, each.name])"
    exact, composite = [["mesh3d", "BB"], ["mesh3d", "BTB"]], [["mesh3d", "composite map, by piece"]]
    assert opened.evaluate(shown) == exact + composite
    texts = opened.evaluate("() => document.getElementById('surfaces').data.map(each => each.text.find(text => text))")
    assert re.search(r"v = .*φ = .*BTB: v′ = .*φ′ = ", texts[1])
    assert re.search(r"v = .*φ = .*R\d: v′ = .*φ′ = ", texts[2])
    for choice, sheets in (("exact", exact), ("composite", composite)):
        opened.select_option("#sheets", choice)
        assert opened.evaluate(shown) == sheets


def test_surfaces_are_drawn_when_they_come_into_sight(opened):
    assert opened.begun == {"read": False, "due": True, "shown": 0}
    show_surfaces(opened)
    assert opened.evaluate("() => 'Plotly' in window")


def test_no_triangle_of_the_composite_map_joins_two_pieces(opened, result):
    """And each has the images of the map of Python at the value of the slider."""
    show_surfaces(opened)
    opened.select_option("#sheets", "composite")
    opened.select_option("#image", "1")
    found = as_text(
        opened,
        """() => {
        const rows = sampled(FINE), sheet = document.getElementById("surfaces").data[0]
        return {rows, corners: [sheet.i, sheet.j, sheet.k].map(each => [...each]), z: [...sheet.z], value: state.value}}""",
    )
    rows, corners = np.array(found["rows"], float), np.array(found["corners"])
    assert corners.shape[1] > 10_000
    pieces, images = rows[corners, 4], rows[corners, 3]
    assert (pieces == pieces[0]).all()
    assert (pieces >= 0).all()
    assert (np.ptp(images, axis=0) < np.pi).all()
    own = result.parametric_map.at(found["value"]).first_return(rows[:, :2])
    np.testing.assert_allclose(np.array(found["z"], float)[own.valid], own.image[own.valid, 1], atol=1e-9)


def drag(page, x, y):
    """Drag a rectangle on the diagram."""
    box = page.locator("#diagram").bounding_box()
    corners = page.evaluate("([x, y]) => [0, 1].map(k => diagram.frame.at(x[k], y[k]))", [x, y])
    page.mouse.move(box["x"] + corners[0][0], box["y"] + corners[0][1])
    page.mouse.down()
    page.mouse.move(box["x"] + corners[1][0], box["y"] + corners[1][1], steps=3)
    page.mouse.up()


def test_a_rectangle_is_computed_anew_by_both_maps(opened, result):
    """States deep in the diagram are those of the maps of Python, and more than the run has there."""
    opened.set_viewport_size({"width": 390, "height": 900})
    opened.wait_for_function("() => diagram.points('composite')?.done")
    for x, y in (((0.2615, 0.2655), (0.76, 0.80)), ((0.2630, 0.2632), (0.771, 0.780)), ((0.26310, 0.26311), (0.7745, 0.7765))):
        drag(opened, x, y)
        opened.wait_for_function("() => diagram.view.points.exact?.values.length > 100")
    opened.wait_for_function("() => diagram.chosen().every(of => diagram.view.points[of]?.done)")
    compared = 0
    for of, at in (("exact", lambda value: result.system.at(d=value)), ("composite", result.parametric_map.at)):
        points = as_text(opened, f"() => diagram.view.points.{of}")
        stored = as_text(opened, f"() => diagram.stored.{of} || {{values: []}}")
        assert len(points["values"]) > 10 * sum(0.26310 < value < 0.26311 for value in stored["values"])
        values, states = np.array(points["values"]), np.array(points["states"]).T
        chosen = np.unique(np.linspace(0, len(values) - 1, 30).astype(int)) if len(values) else []
        for k in chosen:
            steps = "([of, value, state]) => diagram.maps[of].at(value)(state)[0]"
            image = opened.evaluate(steps, [of, values[k], states[k].tolist()])
            np.testing.assert_allclose(image, at(values[k]).first_return(states[k : k + 1]).image[0], atol=1e-12, rtol=0)
            compared += 1
    assert compared >= 30
    assert "computed in this page" in opened.inner_text("#maps")
    for expected in (0.2630, 0.2615, 0.26):
        opened.get_by_role("button", name="Back").click()
        assert opened.evaluate("() => diagram.frame.x[0]") == pytest.approx(expected, abs=2e-4)


def test_orbits_of_the_exact_map_are_those_of_python(opened, result):
    """For 200 returns, as these end on a stable cycle: bit by bit."""
    follow = "([value, state]) => Array.from({length: 200}, () => state = nsmaps_exact.at(value).image_of(state)[0])"
    for value in (0.35, 0.3, 0.2712345):
        own = nsmaps.orbit(result.system.at(d=value), [0.83, 0.36], 200).states[1:]
        np.testing.assert_array_equal(opened.evaluate(follow, [value, [0.83, 0.36]]), own)


def test_the_wheel_enlarges_about_the_pointer_and_any_coordinate_is_drawn(opened):
    before = opened.evaluate("() => diagram.frame.x")
    box = opened.locator("#diagram").bounding_box()
    at = opened.evaluate("() => diagram.frame.at(0.3, diagram.frame.y[0])")
    opened.mouse.move(box["x"] + at[0], box["y"] + 100)
    opened.mouse.wheel(0, -100)
    opened.wait_for_function("low => diagram.frame.x[0] > low", arg=before[0])
    low, high = opened.evaluate("() => diagram.frame.x")
    assert (high - low) / (before[1] - before[0]) == pytest.approx(0.8)
    assert (0.3 - low) / (high - low) == pytest.approx((0.3 - before[0]) / (before[1] - before[0]), abs=0.01)
    opened.select_option("#coordinate", "1")
    states = opened.evaluate("() => diagram.stored.exact.states[1]")
    bottom, top = opened.evaluate("() => diagram.frame.y")
    assert bottom < min(states) < max(states) < top
    assert opened.evaluate("() => diagram.frame.names") == ["d", "φ"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_follows_the_colours_of_the_browser(opened, scheme):
    opened.emulate_media(color_scheme=scheme)
    show_surfaces(opened)
    opened.wait_for_function(
        "scheme => (document.getElementById('surfaces').layout.font.color === '#e4e6e9') === (scheme === 'dark')", arg=scheme
    )
    luminance = "() => getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3).map(Number)"
    assert (max(opened.evaluate(luminance)) < 60) == (scheme == "dark")


def test_a_point_of_a_surface_shows_its_exact_flight(opened, result):
    show_surfaces(opened)
    opened.evaluate("() => document.getElementById('surfaces').emit('plotly_click', {points: [{x: 0.5, y: 1.5}]})")
    opened.get_by_text("The exact flight from v = 0.5").wait_for()
    flight = opened.evaluate("() => motion.now")
    impacts = result.system.impacts(flight["state"], 4)
    np.testing.assert_allclose(flight["state"], [0.5, 1.5], atol=0.1)
    np.testing.assert_allclose(flight["at"], impacts.time, rtol=1e-6)
    assert flight["letters"] == [impacts.walls[k] for k in impacts.wall]
    opened.evaluate("() => set(0.31)")
    opened.get_by_text("The exact flight on the attractor").wait_for()


def test_a_narrow_page_has_no_overflow(opened):
    show_surfaces(opened)
    opened.set_viewport_size({"width": 390, "height": 800})
    opened.wait_for_function("() => innerWidth === 390 && document.documentElement.scrollWidth <= 390")  # laid out anew


def test_data_are_plain_and_finite(folder):
    letters = re.search('id="data">(.*)</script>', (folder / "explore.html").read_text())[1]
    text = gzip.decompress(base64.b64decode(letters)).decode()
    data = json.loads(text.removeprefix("const DATA = "), parse_constant=pytest.fail)
    kinds = [event["kind"] for event in data["sweep"]["events"]]
    assert kinds == ["period doubling"] * len(kinds)
    assert data["parameter"] == {"name": "d", "label": "d", "low": 0.26, "high": 0.35}


OTHER = """\
system: bouncing_ball
parameters: {Gamma: 1.2}
grid:
  v: {from: 1, to: 5, points: 60}
  phi: {from: 0, to: 6.2, points: 60}
families: {BB: [BB]}
composite:
  - {name: "<b>all</b> <!-- <script>", box: {v: [1, 5], phi: [0, 6.2]}, family: BB, fit: {full: {v: 4, phi: 4}}}
orbits: [{start: {v: 4, phi: 0.5}, n_returns: 20}]
"""


def test_a_run_of_another_system_without_a_parameter_to_move(page, tmp_path):
    from nsmaps.explore.page.write import write_page

    (tmp_path / "ball.yaml").write_text(OTHER)
    page.goto(write_page(nsmaps.run_study(tmp_path / "ball.yaml"), tmp_path).as_uri())
    page.locator("#motion-name[data-period]").wait_for()
    assert not page.locator("#control").is_visible()
    assert not page.locator("#diagram-part").is_visible()
    assert page.evaluate("() => DATA.motion[0].walls") == ["B"]
    show_surfaces(page)
    assert "<b>all</b> <!-- <script>" in page.inner_text("#legend")
    assert page.problems == []


def test_a_run_without_anything_to_draw_is_refused(tmp_path):
    (tmp_path / "bare.yaml").write_text("system: bouncing_ball\nparameters: {Gamma: 1.2}\n")
    with pytest.raises(NsmapsError, match=message("explore.nothing")):
        write_page(nsmaps.run_study(tmp_path / "bare.yaml"), tmp_path)


STORED = Path(__file__).parents[1] / "data" / "run-format-4"


def test_the_pictures_of_a_run_have_its_numbers():
    diagram = nsmaps.read_result(STORED / "windows")
    (points,) = plots_of(diagram)[0]["data"]
    exact = diagram.bifurcation_diagram["exact"]
    assert points["x"] == pytest.approx(np.repeat(exact.values, exact.states.shape[2]), rel=1e-6)
    assert points["y"] == pytest.approx(exact.states[:, 0, :, 0].ravel(), rel=1e-6)
    assert points["text"] == np.repeat(exact.labels[:, 0], exact.states.shape[2]).tolist()
    plane = nsmaps.read_result(STORED / "plane")
    named = {plot["title"]: plot["data"] for plot in plots_of(plane)}
    areas = named["Attractors of the first start over two parameters"][0]
    seen = [
        [plane.parameter_plane.motions[k].label if k >= 0 else "no attractor" for k in row]
        for row in plane.parameter_plane.motion[..., 0]
    ]
    assert areas["text"] == seen
    assert [areas["colorbar"]["ticktext"][k] for row in areas["z"] for k in row] == [name for row in seen for name in row]
    marks = named["Branch 1:1"][-1]
    assert marks["x"] == [event.value for part in plane.branches["1:1"] for event in part.events]


@pytest.mark.parametrize("run", ["plane", "manifolds"])
def test_a_page_of_any_run_shows_its_pictures(run, new_page, tmp_path):
    result = nsmaps.read_result(STORED / run)
    page = new_page()
    page.goto(write_page(result, tmp_path).as_uri())
    page.wait_for_function("() => typeof boxes === 'object' && boxes.every(box => box.querySelector('.main-svg'))")
    titles = [plot["title"] for plot in plots_of(result)]
    assert titles
    assert page.locator("h2").all_text_contents() == titles
    page.locator(".plot").first.hover()
    assert page.locator(".modebar-btn").count() > 0
    assert page.locator(".modebar-btn[data-title*='Share']").count() == 0
    assert page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth") == 0
    ticks = "k => [...boxes[k].querySelectorAll('.ytick text')].map(each => each.textContent)"
    angles = [k for k, plot in enumerate(plots_of(result)) if plot["angles"][1]]
    assert angles or run == "plane"
    for k in angles:
        page.evaluate("k => Plotly.relayout(boxes[k], {'yaxis.range': [0, 2 * Math.PI]})", k)
        page.wait_for_function(f"k => ({ticks})(k).join() === '0,π/3,2π/3,π,4π/3,5π/3,2π'", arg=k)
        page.evaluate("k => Plotly.relayout(boxes[k], {'yaxis.range': [0.1, 0.4]})", k)
        page.wait_for_function(f"k => ({ticks})(k).every(text => text.startsWith('0.'))", arg=k)
    assert page.problems == []
    page.context.close()


def test_a_browser_that_cannot_unpack_the_page_says_so(new_page, tmp_path):
    page = new_page()
    page.add_init_script("delete window.DecompressionStream")
    page.goto(write_page(nsmaps.read_result(STORED / "windows"), tmp_path).as_uri())
    assert page.locator("main p").first.text_content().startswith("This browser cannot unpack the page. Expected: Chrome 80")
    page.context.close()


def test_the_diagram_of_any_exact_map_that_has_a_text_is_computed_anew(new_page, tmp_path):
    """Of a run without a composite map, in a window around the fixed point: the page's states are fixed by the map of Python."""
    result, page = nsmaps.read_result(STORED / "windows"), new_page()
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto(write_page(result, tmp_path).as_uri())
    page.wait_for_function("() => typeof diagram === 'object' && diagram.frame")
    assert page.evaluate("() => [diagram.frame.names, diagram.shown]") == [["Γ", "v"], ["exact"]]
    page.evaluate("() => diagram.show([[1.30, 1.31], [3.5, 4.5]])")
    page.wait_for_function("() => diagram.view.points.exact?.done")
    points = as_text(page, "() => diagram.view.points.exact")
    assert len(points["values"]) > 200
    for value, *state in list(zip(points["values"], *points["states"], strict=True))[::50]:
        np.testing.assert_allclose(result.system.at(Gamma=value).first_return([state]).image[0], state, rtol=1e-12)
    assert page.problems == []
    page.context.close()


MAP = """
from nsmaps import PiecewiseMap

class Form(PiecewiseMap):
    c: float = -1.2
    coordinates = ("x", "y")

    def pieces(self, x):
        return {"L": (x.x <= 0, {"x": 0.9 * x.x + x.y + 1, "y": -0.3 * x.x}),
                "R": (True, {"x": self.c * x.x + x.y + 1, "y": -0.4 * x.x})}
"""
STUDY = """
system: form.py:Form
grid: {x: {from: -2, to: 2, points: 21}, y: {from: -1, to: 1, points: 21}}
families: {left: [L], right: [R]}
composite:
  - {name: left, family: left, where: x <= 0, fit: {full: {x: 1, y: 1}}}
  - {name: right, family: right, where: x > 0, fit: {full: {x: 1, y: 1}}}
orbits: [{start: {x: 0.1, y: 0.1}, n_returns: 5}]
"""


@pytest.fixture(scope="module")
def folder_of_map(tmp_path_factory):
    place = tmp_path_factory.mktemp("map")
    (place / "form.py").write_text(MAP)
    (place / "study.yaml").write_text(STUDY)
    for command in (
        ["run", str(place / "study.yaml"), "--out", str(place / "run"), "--no-figures"],
        ["explore", str(place / "run")],
    ):
        assert CliRunner().invoke(app, [*command, "--quiet"]).exit_code == 0
    return place / "run"


@pytest.mark.thorough
def test_the_page_of_a_map_has_its_orbits_in_place_of_flights(folder_of_map):
    result = nsmaps.read_result(folder_of_map)
    data = data_of(result)
    assert (data["shown"], len(data["flights"])) == ("orbit", 19**2)
    for flight in data["flights"][::50]:
        found = nsmaps.orbit(result.system, flight["state"], 4)
        assert flight["letters"] == found.words.tolist()
        assert flight["bodies"]["x"][::2] == pytest.approx(found.states[:, 0], rel=1e-6, abs=1e-6)
        assert len(flight["time"]) == len(flight["bodies"]["y"]) == 9
    assert "nsmaps_map" in data["script"]


def test_the_page_of_a_map_opens(new_page, folder_of_map):
    page = new_page()
    page.goto((folder_of_map / "explore.html").as_uri())
    page.locator("#motion-name[data-period]").wait_for()
    assert page.locator("#motion-name").get_attribute("data-period") == "1"
    assert page.locator("#exact").text_content() == "The exact orbit, computed with this page."
    assert page.problems == []
    page.context.close()


def test_the_map_of_a_page_without_a_composite_map_is_that_of_the_formulas(tmp_path):
    """In JavaScript, compared with the compiled map where there is a node."""
    (tmp_path / "form.py").write_text(MAP)
    head = STUDY[: STUDY.index("composite:")]
    (tmp_path / "study.yaml").write_text(f"{head}orbits: [{{start: {{x: 0.1, y: 0.1}}, n_returns: 5}}]\n")
    data = data_of(nsmaps.run_study(tmp_path / "study.yaml"))
    assert [piece["name"] for piece in data["pieces"]] == ["L", "R"]
    assert len(set(data["colours"])) == 2
    assert data["parameter"] is None
    assert "0.9" in data["script"]
    assert "-0.4" in data["script"].replace("(-0.4)", "-0.4")
