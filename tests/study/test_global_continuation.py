"""The section `global_continuation` of a study: against the function, in numbers, tables, sentences and its figure."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from messages import message

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.figures.longrun.basins import COLOURS, basin_colour
from nsmaps.figures.longrun.global_continuation import global_continuation
from nsmaps.study.pictures.catalogue import caption
from nsmaps.study.store.archive import FORMAT

STORED = Path(__file__).parents[1] / "data" / f"run-format-{FORMAT}" / "resilience"


@pytest.fixture(scope="module")
def result():
    return nsmaps.read_result(STORED)


@pytest.fixture(scope="module")
def found(result):
    return result.global_continuation


def test_it_is_what_the_function_finds(result, found):
    region, last = {"v": (0.05, 0.95), "phi": (0, 2 * np.pi)}, found.values[-1:]
    counts = {"n_samples": 60, "max_returns": 400, "n_kicks": 10, "n_directions": 8, "n_states": 2}
    direct = nsmaps.global_continuation(result.system, "d", last, region, **counts)
    assert direct.labels.tolist() == [["C"]]
    assert direct.share[0, 0] == found.share[-1, 1] == 1
    assert np.isposinf([direct.distance[0, 0], found.distance[-1, 1]]).all()
    assert np.isnan(found.share[-1, 0])


def test_numbers_tables_and_sentences_say_what_was_found(result, found):
    numbers = result.study.global_continuation.numbers(result)["global_continuation"]
    assert np.array(numbers["labels"]).tolist() == found.labels.tolist()
    assert numbers["changes"] == [{"attractor": 0, "kind": "death", "label": "2:1/T", "between": found.values[2:].tolist()}]
    assert list(result.study.global_continuation.verdicts(result)) == []
    table, changes = result.study.global_continuation.tables(result)
    assert [row[:2] for row in table.rows] == [("0", "2:1/T"), ("1", "C")]
    assert changes.rows == (("0", "2:1/T", "death", "0.2277", "0.2282"),)
    assert "attractors 2, births 0, deaths 1" in caption(result, "global_continuation")
    told = result.study.global_continuation.describe(result.study)
    assert told == "4 values of d from 0.2267 to 0.2282, 60 starts each, up to 400 returns"


def test_values_without_a_map_are_a_verdict(result, found):
    refused = replace(found, reasons=("d is out of range", "", "", ""))
    (verdict,) = result.study.global_continuation.verdicts(result.with_parts({"global_continuation": refused}))
    assert not verdict.holds
    assert verdict.text == "no: none at 1 of 4 values; d is out of range"


def test_bands_have_the_shares_as_heights(result, found):
    ax = Figure().subplots()
    global_continuation(found, ax)
    fills = ax.collections
    assert [fill.get_facecolor()[0].tolist() for fill in fills] == [list(to_rgba(basin_colour(colour))) for colour in COLOURS[:2]]
    for k, fill in enumerate(fills):
        vertices = fill.get_paths()[0].vertices
        for value, share in zip(found.values, np.nan_to_num(found.share[:, k]), strict=True):
            inside = vertices[np.abs(vertices[:, 0] - value) < 0.51 * np.diff(found.values)[0], 1]
            assert {0.0, 1.0} & {inside.min(), inside.max()}
            assert share <= np.ptp(inside) + 1e-12
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["2:1/T", "chaos"]


def test_dots_are_the_distances_and_an_arrow_is_beyond_the_kicks(result, found):
    ax = Figure().subplots()
    global_continuation(found, ax, "distance")
    dots = [line for line in ax.lines if line.get_marker() == "o"]
    arrows = [line for line in ax.lines if line.get_marker() == "^" and len(line.get_xdata())]
    for k, line in enumerate(dots):
        finite = np.isfinite(found.distance[:, k])
        assert np.array_equal(line.get_ydata()[finite], found.distance[finite, k])
    (arrow,) = arrows
    assert (arrow.get_xdata().tolist(), arrow.get_ydata().tolist()) == ([found.values[-1]], [1.0])
    assert ax.get_yscale() == "log"
    with pytest.raises(NsmapsError, match=message("figures.quantity")):
        global_continuation(found, ax, "words")
