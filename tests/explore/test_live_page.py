"""The page of a live exploration in a browser: what is dragged, clicked and typed is computed and shown."""

import os
import re
import subprocess
import sys
from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread

import nsmaps

pytest.importorskip("bokeh", reason="the package bokeh is not installed")
SERVE = ["-m", "nsmaps", "explore", "vi_pair/bifurcation", "--live", "--no-browser", "--out"]
FIGURE = """name => {
    const all = [...Bokeh.documents[0]._all_models.values()], one = all.find(each => each.name === name)
    const image = one.renderers.find(each => each.glyph.type === 'Image').data_source.data
    return {x: [one.x_range.start, one.x_range.end], y: [one.y_range.start, one.y_range.end], title: one.title.text,
            image: image.image.length ? [image.x[0], image.dw[0]] : null}
}"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("saved")


@pytest.fixture(scope="module")
def address(chromium, folder):
    process = subprocess.Popen(
        [sys.executable, *SERVE, str(folder)], stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    )
    yield re.search(r"http://\S+", process.stdout.readline())[0]
    process.terminate()
    process.wait()


@pytest.fixture(scope="module")
def once(new_page, address):
    """The page with finer pictures than the first, opened once: the tests that move something in it are the last."""
    page = new_page()
    page.goto(address)
    page.set_default_timeout(300_000)
    page.get_by_text("The orbit ends on").wait_for()
    wait(page, lambda: re.search("(240|720) values", page.evaluate(FIGURE, "diagram")["title"]))
    yield page
    page.context.close()


@pytest.fixture
def live(once):
    """The page from its top."""
    once.evaluate("scrollTo(0, 0)")
    yield once
    assert once.problems == []


def wait(page, shown):
    """Wait until something holds of the page, for five minutes at most, as other tests compute beside it."""
    for _ in range(3000):
        if shown():
            return
        page.wait_for_timeout(100)
    raise AssertionError("it did not come to be in five minutes")


def frame(page, name):
    """The rectangle of a picture between its axes, in pixels of the page."""
    return page.evaluate(
        """name => {
            const model = [...Bokeh.documents[0]._all_models.values()].find(each => each.name === name)
            const view = Bokeh.index.find_one(model), canvas = view.canvas_view.el.getBoundingClientRect(), box = view.frame.bbox
            return [canvas.x + box.left, canvas.y + box.top, box.width, box.height]
        }""",
        name,
    )


def test_pictures_are_there_and_nothing_leaves_the_machine(live):
    assert live.evaluate(FIGURE, "diagram")["x"] == [0.26, 0.35]
    assert live.get_by_text("stable fixed point, 1:1/T").is_visible()
    assert live.get_by_text("BTB", exact=True).is_visible()


def test_cycles_are_listed_with_their_multipliers(live):
    live.get_by_role("button", name="Find cycles").click()
    live.get_by_text("multipliers").nth(1).wait_for()
    assert live.get_by_text(re.compile("1:1/T, stable, at v = 0.833")).is_visible()


def test_the_scene_is_saved_as_a_study_once(live, folder):
    live.get_by_role("button", name="Save as a study").click()
    live.get_by_text("nsmaps run").wait_for()
    study = nsmaps.load_study(folder / "explored.yaml")
    assert study.bifurcation_diagram.parameter == "d"
    live.get_by_role("button", name="Save as a study").click()
    live.get_by_text("not overwritten").wait_for()


def test_a_rectangle_dragged_on_the_diagram_is_computed_anew(live):
    left, top, width, height = frame(live, "diagram")
    live.mouse.move(left + 0.1 * width, top + 0.1 * height)
    live.mouse.down()
    live.mouse.move(left + 0.4 * width, top + 0.9 * height, steps=6)
    live.mouse.up()
    wait(live, lambda: (live.evaluate(FIGURE, "diagram")["image"] or [0, 1])[1] < 0.05)
    seen = live.evaluate(FIGURE, "diagram")
    np.testing.assert_allclose(seen["x"], [0.269, 0.296], atol=3e-4)
    np.testing.assert_allclose(seen["image"], [seen["x"][0], seen["x"][1] - seen["x"][0]], rtol=1e-9)
    live.locator(".bk-tool-icon-reset").first.click()
    wait(live, lambda: (live.evaluate(FIGURE, "diagram")["image"] or [0, 0])[1] > 0.05)
    assert live.evaluate(FIGURE, "diagram")["x"] == [0.26, 0.35]


def test_a_click_follows_the_orbit_of_the_attractor_there(live):
    left, top, width, height = frame(live, "diagram")
    live.mouse.click(left + (0.3 - 0.26) / 0.09 * width, top + 0.5 * height)
    live.get_by_text("stable cycle of 2 returns, 1:1/2T").wait_for()
    told = live.get_by_text("stable cycle of 2 returns").inner_text()
    pair = nsmaps.load_study("vi_pair/bifurcation").system_object().at(d=0.3)
    states = np.array([[float(part) for part in found] for found in re.findall(r"\(([\d.]+), ([\d.]+)\)", told)])
    np.testing.assert_allclose(pair.first_return(states).image, states[::-1], atol=2e-3)  # d is that of the pixel


def test_a_slider_moves_by_the_keyboard(live):
    handle = live.locator(".noUi-handle").first
    before = live.get_by_text("The orbit ends on").inner_text()
    handle.focus()
    for _ in range(20):
        handle.press("ArrowLeft")
    wait(live, lambda: live.get_by_text("The orbit ends on").inner_text() != before)


def test_a_value_is_typed_and_taken_back(live, folder):
    before = live.get_by_text("The orbit ends on").inner_text()
    field = live.get_by_label("value", exact=True).first
    field.fill("0.3")
    field.press("Enter")
    live.get_by_text("stable cycle of 2 returns, 1:1/2T").wait_for()
    live.get_by_role("button", name="Find cycles").click()
    live.get_by_text("multipliers").nth(1).wait_for()
    live.get_by_label("Name of a study").fill("typed")
    live.get_by_label("Name of a study").press("Enter")
    live.get_by_role("button", name="Save as a study").click()
    live.get_by_text("nsmaps run").wait_for()
    comments = (folder / "typed.yaml").read_text().splitlines()
    assert comments[1] == "# Parameters changed: d = 0.3, was 0.35"
    assert sum(line.startswith("# Cycle found: 1:1/") for line in comments) >= 2
    live.get_by_role("button", name="Back").click()
    wait(live, lambda: live.get_by_text("The orbit ends on").inner_text() == before)


@pytest.mark.parametrize(("scheme", "page_colour"), [("dark", 0), ("light", 1)])
def test_axes_follow_the_colours_of_the_browser(live, scheme, page_colour):
    live.emulate_media(color_scheme=scheme)
    left, top, _, height = frame(live, "plane")
    beside = {"x": left - 30, "y": top, "width": 28, "height": height}  # the numbers of the axis
    wait(live, lambda: np.abs(imread(BytesIO(live.screenshot(clip=beside)))[..., :3] - page_colour).max() > 0.6)


def test_a_narrow_page_has_no_overflow(live):
    live.set_viewport_size({"width": 390, "height": 800})
    live.wait_for_function("() => innerWidth === 390 && document.documentElement.scrollWidth <= 390")  # laid out anew
