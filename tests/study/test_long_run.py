"""Lyapunov exponents, basins and noise in studies: as their functions have them, in folders and in numbers."""

import json
from pathlib import Path

import numpy as np
import pytest

from nsmaps import Axis, Grid, Noise, basins, lyapunov, noisy_orbits, read_result, run_study
from nsmaps.dynamics.attractors.basins import basin_boundary
from nsmaps.dynamics.noise.residence import residence

LONG_RUN = """\
system: ball
parameters: {a: 1.5, r: 0.5}
grid: {v: {from: 0.01, to: 2, points: 12}, phi: {from: 0, to: 2*pi*11/12, points: 12}}
lyapunov: {parameter: a, from: 1.4, to: 1.5, points: 2, starts: [{v: 1, phi: 1}], n_returns: 64, transient: 30}
basins: {max_returns: 300, boundary: 1e-3}
noise:
  sigma: [0, 0.05]
  tau: 1
  start: {v: 1, phi: 1}
  n_returns: 40
  n_realisations: 3
  rng: 5
  modes: {one: [BB]}
  impacts: {parameter: a, from: 1.45, to: 1.5, points: 2, sigma: 0.05, n_returns: 5, transient: 5}
figures: [lyapunov, basins, noise]
"""


@pytest.mark.thorough
def test_a_study_gives_what_the_functions_give() -> None:
    Path("long.yaml").write_text(LONG_RUN)
    result = run_study("long.yaml", out="long")
    again = read_result("long")
    system, start = result.system, [1.0, 1.0]
    grid = Grid(axes={"v": Axis(low=0.01, high=2, points=12), "phi": Axis(low=0, high=2 * np.pi * 11 / 12, points=12)})
    made = basins(system, grid, max_returns=300)
    line = basin_boundary(system, made, tolerance=1e-3, max_returns=300)
    exponents = [lyapunov(system.at(a=a), starts=start, n_returns=64, transient=30).exponents for a in (1.4, 1.5)]
    noisy = noisy_orbits(system, start, Noise(sigma=0.05, tau=1), n_returns=40, n_realisations=3, rng=5)
    stay = residence(noisy.words, noisy.time, {"one": ["BB"]})
    for each in (result, again):
        assert np.array_equal(each.basins.label, made.label)
        assert np.array_equal(each.basin_boundary.points, line.points)
        assert np.array_equal(each.lyapunov.exponents, exponents, equal_nan=True)
        assert np.array_equal(each.noise.stays[1].time, stay.time)
        assert [(d.direction, d.noise.sigma) for d in each.noise.impacts] == [
            ("down", 0),
            ("down", 0.05),
            ("up", 0),
            ("up", 0.05),
        ]
    numbers = json.loads(Path("long/result.json").read_text())["numbers"]
    assert [row["fraction"] for row in numbers["basins"]["attractors"]] == made.fractions[:-2].tolist()
    assert [row["distance"] for row in numbers["basins"]["attractors"]] == [line.distance(k) for k in range(len(made.attractors))]
    assert len(made.attractors) > 1
    assert numbers["noise"][1]["time"] == stay.time.tolist()
    assert len(numbers["lyapunov"]["exponents"]) == 2


def test_basins_have_a_grid_of_their_own() -> None:
    grid = "{v: {from: 0.1, to: 1, points: 3}, phi: {from: 0, to: 1, points: 2}}"
    Path("own.yaml").write_text(f"system: ball\nparameters: {{a: 0.2}}\nbasins: {{max_returns: 20, starts: {grid}}}\n")
    result = run_study("own.yaml", out="own")
    assert result.returns is None
    assert read_result("own").basins.label.shape == (6,)
    assert result.basins.grid.states().tolist()[-1] == [1, 1]


def test_sections_that_are_not_named_are_not_computed() -> None:
    Path("none.yaml").write_text("system: ball\nparameters: {a: 0.2}\n")
    result = run_study("none.yaml")
    assert (result.lyapunov, result.basins, result.basin_boundary, result.noise) == (None, None, None, None)
