"""The pictures of one coordinate: cobwebs, envelopes, sizes of domains, second iterates."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from figures.conftest import COORDINATES, panel, through
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from messages import message

from nsmaps.auxiliary.attracting_domain import attracting_domain
from nsmaps.errors import NsmapsError
from nsmaps.figures.composite.cobweb import cobweb
from nsmaps.figures.domains.auxiliary import auxiliary, first_interval
from nsmaps.figures.domains.auxiliary import sheets as auxiliary_sheets
from nsmaps.figures.domains.domain_size import domain_size
from nsmaps.figures.domains.envelopes import envelopes
from nsmaps.figures.domains.second_iterate import second_iterate
from nsmaps.figures.lines import staircase
from nsmaps.figures.parts import Bounded
from nsmaps.figures.style import PIECES, REST
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Box
from nsmaps.reduced.fit.polymap import PolyMap
from nsmaps.study.study import CATALOGUE


def by_label(ax):
    return {line.get_label(): line for line in ax.lines}


@pytest.mark.parametrize(("coordinate", "index"), [("v", 0), ("phi", 1), ("", 0)])
def test_cobweb_steps_through_the_composite_orbit(result, ax, coordinate, index):
    assert panel(cobweb, result, ax, coordinate=coordinate) is ax
    states = result.orbits[0].composite.states[:, index]
    assert np.array_equal(by_label(ax)["composite orbit"].get_xydata(), np.column_stack(staircase(states)))
    ends = by_label(ax)["last tenth"].get_xydata()
    assert np.array_equal(ends, np.column_stack([states[-5:-1], states[-4:]]))  # of 40 steps the last four


def test_cobweb_draws_separable_pieces_as_curves_and_shades_the_others(result, ax):
    panel(cobweb, result, ax, coordinate="v")
    curve = by_label(ax)[r"$\mathcal{R}_{2}$"].get_xydata()
    curve = curve[np.isfinite(curve).all(axis=1)]
    assert np.allclose(curve[:, 1], 0.9 - 0.2 * curve[:, 0])
    (area,) = [artist for artist in ax.collections if isinstance(artist, PolyCollection)]
    assert area.get_label() == r"$\mathcal{R}_{1}$"
    low, high = area.get_datalim(ax.transData).get_points()
    assert 0.6 <= low[0] < high[0] <= 0.95


def test_separable_pieces_have_their_colour_wherever_the_orbit_goes_and_each_orbit_its_sheet(result, ax):
    stays = through(result, np.array([[0.5, 2.0], [0.52, 2.5], [0.51, 2.4]]))
    assert 1 not in result.composite.piece_of(stays.composite.states)
    only_r1 = through(result, np.array([[0.83, 0.36], [0.8, 0.4], [0.82, 0.38]]))
    for pair, pale in ((stays, {"R1"}), (only_r1, set())):
        ax.clear()
        panel(cobweb, result.with_parts({"orbits": (pair,)}), ax, coordinate="v")
        curve = by_label(ax)[r"$\mathcal{R}_{2}$"]
        assert to_rgb(curve.get_color()) == to_rgb(PIECES[1])
        (area,) = [artist for artist in ax.collections if isinstance(artist, PolyCollection) and artist.get_paths()]
        assert (to_rgb(area.get_facecolor()[0]) == to_rgb(REST)) == bool(pale)
    assert [(sheet.name, len(sheet.panels)) for sheet in CATALOGUE["cobweb"].sheets(result)] == [("cobweb", 2), ("cobweb-2", 2)]


@pytest.mark.parametrize(("coordinate", "index"), [("v", 0), ("phi", 1)])
def test_envelopes_are_those_of_the_update(result, ax, coordinate, index):
    envelopes(result.domains["fitted"], ax, coordinate, update=1)
    step = result.domains["fitted"].updates[1]
    lines = by_label(ax)
    assert np.array_equal(lines["upper map"].get_ydata(), step.envelopes[index].upper)
    assert np.array_equal(lines["lower map"].get_ydata(), step.envelopes[index].lower)
    (span,) = ax.patches
    assert np.allclose([span.get_x(), span.get_x() + span.get_width()], step.worst[-1, index])
    assert ax.get_title() == f"update 2: width {np.ptp(step.worst[-1, index]):.3g}"
    assert ("rad" in ax.get_xlabel(), "rad" in ax.get_ylabel()) == (index == 1, index == 1)


def test_worst_case_steps_reach_every_bound(result, ax):
    envelopes(result.domains["fitted"], ax, "v", update=0)
    reached = by_label(ax)["worst case"].get_ydata()
    assert result.domains["fitted"].updates[0].worst[1:, 0].size
    for bound in result.domains["fitted"].updates[0].worst[1:, 0].ravel():
        assert np.isclose(reached, bound).any()


def test_families_lie_between_the_maps_that_bound_them(result, ax):
    auxiliary(result.domains["fitted"], ax, "v")
    envelope = result.domains["fitted"].updates[0].envelopes[0]
    lines = by_label(ax)
    assert np.array_equal(lines["upper map"].get_ydata(), envelope.upper)
    low, high = (lines[f"the other at its {end}"].get_ydata() for end in ("least", "largest"))
    assert np.allclose(low, 0.95 - 0.15 * 0.1 - 0.2 * envelope.x)  # the coupled map itself, at phi = 0.1 and 0.8
    assert np.allclose(high, 0.95 - 0.15 * 0.8 - 0.2 * envelope.x)
    assert (low <= envelope.upper).all()
    assert (high >= envelope.lower).all()
    assert lines["upper map"].get_marker() == lines["lower map"].get_marker() == "D"


def test_the_worst_case_of_a_family_begins_with_its_first_interval(result, ax):
    first_interval(result.domains["fitted"], ax, "phi")
    assert ax.get_title().startswith("update 1: width 0.")
    (span,) = ax.patches
    assert np.allclose([span.get_x(), span.get_x() + span.get_width()], result.domains["fitted"].updates[0].worst[1, 1])
    assert "lower map" in by_label(ax)
    assert [(sheet.name, len(sheet.panels), sheet.title) for sheet in auxiliary_sheets(result.domains)] == [
        ("auxiliary", 4, "fitted map R1: bounded")
    ]


@pytest.mark.parametrize(
    ("coordinate", "points"),
    [("v", {"P": (0.6, 0.815), "Q": (0.95, 0.64)}), ("phi", {"R": (0.1, 0.5175), "O": (0.8, 0.29)})],
)
def test_the_extremes_over_the_box_have_the_names_of_the_paper(result, ax, coordinate, points):
    """v' = 0.95 - 0.15 phi - 0.2 v and phi' = 0.5 - 0.3 phi + 0.05 v over [0.6, 0.95] x [0.1, 0.8], by hand."""
    first_interval(result.domains["fitted"], ax, coordinate)
    named = {text.get_text().strip("$"): text.xy for text in ax.texts}
    assert set(named) == set(points)
    for name, place in points.items():
        assert named[name] == pytest.approx(place, abs=1e-9)
    (span,) = ax.patches
    ends = sorted(place[1] for place in points.values())
    assert [span.get_x(), span.get_x() + span.get_width()] == pytest.approx(ends, abs=1e-9)


def test_a_generic_cobweb_without_a_cycle_is_not_drawn(result, ax):
    step = result.domains["fitted"].updates[0]
    wild = replace(step, generic=np.random.default_rng(0).uniform(0.6, 0.9, (400, 2)))
    domain = replace(result.domains["fitted"], updates=(wild,))
    envelopes(domain, ax, "v")
    assert "orbit, both maps in turn" not in by_label(ax)
    assert "its last tenth" not in by_label(ax)


def test_the_second_iterate_of_part_2_is_the_worst_case(result, ax):
    """A hump x' = 0.8 - 3 (x - 0.35)^2: the worst case fixes p = xi_L(q) and q = 0.8, the plain composite does not fix q."""
    hump = {(0,): Fraction("0.4325"), (1,): Fraction("2.1"), (2,): Fraction(-3)}
    domain = attracting_domain(PolyMap.of_monomials(("x",), {"x": hump}, [[-1, 1]]), [[-0.2, 0.9]], max_updates=2)
    second_iterate(result.second_iterate, ax, Bounded("hump", domain), "x")
    p, q = domain.updates[-1].worst[-1, 0]
    for name, fixed in (("$N = 2$", p), ("_upper of lower map 2", q)):
        assert np.interp(fixed, *by_label(ax)[name].get_data()) == pytest.approx(fixed, abs=1e-3)
    assert "worst case" in by_label(ax)


def test_an_update_that_is_not_trapped_shows_no_domain(result, ax):
    envelopes(result.domains["loose"], ax, "v")
    assert ax.get_title() == "update 1: not invariant"
    assert not ax.patches
    assert "orbit, both maps in turn" not in by_label(ax)


def test_envelopes_of_an_update_that_was_not_made(result, ax):
    with pytest.raises(NsmapsError, match=message("figures.no-update", number=9, count=5)):
        envelopes(result.domains["fitted"], ax, update=9)


def test_domain_size_is_logarithmic_over_decades_only(result, ax):
    sizes = np.concatenate([domain.sizes[:, 0] for domain in result.domains.values()])
    domain_size(result.domains, ax, "v")
    assert (ax.get_yscale() == "log") == (sizes.max() > 30 * sizes.min())


@pytest.mark.parametrize(("updates", "polynomial"), [((2,), False), ((2, 5), True), ((), True)])
def test_second_iterate_meets_the_diagonal_at_p_and_q_at_every_update_shown(result, ax, updates, polynomial):
    second_iterate(result.second_iterate, ax, Bounded("fitted", result.domains["fitted"], updates), "v")
    lines = by_label(ax)
    for number in updates or (2, 5):
        p, q = result.domains["fitted"].updates[number - 1].worst[-1, 0]
        for name, fixed in ((f"$N = {number}$", p), (f"_upper of lower map {number}", q)):
            x, y = lines[name].get_data()
            assert np.interp(fixed, x, y) == pytest.approx(fixed, abs=1e-4)
    assert any(name.startswith("polynomial, degree 1") for name in lines) == polynomial
    assert ax.get_ylabel() == "$v_{k+2}$"


def test_second_iterate_polynomial_is_of_its_own_coordinate_only(result, ax):
    second_iterate(result.second_iterate, ax, Bounded("fitted", result.domains["fitted"]), "phi")
    assert not any(name.startswith("polynomial") for name in by_label(ax))


def test_a_coordinate_that_is_not_there(result, ax):
    with pytest.raises(NsmapsError, match=message("errors.no-such", kind="coordinate", name="w")):
        panel(cobweb, result, ax, coordinate="w")


def test_cobweb_of_a_curve_across_the_seam_of_a_phase_is_drawn_on_one_stretch(result, ax):
    """phi -> 0.4 phi - 0.3 over [0, pi]: images just below zero are not wrapped to just below 2 pi."""
    zeros = np.zeros(2), np.ones(2), np.array([[0.0, 1.0], [-1.0, 2.0]])
    dips = PolyMap(
        COORDINATES, (np.array([[0, 0]]), np.array([[0, 0], [0, 1]])), (np.array([0.5]), np.array([-0.3, 0.4])), *zeros
    )
    pieces = (Piece("R1", Box.of(COORDINATES, [[0, 2], [0, 4]]), dips, "BTB"),)
    states = np.array([[0.5, 2.0], [0.5, 0.5], [0.5, 0.4]])
    orbits = (through(result, states),)
    made = {"composite": CompositeMap(COORDINATES, ("B", "T"), pieces), "orbits": orbits}
    panel(cobweb, result.with_parts(made), ax, coordinate="phi")
    x, y = by_label(ax)[r"$\mathcal{R}_{1}$"].get_data()
    assert np.allclose(y, 0.4 * x - 0.3)
    low, high = ax.get_ylim()
    assert -0.6 < low < -0.3
    assert np.pi < high < 1.1 * np.pi
    turned = [line.get_ydata() for line in ax.lines if line.get_label() == "_" and len(line.get_ydata()) == len(y)]
    assert any(np.allclose(line, y + 2 * np.pi) for line in turned)


def test_a_run_away_end_of_an_area_does_not_set_the_limits(result, ax):
    """v -> 0.5 + 0.01 v phi + 0.6 v^8 phi leaves the picture at its end, where it is cut off."""
    limits = np.zeros(2), np.ones(2), np.array([[0.0, 1.0], [0.0, np.pi]])
    terms = np.array([[0, 0], [1, 1], [8, 1]]), np.array([[0, 0], [0, 1]])
    wild = PolyMap(COORDINATES, terms, (np.array([0.5, 0.01, 0.6]), np.array([0.5, 0.1])), *limits)
    pieces = (Piece("R1", Box.of(COORDINATES, [[0, 2], [0, 4]]), wild, "BTB"),)
    orbits = (through(result, np.array([[0.5, 2.0], [0.52, 0.5], [0.51, 0.4]])),)
    made = {"composite": CompositeMap(COORDINATES, ("B", "T"), pieces), "orbits": orbits}
    panel(cobweb, result.with_parts(made), ax, coordinate="v")
    (area,) = [artist for artist in ax.collections if isinstance(artist, PolyCollection)]
    assert area.get_datalim(ax.transData).y1 > 2
    assert ax.get_ylim()[1] < 1.1


def test_maps_of_an_enclosed_domain_are_said_to_be_samples(result, ax):
    exact = replace(result.domains["fitted"], status="enclosed")
    envelopes(exact, ax, "v", update=0)
    lines, envelope = by_label(ax), exact.updates[0].envelopes[0]
    assert np.array_equal(lines["lower map, samples"].get_ydata(), envelope.lower)
    assert np.array_equal(lines["upper map, samples"].get_ydata(), envelope.upper)
    assert "worst case, enclosed" in lines


@pytest.mark.parametrize("draw", [envelopes, auxiliary])
def test_the_picture_is_as_wide_as_the_box(result, ax, draw):
    draw(result.domains["loose"], ax, "v")
    assert ax.get_xlim() == pytest.approx((0.9 - 0.005, 0.95 + 0.005))
    assert ax.get_ylim()[1] - ax.get_ylim()[0] > 0.05


def test_the_interval_of_the_attracting_domain_is_told_with_its_width_and_lets_curves_be_seen(result, ax):
    envelopes(result.domains["fitted"], ax, "v", update=1)
    (span,) = ax.patches
    width = np.ptp(result.domains["fitted"].updates[1].worst[-1, 0])
    assert ax.get_title() == f"update 2: width {width:.3g}"
    assert min(span.get_facecolor()[:3]) > 0.7, "pale"


def test_where_the_second_iterate_has_no_fixed_point_the_panel_says_so(result, ax):
    second_iterate(result.second_iterate, ax, Bounded("fitted", result.domains["fitted"], (1,)), "v")
    assert not ax.texts
    ax.clear()
    second_iterate(result.second_iterate, ax, Bounded("loose", result.domains["loose"], (1,)), "v")
    assert [text.get_text() for text in ax.texts] == ["no fixed point in the box"]


@pytest.mark.parametrize(("end", "shown"), [(0.5, True), (1e90, False)])
def test_the_cobweb_of_an_orbit_that_ends_has_no_last_tenth(result, ax, end, shown):
    pair = result.orbits[0]
    states = np.array(pair.composite.states)
    states[7, 0], states[8:] = end, np.nan
    stopped = replace(pair, composite=replace(pair.composite, states=states))
    panel(cobweb, result.with_parts({"orbits": (stopped,)}), ax)
    named = by_label(ax)
    assert "last tenth" not in named
    assert ("end" in named) is shown
    assert not shown or named["end"].get_xydata().tolist() == [[end, end]]


@pytest.mark.parametrize("name", ["envelopes", "auxiliary"])
def test_a_domain_without_values_is_an_error_that_says_why(result, name):
    loose = result.domains["loose"]
    first = loose.updates[0]
    none = tuple(
        replace(each, lower=np.full_like(each.x, np.nan), upper=np.full_like(each.x, np.nan)) for each in first.envelopes
    )
    empty = replace(loose, updates=(replace(first, envelopes=none),), reason="update 1: some states of the box have no image")
    with pytest.raises(
        NsmapsError, match=message("study.no-auxiliary-map", domain="empty", why="update 1: some states of the box have no image")
    ):
        CATALOGUE[name].sheets(result.with_parts({"domains": {"empty": empty}}))
    assert len(CATALOGUE[name].sheets(result.with_parts({"domains": {"empty": empty, "loose": loose}}))) == 1


@pytest.mark.parametrize("draw", [envelopes, auxiliary])
def test_a_worst_case_without_an_end_is_drawn_as_far_as_it_goes(result, ax, draw):
    loose = result.domains["loose"]
    worst = loose.updates[0].worst.copy()
    worst[1] = -np.inf, np.inf
    endless = replace(loose, updates=(replace(loose.updates[0], worst=worst),))
    draw(endless, ax)
    assert np.isfinite([*ax.get_xlim(), *ax.get_ylim()]).all()
