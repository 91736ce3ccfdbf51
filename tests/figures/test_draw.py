"""Whole figures by name: files, errors, and that nothing global is touched."""

import re
import subprocess
import sys
from dataclasses import replace
from typing import ClassVar

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from figures.conftest import STORED as STORED_RUNS
from matplotlib.axis import Axis
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from messages import message
from nsmaps_vi_pair import VIPair
from typer.testing import CliRunner

import nsmaps
from nsmaps.cli.cli import app
from nsmaps.coordinates import Angle
from nsmaps.errors import NsmapsError
from nsmaps.figures.page import lay_out
from nsmaps.figures.style import STYLE
from nsmaps.study.pictures.draw import draw
from nsmaps.study.study import CATALOGUE

NEEDLESS = {"sketch", "algorithm", "portrait", "poincare", "summary"}  # figures that ask for no analysis by its name
COMPOSITE = "'composite' or a 'partition' of kind closed_form"
STORED = {
    "run": "words regions surfaces projections diagonal diagonal_surface orders fit_error orbits "
    "cobweb bifurcation_diagram auxiliary envelopes domain_size boxes second_iterate",
    "partition": "words regions surfaces projections partition speed_error",
    "accurate": "words surfaces projections strips speed_error",
    "long": "motion impacts slices words regions surfaces projections diagonal diagonal_surface orders fit_error orbits cobweb "
    "branches multipliers parameter_plane lyapunov basins noise auxiliary envelopes domain_size boxes morse_sets exit_times",
    "resilience": "global_continuation",
}  #: what can be drawn of each stored run, beside what asks nothing
MISSING = {
    "motion": ("orbits", (), "'track' in an entry of 'orbits'"),
    "impacts": ("orbits", (), "'track' in an entry of 'orbits'"),
    "slices": ("slices", (), "'slices'"),
    "regions": ("composite", None, COMPOSITE),
    "words": ("surfaces", {}, "'grid' and 'families'"),
    "surfaces": ("surfaces", {}, "'grid' and 'families'"),
    "projections": ("surfaces", {}, "'grid' and 'families'"),
    "diagonal": ("diagonal", None, "'diagonal'"),
    "diagonal_surface": ("near", (), "'diagonal'"),
    "orders": ("near", (), "'orders' in 'diagonal'"),
    "fit_error": ("near", (), "'orders' in 'diagonal'"),
    "separable": ("composite", None, COMPOSITE),
    "partition": ("partition", None, "a 'partition' of kind closed_form"),
    "strips": ("accurate", None, "a 'partition' of kind accurate"),
    "speed_error": ("speed", None, "a 'partition'"),
    "orbits": ("orbits", (), "'orbits'"),
    "cobweb": ("composite", None, COMPOSITE),
    "bifurcation_diagram": ("bifurcation_diagram", {}, "'bifurcation_diagram'"),
    "branches": ("branches", {}, "'branches'"),
    "multipliers": ("branches", {}, "'branches'"),
    "lyapunov": ("lyapunov", None, "'lyapunov'"),
    "basins": ("basins", None, "'basins'"),
    "parameter_plane": ("parameter_plane", None, "'parameter_plane'"),
    "global_continuation": ("global_continuation", None, "'global_continuation'"),
    "manifolds": ("manifolds", {}, "'manifolds'"),
    "observe": ("observe", {}, "'observe', and a 'bifurcation_diagram' of the exact map or 'branches'"),
    "noise": ("noise", None, "'noise'"),
    "auxiliary": ("domains", {}, "'domains'"),
    "envelopes": ("domains", {}, "'domains'"),
    "domain_size": ("domains", {}, "'domains'"),
    "boxes": ("domains", {}, "'domains'"),
    "graze": ("branches", {}, "'branches'"),
    "second_iterate": ("second_iterate", None, "'second_iterate'"),
    "auxiliary_map": ("auxiliary_map", None, "'auxiliary_map'"),
    "morse_sets": ("morse_sets", None, "'morse_sets'"),
    "exit_times": ("exit_times", None, "'exit_times'"),
    "estimate": ("estimate", None, "'estimate'"),
    "margin": ("basin_distance", None, "'basin_distance'"),
}


@pytest.mark.parametrize("name", sorted(set(CATALOGUE) - {"graze", "estimate", "margin"}))  # others: test_portraits, test_section
def test_every_figure_is_drawn_and_nothing_global_is_kept(result, tmp_path, name):
    before = dict(matplotlib.rcParams)
    paths = draw(result, [name], tmp_path / "figures", dpi=40)
    sheets = CATALOGUE[name].sheets(result)
    assert paths == [tmp_path / "figures" / f"{sheet.name}.png" for sheet in sheets]
    assert [sheet.name == name or sheet.name.startswith(f"{name}-") for sheet in sheets] == [True] * len(sheets)
    assert plt.get_fignums() == []
    assert dict(matplotlib.rcParams) == before


FIRST = {name: run for run, names in reversed(STORED.items()) for name in names.split()}  #: the first run that has a figure


@pytest.mark.parametrize(
    ("run", "name"),
    [
        pytest.param(run, name, marks=[] if FIRST[name] == run else [pytest.mark.thorough])
        for run, names in STORED.items()
        for name in names.split()
    ],
)
def test_a_figure_of_a_stored_run_shows_data_with_names_inside_the_page(stored, run, name):
    for sheet in CATALOGUE[name].sheets(stored[run]):
        with matplotlib.rc_context(STYLE):
            figure = sheet.figure(50)
            lay_out(figure)
            figure.draw_without_rendering()
        panels = [ax for ax in figure.axes if ax.get_subplotspec() is not None and not ax.get_label().startswith("<colorbar")]
        assert len(panels) == len(sheet.panels)
        for ax in panels:
            assert all(name.get_text() for name in (ax.xaxis.label, ax.yaxis.label))
            assert in_view(ax), "something of the data is within the limits"
        page, found = figure.bbox.padded(1), list(texts(figure))
        assert len(found) >= 2 * len(panels)
        for text in found:
            extent = text.get_window_extent()
            assert page.x0 <= extent.x0 <= extent.x1 <= page.x1, text
            assert page.y0 <= extent.y0 <= extent.y1 <= page.y1, text


def in_view(ax):
    """Whether a part of a line, of a collection or of an image, or else a text, lies within the limits of the axes."""
    if ax.name == "3d":
        (facets, *_) = ax.collections
        return len(facets.triangles) > 0
    view = ax.viewLim
    points = [np.asarray(line.get_xydata(), float) for line in ax.lines if line.get_transform() == ax.transData]
    shown = any(len(xy) and view.containsx(x) and view.containsy(y) for xy in points for x, y in xy)
    extents = [each.get_datalim(ax.transData) for each in ax.collections] + [Bbox.from_extents(*image_box(i)) for i in ax.images]
    return shown or bool(ax.texts) or any(view.overlaps(extent) for extent in extents)


def image_box(image):
    left, right, low, high = image.get_extent()
    return left, low, right, high


def texts(artist):
    """The visible texts of an artist that are not cut off at the limits, but for those at ticks, which may be beyond them."""
    for each in [artist.label, artist.offsetText] if isinstance(artist, Axis) else artist.get_children():
        if not isinstance(each, Text):
            yield from texts(each)
        elif each.get_visible() and each.get_text() and each.get_clip_box() is None:
            yield each


def test_panels_have_the_letters_that_are_given(result, tmp_path):
    letters = {"cobweb-2": "cd", "slices": "ab "}
    for path in draw(result, ["cobweb", "slices"], tmp_path, ["svg"], letters=letters):
        told = re.findall(r">\(([a-z]+)\)<", path.read_text(encoding="utf-8"))
        assert "".join(told) == {"cobweb": "ab", "cobweb-2": "cd", "slices": "ab"}[path.stem]
    with pytest.raises(NsmapsError, match=message("study.letters", figure="cobweb", number=2, letters="abc")):
        draw(result, ["cobweb"], tmp_path, letters={"cobweb": "abc"})


def test_letters_on_the_command_line_are_of_files_that_are_drawn(tmp_path):
    folder = STORED_RUNS / "run"
    words = ["figures", str(folder), "--only", "cobweb", "--format", "svg", "--out", str(tmp_path)]
    done = CliRunner().invoke(app, [*words, "--letters", "cobweb=ef"])
    assert done.exit_code == 0, done.output
    assert re.findall(r">\(([a-z]+)\)<", (tmp_path / "cobweb.svg").read_text(encoding="utf-8")) == ["e", "f"]
    for wrong, said in (("words=a", "--letters for words, which is not drawn"), ("a", "expected: FILE=LETTERS")):
        done = CliRunner().invoke(app, [*words, "--letters", wrong])
        assert done.exit_code == 2
        assert said in " ".join(done.output.split())


@pytest.mark.parametrize("run", STORED)
def test_what_a_stored_run_lacks_is_an_error_of_the_catalogue(stored, run):
    drawable = set(STORED[run].split()) | NEEDLESS
    for name, row in CATALOGUE.items():
        if name not in drawable:
            with pytest.raises(NsmapsError, match=message("study.not-in-result", figure=name)):
                row.sheets(stored[run])


def test_every_name_of_the_list_has_its_missing_data_tested():
    assert set(MISSING) | NEEDLESS == set(CATALOGUE)


@pytest.mark.parametrize("name", MISSING)
def test_missing_data_names_what_the_study_must_name_and_writes_nothing(result, tmp_path, name):
    part, nothing, section = MISSING[name]
    with pytest.raises(NsmapsError, match=message("study.not-in-result", figure=name, sections=section)):
        draw(result.with_parts({part: nothing}), [name], tmp_path / "figures")
    assert not (tmp_path / "figures").exists()


def test_a_figure_that_is_not_there(result, tmp_path):
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="figure", name="cobwep", near="cobweb")):
        draw(result, ["cobwep"], tmp_path)
    with pytest.raises(NsmapsError, match=message("errors.no-such-near", kind="format", name="pgn", near="png")):
        draw(result, ["words"], tmp_path, formats=["pgn"])


def test_several_formats_of_several_figures(result, tmp_path):
    paths = draw(result, ["words", "domain_size", "words"], tmp_path, formats=("png", "svg"), dpi=40)
    assert [path.name for path in paths] == ["words.png", "words.svg", "domain_size.png", "domain_size.svg"]


def test_a_result_without_composite_map_still_shows_words_and_orbits(result, tmp_path):
    alone = tuple(replace(pair, composite=None) for pair in result.orbits)
    bare = result.with_parts({"composite": None, "diagonal": None, "orbits": alone})
    assert len(draw(bare, ["words", "orbits", "projections"], tmp_path, dpi=40)) == 3


class Three(VIPair):
    """The pair as if it had a third coordinate."""

    coordinates: ClassVar[tuple[str, ...]] = ("v", "w", Angle("phi"))


def test_pictures_of_the_plane_need_two_coordinates(result, tmp_path):
    with pytest.raises(NsmapsError, match=message("study.plane", figure="projections", number=3)):
        draw(replace(result, system=Three(**result.system.parameters)), ["projections"], tmp_path)


PLANE = """
system: two_masses
parameters: {m1: 1, m2: 1, k1: 1, k2: 1, b: 0.1, f: 1, w: 1.8, r: 0.8, d: 0}
grid: {v: {from: 0.5, to: 2, points: 7}, x2: -0.8, v2: HELD, phi: {from: 0, to: 2, points: 9}}
families: {II: [II]}
basins: {max_returns: 60}
"""


def test_a_plane_through_four_coordinates_is_drawn(tmp_path):
    (tmp_path / "plane.yaml").write_text(PLANE.replace("HELD", "0.04"))
    made = nsmaps.run_study(nsmaps.load_study(tmp_path / "plane.yaml"))
    (words,), (surfaces,), (own,) = (draw(made, [name], tmp_path, dpi=40) for name in ("words", "surfaces", "basins"))
    assert all(path.stat().st_size > 1000 for path in (words, surfaces, own))
    assert made.surfaces["II"].start.shape[1] == 4
    assert set(made.surfaces["II"].start[:, 2]) == {0.04}
    assert made.basins.label.shape == (63,)


def test_a_grid_of_three_directions_is_no_plane(tmp_path):
    (tmp_path / "plane.yaml").write_text(PLANE.replace("HELD", "{from: 0, to: 0.1, points: 2}"))
    made = nsmaps.run_study(nsmaps.load_study(tmp_path / "plane.yaml"))
    with pytest.raises(NsmapsError, match=message("exact.varies", names="v, v2, phi")):
        draw(made, ["words"], tmp_path)


def test_importing_the_figures_loads_no_matplotlib():
    code = "import sys, nsmaps.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
