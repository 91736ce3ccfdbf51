"""Every public name with a system of modes gives a result, or an error that says what is expected; so do batches of no states."""

import pickle
from collections.abc import Callable
from functools import cache
from typing import Any

import exported
import numpy as np
import pytest
from messages import message
from nsmaps_recoil_pair import RecoilPair
from nsmaps_soft_impact import SoftImpact
from nsmaps_vi_pair import VIPair

import nsmaps
from nsmaps.errors import NsmapsError
from nsmaps.parallel import fingerprint

PLANAR = SoftImpact(xi=0.05, e=0.3, a=0.7, beta=29, w=0.8)
SPATIAL = RecoilPair(eta=0.05, kappa=0.04, Lambda=0.2, d=0.35, r=0.5, g_bar=0.2113)
IMPACT = VIPair(d=0.35, r=0.5, g_bar=0.2113)
STARTS = {PLANAR: [0.72, 1.32], SPATIAL: [0.84, 0.09, -0.67, 0.4]}
SWEPT = {PLANAR: "w", SPATIAL: "eta", IMPACT: "d"}
NAMES = ("v", nsmaps.Angle("phi"))
SECOND = {PLANAR: "a", SPATIAL: "d"}
SYSTEMS = pytest.mark.parametrize("system", [PLANAR, SPATIAL], ids=["planar", "spatial"])


def box(system: Any, half: float = 0.02) -> Any:
    """A small box about the start."""
    return [[x - half, x + half] for x in STARTS[system]]


def grid(system: Any) -> nsmaps.Grid:
    """Three points an axis in two coordinates, the others held."""
    sides = zip(system.coordinates, box(system), strict=True)
    varying = (system.coordinates[0], system.coordinates[-1])
    axes = {
        name: nsmaps.Axis(low=a, high=b, points=3) if name in varying else nsmaps.Axis.at((a + b) / 2) for name, (a, b) in sides
    }
    return nsmaps.Grid(axes=axes)


def along(system: Any) -> nsmaps.exact.Along:
    return nsmaps.exact.Along(system, SWEPT[system])


def plane(system: Any) -> nsmaps.exact.Along:
    return nsmaps.exact.Along(system, SWEPT[system], SECOND[system])


def values(system: Any) -> Any:
    return getattr(system, SWEPT[system]) * np.array([1.0, 1.001])


@cache
def near(system: Any) -> nsmaps.dynamics.PeriodicOrbit:
    return nsmaps.periodic_orbit(system, nsmaps.orbit(system, STARTS[system], 300).final)


@cache
def branch(system: Any) -> Any:
    low, high = values(system)
    return nsmaps.continue_branch(along(system), "p", near(system), float(low), (0.999 * low, high))


@cache
def settled(system: Any) -> nsmaps.dynamics.Basins:
    return nsmaps.basins(system, grid(system), max_returns=200)


@cache
def swept(system: Any) -> nsmaps.dynamics.BifurcationDiagram:
    return nsmaps.bifurcation_diagram(along(system), "p", values(system), STARTS[system], n_returns=4, transient=9)


@cache
def noisy(system: Any) -> Any:
    return nsmaps.noisy_orbits(system, STARTS[system], nsmaps.Noise(sigma=0.1, tau=1), n_returns=2, n_realisations=2)


@cache
def strips() -> nsmaps.reduced.StripMap:
    return nsmaps.reduced.strip_map(IMPACT, [[0.8, 0.81], [0.4, 0.41]], 1e-2)


#: a call with a system of each public name that can be given one
CALLS: dict[str, Callable[[Any], Any]] = {
    "Along": lambda s: along(s)(values(s)[1]),
    "CompleteChatter": lambda s: nsmaps.dynamics.CompleteChatter(s),
    "IteratedMap": lambda s: nsmaps.dynamics.IteratedMap(s, 2).first_return([STARTS[s]]),
    "ReturnMap": lambda s: isinstance(s, nsmaps.exact.ReturnMap),
    "FullAuxiliaryMap": lambda s: nsmaps.auxiliary.FullAuxiliaryMap(s, [box(s)]),
    "StripMap": lambda s: nsmaps.reduced.StripMap(s, None),
    "attracting_domain": lambda s: nsmaps.attracting_domain(s, box(s, 0.002), max_updates=1, n_samples=3),
    "basins": lambda s: nsmaps.basins(s, grid(s), max_returns=20),
    "bifurcation_curve": lambda s: nsmaps.bifurcation_curve(s, near(s), {SWEPT[s]: tuple(values(s)), SECOND[s]: (0.0, 1.0)}),
    "bifurcation_diagram": swept,
    "basin_boundary": lambda s: nsmaps.basin_boundary(s, settled(s), tolerance=0.01),
    "box_map": lambda s: nsmaps.cells.box_map(s),
    "period_doubling_cascade": lambda s: nsmaps.period_doubling_cascade(
        s, SWEPT[s], near(s), float(values(s)[0]), tuple(values(s)), direction="up", n_doublings=1
    ),
    "chatter_cascade": lambda s: nsmaps.dynamics.chatter_cascade(along(s), SWEPT[s], near(s), tuple(values(s)), 1),
    "parameter_plane": lambda s: nsmaps.parameter_plane(
        s,
        {SWEPT[s]: values(s), SECOND[s]: [getattr(s, SECOND[s])]},
        STARTS[s],
        n_returns=4,
        transient=9,
        max_period=2,
        observables=["work"],
    ),
    "forward_invariant_box": lambda s: nsmaps.cells.forward_invariant_box(s, box(s), n_cells=1),
    "match_attractors": lambda s: nsmaps.dynamics.match_attractors([swept(s)]),
    "compose_pieces": lambda s: nsmaps.symbolic.compose_pieces(s, ["R1"]),
    "conley_indices": lambda s: nsmaps.cells.conley_indices(s, box(s), depth=1),
    "continue_branch": branch,
    "curve_cycles": lambda s: nsmaps.symbolic.curve_cycles(s),
    "switch_branch": lambda s: nsmaps.switch_branch(s, SWEPT[s], s, tuple(values(s))),
    "exit_times": lambda s: nsmaps.cells.exit_times(
        s, {"all": nsmaps.ConditionRegion(text="v > 0", coordinates=s.coordinates)}, box(s), depth=0, n_cells=2
    ),
    "certificate_of": lambda s: nsmaps.proof.certificate_of(s, [near(s)]),
    "envelopes": lambda s: nsmaps.envelopes(s, box(s, 0.002), n_samples=3, bounds_kind="sampled"),
    "periodic_orbits_by_word": lambda s: nsmaps.dynamics.periodic_orbits_by_word(s, 1),
    "rotation_number": lambda s: nsmaps.rotation_number(s, STARTS[s], n_returns=4, transient=0),
    "staircase": lambda s: nsmaps.staircase(s, SWEPT[s], tuple(values(s)), STARTS[s], max_period=2, transient=4),
    "surfaces": lambda s: nsmaps.surfaces(s, grid(s), [nsmaps.WordFamily(name="any", words=(2 * s.letters[0],))]),
    "topological_entropy": lambda s: nsmaps.symbolic.topological_entropy(s),
    "track": lambda s: nsmaps.track(s, STARTS[s], 2),
    "export": lambda s: nsmaps.export(s, "latex"),
    "find_cycles": lambda s: nsmaps.cells.find_cycles(s, box(s), max_period=1, depth=0, n_cells=2),
    "global_continuation": lambda s: nsmaps.global_continuation(
        s, SWEPT[s], values(s), box(s), n_samples=4, max_returns=200, n_kicks=2, n_directions=2, n_states=1
    ),
    "symbolic_iterate": lambda s: nsmaps.symbolic.symbolic_iterate(s, 2),
    "lyapunov": lambda s: nsmaps.lyapunov(s, starts=STARTS[s], n_returns=32, transient=4),
    "manifold": lambda s: nsmaps.manifold(s, near(s), length=0.1),
    "morse_sets": lambda s: nsmaps.cells.morse_sets(s, box(s), depth=0, n_cells=2),
    "noisy_orbits": noisy,
    "observe": lambda s: [
        nsmaps.observe(s, STARTS[s], ["work"], n_returns=4, n_batches=2),
        nsmaps.observe(s, settled(s).attractors, ["work"], n_returns=64),
        nsmaps.observe(along(s), branch(s), ["work"]),
        nsmaps.observe(along(s), swept(s), ["work"], n_returns=64),
        nsmaps.observe(s, noisy(s), ["work"]),
        nsmaps.observe(s, near(s), ["work"]),
    ],
    "optimize": lambda s: nsmaps.optimize(
        s.at, "work", {SWEPT[s]: tuple(values(s))}, guess={SWEPT[s]: values(s)[0]}, start=near(s).states, n_guesses=1
    ),
    "orbit": lambda s: nsmaps.orbit(s, STARTS[s], 3),
    "partition": lambda s: nsmaps.partition(s, grid(s), nsmaps.Partition(tolerance=0.1)),
    "phase_portrait": lambda s: nsmaps.dynamics.phase_portrait(s, settled(s).attractors, n_points=200),
    "periodic_orbit": near,
    "periodic_orbits": lambda s: nsmaps.periodic_orbits(s, [STARTS[s]], 1),
    "second_iterate": lambda s: nsmaps.symbolic.second_iterate(s, 0.1, 0.2),
    "strip_map": lambda s: nsmaps.reduced.strip_map(s, box(s), 1e-2),
    "forward_invariant_set": lambda s: nsmaps.cells.forward_invariant_set(
        s, nsmaps.cells.morse_sets(s, box(s), depth=0, n_cells=2)
    ),
    "two_cycles": lambda s: nsmaps.symbolic.two_cycles(s),
}
PACKAGES = [
    nsmaps,
    *(getattr(nsmaps, name) for name in dir(nsmaps) if name not in (*nsmaps.__all__, "bench", "figures", "testing")),
]
PUBLIC = {name for package in PACKAGES for name in package.__all__}
#: public names that are no functions of a system: results, specs, names and the like
OTHERS = {name for name in PUBLIC if name[0].isupper() or name == "__version__"} - set(CALLS)
OTHERS |= {
    "build_composite",
    "chebyshev_nodes",
    "compare_orders",
    "diagonal_region",
    "parametric_map",
    "write_certificate",
    "basin_distance",
    "chatter_scaling",
    "estimate",
    "graze",
    "motions",
    "uncertainty",
    "hausdorff",
    "load_study",
    "load_system",
    "load_map",
    "array",
    "array_property",
    "read_result",
    "run_study",
    "show_versions",
    "systems",
}


def test_every_public_name_is_called_here_or_takes_no_system() -> None:
    assert set(CALLS) | OTHERS == PUBLIC


#: names that refuse a system with modes, or one of four coordinates, with a part of their reason
REFUSED = {
    "certificate_of": message("proof.not-proved"),
    "periodic_orbits_by_word": message("exact.no-formulas", what="cycles by their words"),
    "topological_entropy": message("exact.no-formulas", what="the entropy by kneading series"),
    "CompleteChatter": message("dynamics.no-rests"),
    "chatter_cascade": message("errors.cascade-from-no-event", cls="BifurcationPoint"),
    "bifurcation_curve": message("errors.curve-from-no-event", cls="BifurcationPoint"),
    "compose_pieces": message("errors.no-pieces", cls="CompositeMap or ParametricMap"),
    "curve_cycles": message("errors.no-second-iterate", cls="SecondIterate"),
    "switch_branch": message("errors.branch-from-no-event", cls="BifurcationPoint"),
    "symbolic_iterate": message("errors.no-closed-form", cls="PolyMap"),
    "manifold": message("dynamics.no-saddle"),
    "second_iterate": message("errors.no-closed-form", cls="PolyMap"),
    "two_cycles": message("errors.no-polynomials", cls="PolyMap"),
}
SPATIAL_REFUSED = {
    "strip_map": message("reduced.no-speed-and-phase", names="v, X, V, phi"),
    "forward_invariant_set": message("cells.no-components"),
    "manifold": message("dynamics.manifold-of-plane", number=4),
}


@SYSTEMS
@pytest.mark.parametrize("name", CALLS)
def test_a_system_with_modes_gives_a_result_or_a_clear_error(name: str, system: Any) -> None:
    if name == "conley_indices":
        pytest.importorskip("CMGDB")
    why = (REFUSED | (SPATIAL_REFUSED if system is SPATIAL else {})).get(name)
    if why is None:
        assert CALLS[name](system) is not None
    else:
        with pytest.raises(NsmapsError, match=why):
            CALLS[name](system)


@SYSTEMS
def test_a_system_is_sent_to_other_processes_and_has_a_fingerprint(system: Any) -> None:
    system.first_return([STARTS[system]])  # a compiled system is sent without its code
    sent = pickle.loads(pickle.dumps(system))
    assert sent == system
    assert np.array_equal(sent.first_return([STARTS[system]]).image, system.first_return([STARTS[system]]).image)
    assert fingerprint(sent) == fingerprint(system) == fingerprint(pickle.loads(pickle.dumps(along(system))).system)
    assert fingerprint(along(system)(values(system)[1])) != fingerprint(system)


#: batches of no states: the number of states of the result
EMPTY: dict[str, Callable[[Any, Any], int]] = {
    "first_return": lambda s, none: len(s.first_return(none, derivative=True)),
    "orbits": lambda s, none: len(s.orbits(none, 3, derivative=True)),
    "itineraries": lambda s, none: len(s.itineraries(none).codes),
    "sensitivity": lambda s, none: len(s.sensitivity(none, {SWEPT[s]: 1.0})),
    "image_boxes": lambda s, none: len(s.image_boxes(np.empty((0, none.shape[1], 2))).source),
    "IteratedMap": lambda s, none: len(nsmaps.dynamics.IteratedMap(s, 2).first_return(none, derivative=True)),
    "orbit": lambda s, none: nsmaps.orbit(s, none, 3).states.shape[1],
    "lyapunov": lambda s, none: len(nsmaps.lyapunov(s, starts=none, n_returns=32, transient=2).exponents),
    "basins": lambda s, none: len(nsmaps.basins(s, none, max_returns=9).label),
    "bifurcation": lambda s, none: nsmaps.bifurcation_diagram(
        along(s), "p", values(s), none, n_returns=4, transient=2
    ).states.shape[1],
    "periodic_orbits": lambda s, none: len(nsmaps.periodic_orbits(s, none, 1)),
}


@pytest.mark.parametrize("name", EMPTY)
@pytest.mark.parametrize("system", [PLANAR, SPATIAL, IMPACT], ids=["planar", "spatial", "impact"])
def test_no_states_have_no_results_and_no_error(name: str, system: Any) -> None:
    assert EMPTY[name](system, np.empty((0, len(system.coordinates)))) == 0


#: the same of maps, fits and regions in two coordinates
PLANE: dict[str, Callable[[Any], int]] = {
    "CompositeMap": lambda none: len(exported.composite().first_return(none, derivative=True)),
    "CompositeMap.orbits": lambda none: len(exported.composite().orbits(none, 3)),
    "CompositeMap.piece_of": lambda none: len(exported.composite().piece_of(none)),
    "PolyMap": lambda none: len(exported.composite().pieces[0].map(none)),
    "PolyMap.derivative": lambda none: len(exported.composite().pieces[0].map.derivative(none)),
    "Box": lambda none: len(nsmaps.Box(coordinates=NAMES, bounds={"v": (0, 1), "phi": (0, 1)}).contains(none)),
    "ConditionRegion": lambda none: len(nsmaps.ConditionRegion(text="v > phi", coordinates=NAMES).contains(none)),
    "image_boxes": lambda none: len(nsmaps.cells.box_map(exported.composite()).image_boxes(np.empty((0, 2, 2))).source),
    "orbit": lambda none: nsmaps.orbit(exported.composite(), none, 3).states.shape[1],
    "lyapunov": lambda none: len(nsmaps.lyapunov(exported.composite(), starts=none, n_returns=32, transient=2).exponents),
    "basins": lambda none: len(nsmaps.basins(exported.composite(), none, max_returns=9).label),
    "ParametricMap": lambda none: len(exported.parametric().at(exported.parametric().low).first_return(none)),
    "StripMap": lambda none: len(strips().first_return(none)),
    "StripMap.orbits": lambda none: len(strips().orbits(none, 3)),
}


@pytest.mark.parametrize("name", PLANE)
def test_maps_and_regions_take_no_states(name: str) -> None:
    assert PLANE[name](np.empty((0, 2))) == 0
