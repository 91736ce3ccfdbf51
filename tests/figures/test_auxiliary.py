"""The pictures of one coordinate: cobwebs, envelopes, sizes of domains, second iterates."""

from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import PolyCollection

from nsmaps.auxiliary.domain import attracting_domain
from nsmaps.errors import NsmapsError
from nsmaps.figures.auxiliary import auxiliary
from nsmaps.figures.auxiliary import sheets as auxiliary_sheets
from nsmaps.figures.cobweb import cobweb
from nsmaps.figures.domain_size import domain_size
from nsmaps.figures.envelopes import envelopes, shown
from nsmaps.figures.envelopes import sheets as envelope_sheets
from nsmaps.figures.lines import staircase
from nsmaps.figures.second_iterate import second_iterate
from nsmaps.reduced.polymap import PolyMap


def by_label(ax):
    return {line.get_label(): line for line in ax.lines}


@pytest.mark.parametrize(("coordinate", "index"), [("v", 0), ("phi", 1), ("", 0)])
def test_cobweb_steps_through_the_composite_orbit(result, ax, coordinate, index):
    assert cobweb(result, ax, coordinate) is ax
    states = result.orbits[0].composite.states[:, index]
    assert np.array_equal(by_label(ax)["orbit"].get_xydata(), np.column_stack(staircase(states)))
    ends = by_label(ax)["last 10 %"].get_xydata()
    assert np.array_equal(ends, np.column_stack([states[-5:-1], states[-4:]]))  # of 40 steps the last four


def test_cobweb_draws_separable_pieces_as_curves_and_shades_the_others(result, ax):
    cobweb(result, ax, "v")
    curve = by_label(ax)[r"$\mathcal{R}_{2}$"].get_xydata()
    curve = curve[np.isfinite(curve).all(axis=1)]
    assert np.allclose(curve[:, 1], 0.9 - 0.2 * curve[:, 0])
    (area,) = [artist for artist in ax.collections if isinstance(artist, PolyCollection)]
    assert area.get_label() == r"$\mathcal{R}_{1}$"
    low, high = area.get_datalim(ax.transData).get_points()
    assert 0.6 <= low[0] < high[0] <= 0.95


@pytest.mark.parametrize(("coordinate", "index"), [("v", 0), ("phi", 1)])
def test_envelopes_are_those_of_the_update(result, ax, coordinate, index):
    envelopes(result, ax, coordinate, update=1)
    step = result.domains["fitted"].updates[1]
    lines = by_label(ax)
    letter = (r"\xi", r"\eta")[index]
    assert np.array_equal(lines[f"${letter}_U$"].get_ydata(), step.envelopes[index].upper)
    assert np.array_equal(lines[f"${letter}_L$"].get_ydata(), step.envelopes[index].lower)
    (span,) = ax.patches
    assert np.allclose([span.get_x(), span.get_x() + span.get_width()], step.worst[-1, index])
    assert ax.get_title() == "fitted map R1, update 2"
    assert ("rad" in ax.get_xlabel(), "rad" in ax.get_ylabel()) == (index == 1, index == 1)


def test_worst_case_steps_reach_every_bound(result, ax):
    envelopes(result, ax, "v", update=0)
    reached = by_label(ax)["worst case"].get_ydata()
    for bound in result.domains["fitted"].updates[0].worst[1:, 0].ravel():
        assert np.isclose(reached, bound).any()


def test_families_lie_between_the_maps_that_bound_them(result, ax):
    auxiliary(result, ax, "v")
    envelope = result.domains["fitted"].updates[0].envelopes[0]
    lines = by_label(ax)
    assert np.array_equal(lines[r"$\xi_U$"].get_ydata(), envelope.upper)
    low, high = (lines[rf"$\phi$ = {value:.3g}"].get_ydata() for value in (0.1, 0.8))
    assert np.allclose(low, 0.95 - 0.15 * 0.1 - 0.2 * envelope.x)  # the coupled map itself, at phi = 0.1 and 0.8
    assert np.allclose(high, 0.95 - 0.15 * 0.8 - 0.2 * envelope.x)
    assert (low <= envelope.upper).all()
    assert (high >= envelope.lower).all()
    assert ax.get_title() == "fitted map R1, update 1: closed form"


def test_the_worst_case_of_a_family_begins_with_its_first_interval(result, ax):
    auxiliary(result, ax, "phi", steps=True)
    (span,) = ax.patches
    assert np.allclose([span.get_x(), span.get_x() + span.get_width()], result.domains["fitted"].updates[0].worst[1, 1])
    assert r"$\eta_L$" in by_label(ax)
    sheets = auxiliary_sheets(result)
    assert [(sheet.name, len(sheet.panels)) for sheet in sheets] == [("auxiliary", 4), ("auxiliary-loose", 4)]


def test_a_generic_cobweb_without_a_cycle_is_not_drawn(result, ax):
    step = result.domains["fitted"].updates[0]
    wild = replace(step, generic=np.random.default_rng(0).uniform(0.6, 0.9, (400, 2)))
    domain = replace(result.domains["fitted"], updates=(wild,))
    envelopes(SimpleNamespace(domains={"fitted": domain}), ax, "v")
    assert "generic: no cycle" in by_label(ax)
    assert "its last 10 %" not in by_label(ax)


def test_the_second_iterate_of_part_2_is_the_worst_case(result, ax):
    """A hump x' = 0.8 - 3 (x - 0.35)^2: the worst case fixes p = xi_L(q) and q = 0.8, the plain composite does not fix q."""
    hump = {(0,): Fraction("0.4325"), (1,): Fraction("2.1"), (2,): Fraction(-3)}
    domain = attracting_domain(PolyMap.of_monomials(("x",), {"x": hump}, [[-1, 1]]), [[-0.2, 0.9]], updates=2)
    study = SimpleNamespace(second_iterate=SimpleNamespace(domain="hump"))
    second_iterate(SimpleNamespace(domains={"hump": domain}, study=study, second_iterate=result.second_iterate), ax, "x")
    p, q = domain.updates[-1].worst[-1, 0]
    for name, fixed in (("lower of upper map, worst", p), ("upper of lower map, worst", q)):
        assert np.interp(fixed, *by_label(ax)[name].get_data()) == pytest.approx(fixed, abs=1e-3)


def test_an_update_that_is_not_trapped_shows_no_domain(result, ax):
    envelopes(result, ax, "v", domain="loose")
    assert ax.get_title() == "exact map, update 1, not trapped"
    assert not ax.patches
    assert "generic" not in by_label(ax)


def test_envelopes_of_an_update_that_was_not_made(result, ax):
    with pytest.raises(NsmapsError, match="no update at position 9; the domain has 5"):
        envelopes(result, ax, update=9)


def test_envelopes_show_the_first_second_and_last_update_of_every_domain(result):
    assert shown(result.domains["fitted"]) == [0, 1, 4]
    assert shown(result.domains["loose"]) == [0]
    assert [(sheet.name, len(sheet.panels)) for sheet in envelope_sheets(result)] == [("envelopes", 6), ("envelopes-loose", 2)]


def test_domain_size_has_a_line_a_domain_and_says_which_is_no_bound(result, ax):
    domain_size(result, ax, "phi")
    lines = by_label(ax)
    assert np.array_equal(lines["fitted map R1"].get_ydata(), result.domains["fitted"].sizes[:, 1])
    assert np.array_equal(lines["fitted map R1"].get_xdata(), np.arange(6))
    assert "exact map,\nnot trapped" in lines
    assert ax.get_ylabel() == r"width in $\phi$ (rad)"


def test_domain_size_is_logarithmic_over_decades_only(result, ax):
    sizes = np.concatenate([domain.sizes[:, 0] for domain in result.domains.values()])
    domain_size(result, ax, "v")
    assert (ax.get_yscale() == "log") == (sizes.max() > 30 * sizes.min())


@pytest.mark.parametrize(("update", "polynomial"), [(1, False), (-1, True)])
def test_second_iterate_meets_the_diagonal_at_p_and_q(result, ax, update, polynomial):
    second_iterate(result, ax, "v", update)
    lines = by_label(ax)
    p, q = result.domains["fitted"].updates[update].worst[-1, 0]
    for name, fixed in (("lower of upper map", p), ("upper of lower map", q)):
        x, y = lines[name].get_data()
        assert np.interp(fixed, x, y) == pytest.approx(fixed, abs=1e-4)
    assert ("polynomial, degree 1" in lines) == polynomial
    assert ax.get_ylabel() == "$v_{k+2}$ (dimensionless)"


def test_second_iterate_polynomial_is_of_its_own_coordinate_only(result, ax):
    second_iterate(result, ax, "phi")
    assert not any(name.startswith("polynomial") for name in by_label(ax))


def test_a_coordinate_that_is_not_there(result, ax):
    with pytest.raises(NsmapsError, match="no coordinate 'w'; accepted: v, phi"):
        cobweb(result, ax, "w")
