"""Many returns in parallel are those of each state by itself, whatever is computed beside it."""

import numba
import numpy as np
import pytest
from hybrid import SYSTEMS, numbers, reference, system

from nsmaps.exact.modes.blocks.batch_scheduler import FEW
from nsmaps.exact.outcome import Outcome
from nsmaps.plugins import system_class

CASES = [(name, key) for name in SYSTEMS for key in reference(name)["parameters"]]


def starts(name, key, count):
    given = reference(name)
    rows = np.array([numbers(row["start"]) for row in given["returns"] if row["params"] == key])
    made = system(name, given["parameters"][key])
    return made, np.random.default_rng(2).uniform(rows.min(axis=0), rows.max(axis=0), (count, rows.shape[1]))


def by_itself(made, rows, derivative=False):
    """As `first_return`, with fewer states at a time than are computed in parallel."""
    parts = [made.first_return(rows[k : k + FEW - 1], derivative=derivative) for k in range(0, len(rows), FEW - 1)]
    return type(parts[0]).concatenate(parts)


@pytest.mark.parametrize(("name", "key"), CASES)
def test_many_returns_are_those_of_each_state_by_itself(name, key):
    made, rows = starts(name, key, 150)
    many, single, plain = made.first_return(rows, derivative=True), by_itself(made, rows, True), made.first_return(rows)
    assert many.outcome.tolist() == single.outcome.tolist()
    assert many.words.tolist() == single.words.tolist()
    size = 1 + np.abs(rows).max(axis=1) + np.abs(single.derivative).sum(axis=2).max(axis=1)
    off = np.abs(made.coordinates.difference(many.image, single.image)).max(axis=1) / size
    assert off[many.valid].max(initial=0.0) < 1e-13
    assert np.allclose(many.time, single.time, rtol=1e-10, equal_nan=True)
    assert np.array_equal(many.image, plain.image, equal_nan=True)
    slopes_apart = np.abs(many.derivative - single.derivative).max(axis=(1, 2))[many.valid]
    assert (
        slopes_apart < 1e-13 * size[many.valid] ** 2
    ).all()  # beside a graze they change by their square times an image's error
    assert not many.valid.any() or np.median(slopes_apart / size[many.valid]) < 1e-14
    assert np.isnan(many.derivative[~many.valid]).all()


@pytest.mark.parametrize(("name", "key"), CASES)
def test_many_derivatives_by_parameters_are_those_of_each_state_by_itself(name, key):
    made, rows = starts(name, key, 2 * FEW)
    valid = made.first_return(rows).valid
    for parameter in made.parameter_names():
        rates = {parameter: 1.0}
        single = np.concatenate([made.sensitivity(rows[: FEW - 1], rates), made.sensitivity(rows[FEW - 1 :][: FEW - 1], rates)])
        many, known = made.sensitivity(rows, rates)[: len(single)], valid[: len(single)]
        assert np.array_equal(np.isfinite(many).all(axis=1), known)
        size = 1 + np.abs(single[known]).max(axis=1, initial=0)
        assert (np.abs(many - single)[known].max(axis=1, initial=0) < 1e-12 * size**2).all()


def test_images_of_an_orbit_have_derivatives_of_their_own_return():
    made, rows = starts("S1_recoil", "p1", 40)
    orbits, again = made.orbits(rows, 3, derivative=True), by_itself(made, rows, True)
    for _ in range(2):
        again = by_itself(made, again.image, True)
    apart = np.abs(orbits.derivative[-len(rows) :] - again.derivative).max(axis=(1, 2))
    size = np.abs(again.derivative).max(axis=(1, 2))
    assert np.isfinite(size).sum() > 30
    assert np.nanmedian(apart / size) < 1e-12


@pytest.mark.parametrize(("name", "key"), [("S1_recoil", "p2"), ("S3_stickslip", "A025"), ("S5_buck", "E26")])
def test_a_return_does_not_depend_on_those_beside_it(name, key):
    made, rows = starts(name, key, 700)
    order = np.random.default_rng(3).permutation(len(rows))
    there, again = made.first_return(rows), made.first_return(rows[order][:300])
    assert np.array_equal(there.image[order][:300], again.image, equal_nan=True)
    assert np.array_equal(there.codes[order][:300], again.codes)


@pytest.mark.parametrize(
    ("name", "key"), [("S1_recoil", "p2"), ("S2_bilinear", "w085"), ("S3_stickslip", "A025"), ("S5_buck", "E26")]
)
def test_starts_outside_of_the_domain_are_told_from_those_beside_them(name, key):
    made, rows = starts(name, key, 64)
    rows[::5, 0], rows[1::5, -1], rows[2::10] = np.nan, 1e9, -rows[2::10]
    many, single = made.first_return(rows), by_itself(made, rows)
    assert many.outcome.tolist() == single.outcome.tolist()
    assert many.words.tolist() == single.words.tolist()
    assert np.array_equal(np.isnan(many.image), np.isnan(single.image))
    assert (many.outcome[::5] == Outcome.invalid).all()


def test_orbits_in_parallel_end_where_each_ends():
    made, rows = starts("S4_rocking", next(iter(reference("S4_rocking")["parameters"])), 200)
    many = made.orbits(rows, 4)
    single = [made.orbits(row[None], 4) for row in rows]
    outcomes = np.array([one.outcome for one in single]).T.ravel()
    assert len(set(outcomes.tolist())) > 1
    assert many.outcome.tolist() == outcomes.tolist()


def test_tables_of_all_systems_are_of_one_type() -> None:
    """The engine is compiled for the types of the tables: once, whatever the numbers of modes, states and harmonics."""
    found = set()
    for name in ("belt", "buck_converter", "recoil_pair", "rocking_block", "soft_impact", "two_masses"):
        made = system_class(name)
        tables = made(**dict.fromkeys(made.parameter_names(), 0.5))._kernel().table
        found.add(str(numba.typeof(tables)))
    assert len(found) == 1
