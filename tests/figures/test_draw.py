"""Whole figures by name: files, errors, and that nothing global is touched."""

import subprocess
import sys
from types import SimpleNamespace

import matplotlib
import matplotlib.pyplot as plt
import pytest
from matplotlib.image import imread

from nsmaps.errors import NsmapsError
from nsmaps.figures import NAMES, draw

NEEDLESS = {"sketch", "algorithm"}  # figures that ask nothing of a result
MISSING = {
    "motion": ("orbits", (), "'track' in an entry of 'orbits'"),
    "impacts": ("orbits", (), "'track' in an entry of 'orbits'"),
    "slices": ("slices", (), "'slices'"),
    "regions": ("composite", None, "'composite'"),
    "words": ("surfaces", {}, "'grid' and 'families'"),
    "surfaces": ("surfaces", {}, "'grid' and 'families'"),
    "projections": ("surfaces", {}, "'grid' and 'families'"),
    "diagonal": ("diagonal", None, "'diagonal'"),
    "diagonal_surface": ("near", (), "'diagonal'"),
    "orders": ("near", (), "'diagonal'"),
    "fit_error": ("near", (), "'diagonal'"),
    "separable": ("composite", None, "'composite'"),
    "partition": ("partition", None, "'partition'"),
    "strips": ("accurate", None, "a 'partition' of kind accurate"),
    "speed_error": ("speed", None, "'partition'"),
    "orbits": ("orbits", (), "'orbits'"),
    "cobweb": ("composite", None, "'composite'"),
    "bifurcation": ("bifurcation", {}, "'bifurcation'"),
    "branches": ("branches", {}, "'branches'"),
    "stability": ("stability", None, "'stability'"),
    "lyapunov": ("lyapunov", None, "'lyapunov'"),
    "basins": ("basins", None, "'basins'"),
    "noise": ("noise", None, "'noise'"),
    "auxiliary": ("domains", {}, "'domains'"),
    "envelopes": ("domains", {}, "'domains'"),
    "domain_size": ("domains", {}, "'domains'"),
    "second_iterate": ("second_iterate", None, "'second_iterate'"),
    "morse": ("morse", None, "'morse'"),
    "transient": ("transient", None, "'transient'"),
}


def without(result, **parts):
    return SimpleNamespace(**{**vars(result), **parts})


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_is_drawn_and_nothing_global_is_kept(result, tmp_path, name):
    before = dict(matplotlib.rcParams)
    paths = draw(result, [name], tmp_path / "figures", dpi=40)
    assert paths[0] == tmp_path / "figures" / f"{name}.png"
    assert all(imread(path).std() > 0 for path in paths)
    assert plt.get_fignums() == []
    assert dict(matplotlib.rcParams) == before


def test_every_name_of_the_list_has_its_missing_data_tested():
    assert set(MISSING) | NEEDLESS == set(NAMES)


@pytest.mark.parametrize("name", MISSING)
def test_missing_data_names_what_the_study_must_name_and_writes_nothing(result, tmp_path, name):
    part, nothing, section = MISSING[name]
    with pytest.raises(NsmapsError, match=f"figure '{name}' .* name {section} in the study"):
        draw(without(result, **{part: nothing}), [name], tmp_path / "figures")
    assert not (tmp_path / "figures").exists()


def test_a_figure_that_is_not_there(result, tmp_path):
    with pytest.raises(NsmapsError, match="no figure 'cobwep', did you mean 'cobweb'"):
        draw(result, ["cobwep"], tmp_path)
    with pytest.raises(NsmapsError, match="no format 'pgn', did you mean 'png'"):
        draw(result, ["words"], tmp_path, formats=["pgn"])


def test_several_formats_of_several_figures(result, tmp_path):
    paths = draw(result, ["words", "domain_size", "words"], tmp_path, formats=("png", "svg"), dpi=40)
    assert [path.name for path in paths] == ["words.png", "words.svg", "domain_size.png", "domain_size.svg"]


def test_a_result_without_composite_map_still_shows_words_and_orbits(result, tmp_path):
    alone = [SimpleNamespace(exact=pair.exact, composite=None) for pair in result.orbits]
    bare = without(result, composite=None, diagonal=None, orbits=alone)
    assert len(draw(bare, ["words", "orbits", "projections"], tmp_path, dpi=40)) == 3


def test_pictures_of_the_plane_need_two_coordinates(result, tmp_path):
    thick = SimpleNamespace(coordinates=("v", "w", "phi"))
    with pytest.raises(NsmapsError, match="needs a system of 2 coordinates; this one has 3"):
        draw(without(result, surfaces={"BB": thick}), ["words"], tmp_path)


def test_importing_the_figures_loads_no_matplotlib():
    code = "import sys, nsmaps.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
