"""Figures of many pieces and words: what is told apart, what is not, and what is written where."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from figures.conftest import COORDINATES, GRID, WALLS, Toy, linear, panel, regions_of, through
from matplotlib.collections import PolyCollection, TriMesh

from nsmaps.exact.surfaces.surface import Surface
from nsmaps.exact.words import encode
from nsmaps.figures.composite.areas import colours_over
from nsmaps.figures.composite.cobweb import cobweb, draw_pieces
from nsmaps.figures.composite.partition import partition
from nsmaps.figures.composite.regions import regions
from nsmaps.figures.returns.words import words
from nsmaps.figures.style import GREY, PIECES, REST, family_colours, piece_label, tint
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box
from nsmaps.study.sections.maps.surfaces import SURFACES
from nsmaps.study.study import CATALOGUE

STRIPS = 34
WORDS = [f"B{'T' * k}B" for k in range(12)]


class Strips(Toy):
    """The toy with twelve words in strips along v."""

    letters = WALLS

    def first_return(self, states, derivative=False):
        number = np.clip((np.asarray(states, float)[:, 0] - 0.1) / 0.9 * 12, 0, 11).astype(int)
        return replace(super().first_return(states), codes=np.array([encode(word, WALLS) for word in WORDS])[number])

    itineraries = first_return


@pytest.fixture
def many(result):
    """The plane in 34 strips along v, the last ones narrow, each of a word of its own; orbits stay in the last."""
    edges = 1.0 - 0.9 * np.linspace(0, 1, STRIPS + 1) ** 0.5
    moved = linear((0.3, 0.1, 0.02), (0.5, 0.1, 0.05))
    names = [f"R{k + 1}" for k in range(STRIPS)]
    boxes = [Box.of(COORDINATES, [[edges[k + 1], edges[k]], [0.0, 7.0]]) for k in range(STRIPS)]
    made = tuple(Piece(name, box, moved, f"B{'T' * k}B") for k, (name, box) in enumerate(zip(names, boxes, strict=True)))
    whole = Strips().first_return(GRID.states())
    surfaces = {word: Surface(word, GRID, whole.has_word(word), whole.select(whole.has_word(word))) for word in WORDS}
    states = np.full((40, 2), [0.105, 1.0])
    pair = through(result, states)
    parts = {
        "composite": CompositeMap(COORDINATES, WALLS, made),
        "surfaces": surfaces,
        "orbits": (replace(pair, exact=replace(pair.exact, states=states)),),
        "partition": None,
    }
    return replace(result.with_parts(parts), system=Strips())


def legend_texts(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_eight_pieces_have_a_colour_first_those_in_which_orbits_end(many):
    told = colours_over(many.composite, GRID, many.orbits)
    assert sorted(set(told)) == sorted({*PIECES, REST})
    assert told.count(REST) == STRIPS - 8
    assert told[-1] != REST, "the narrowest holds the orbit"
    share = np.bincount(many.composite.piece_of(GRID.states()), minlength=STRIPS)
    grey = [k for k in range(STRIPS) if told[k] == REST]
    assert max(share[grey]) <= min(share[k] for k in range(STRIPS - 1) if told[k] != REST)


def test_pieces_are_named_up_to_eight_and_the_rest_counted(many, ax):
    draw_pieces(many.composite, ax, 0, GRID, colours_over(many.composite, GRID, many.orbits))
    texts = [str(each.get_label()) for each in (*ax.lines, *ax.collections)]
    drawn = len(np.unique(many.composite.piece_of(GRID.states())))
    assert [text for text in texts if "more" in text] == [f"{drawn - 8} more pieces"]
    assert len([text for text in texts if "mathcal" in text]) == 8


def test_a_cobweb_names_the_pieces_that_its_orbit_visits(many, ax):
    panel(cobweb, many, ax, coordinate="v")
    states = many.orbits[0].composite.states
    visited = {many.composite.pieces[k].name for k in many.composite.piece_of(states[:-1])}
    named = [text for text in legend_texts(ax) if "mathcal" in text]
    assert set(named) <= {piece_label(name) for name in visited}
    assert "other pieces" in legend_texts(ax)


def test_small_areas_are_drawn_over_large_ones(result, ax):
    names = COORDINATES
    inner, outer = (Box.of(names, [[low, 1.0], [0.0, 7.0]]) for low in (0.9, 0.0))
    made = CompositeMap(
        names,
        WALLS,
        tuple(Piece(n, b, linear((0.3, 0.1, 0.1), (0.5, 0.1, 0.05)), "BB") for n, b in zip("ab", (inner, outer), strict=True)),
    )
    draw_pieces(made, ax, 0, GRID, colours_over(made, GRID))
    height = {area.get_label(): area.get_zorder() for area in ax.collections if isinstance(area, PolyCollection)}
    assert height["a"] > height["b"]


@pytest.mark.parametrize("name", ["cobweb", "words"])
def test_panels_keep_their_size_beside_a_long_legend(many, name):
    (sheet,) = CATALOGUE[name].sheets(many)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = sheet.figure()
        figure.canvas.draw()
    below = sum(legend.get_window_extent().height for legend in figure.legends)
    assert figure.axes
    for ax in figure.axes:
        height, width = ax.get_window_extent().height, ax.get_window_extent().width
        assert height > 0.6 * (figure.bbox.height - below)
        assert width > 0.2 * figure.bbox.width
        legend = ax.get_legend()
        if legend is not None:
            inside = legend.get_window_extent()
            assert inside.y0 >= 0
            assert inside.y1 <= figure.bbox.height
            assert inside.x1 <= figure.bbox.width


def test_a_name_lies_within_its_piece(many, ax):
    regions(many.composite, ax, GRID, many.orbits, shares=False)
    ax.figure.canvas.draw()
    assert 0 < len(ax.texts) < STRIPS
    label = {rf"$\mathcal{{R}}_{{{k + 1}}}$": k for k in range(STRIPS)}
    for text in ax.texts:
        extent = ax.transData.inverted().transform(text.get_window_extent())
        corners = [[x, y] for x in extent[:, 0] for y in extent[:, 1]]
        assert set(many.composite.piece_of(corners)) == {label[text.get_text()]}


def test_the_ninth_word_and_all_after_it_are_grey(many, ax):
    panel(words, many, ax)
    assert legend_texts(ax)[:9] == [*sorted(many.surfaces, key=lambda name: -len(many.surfaces[name].start))[:8], "4 more words"]
    colours = [tuple(artist.get_facecolor()[0, :3]) for artist in ax.collections if isinstance(artist, TriMesh)]
    assert len(set(colours[:8])) == 8
    assert set(colours[8:]) == {tint(GREY, 0.25)}


def test_families_beyond_eight_share_a_grey():
    told = list(family_colours([f"B{'T' * k}B" for k in range(11)] + ["BT~B"]).values())
    assert len(set(told[:8])) == 8
    assert set(told[8:]) == {GREY}
    assert GREY not in told[:8]


def test_shares_of_pieces_without_a_colour_are_summed(many, ax):
    regions_of(many, ax)
    texts = legend_texts(ax)
    assert len(texts) == 9 + ("in no piece" in texts[-1])
    shares = [float(text.rpartition(":")[2].split()[0]) for text in texts]
    assert sum(shares) == pytest.approx(100, abs=1)


def test_a_partition_of_many_words_names_each_where_there_is_room(result, many, ax):
    made = replace(result.partition, composite=many.composite, attracting=(), log=())
    panel(partition, many.with_parts({"partition": made}), ax)
    told = [text.get_text().splitlines() for text in ax.texts]
    word = {rf"$\mathcal{{R}}_{{{k + 1}}}$": many.composite.pieces[k].word for k in range(STRIPS)}
    assert len(set(word.values())) > 1
    assert all(lines[1:] in ([], [word[lines[0]]]) for lines in told)
    assert not legend_texts(ax)


def test_of_more_than_eight_families_the_commonest_have_colours(result):
    """The families of most states come first where not all are told apart."""
    first = next(iter(result.surfaces.values()))
    rare = {f"B{'T' * k}B": first.restrict(np.arange(len(first.start)) < k) for k in range(9, 0, -1)}
    shown = SURFACES.of(
        result.with_parts({"surfaces": rare | {"BB": first, "none": first.restrict(first.start[:, 0] < 0)}}), "words"
    )
    assert list(shown) == ["BB", *(f"B{'T' * k}B" for k in range(9, 0, -1))]
    few = dict(list(rare.items())[::-1][:3])
    assert list(SURFACES.of(result.with_parts({"surfaces": few}), "words")) == [
        "BTB",
        "BTTB",
        "BTTTB",
    ]
