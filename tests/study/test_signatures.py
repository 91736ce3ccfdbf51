"""The keys of a section are the arguments of its public function: the same names in the same order with the same defaults."""

from collections.abc import Callable, Mapping
from inspect import Parameter, isfunction, signature
from typing import Any, NamedTuple

import pytest
from pydantic.fields import FieldInfo

import nsmaps
from nsmaps.proof.horseshoe import prove_horseshoe
from nsmaps.proof.prove import prove
from nsmaps.study.study import Study

RUN = {"system", "parallel", "progress", "of"}  #: arguments that the study, its system and its run give
SWEEP = {"low", "high", "points"}  #: values of a parameter, in a file as `from`, `to` and `points`


class Call(NamedTuple):
    """A public function, and where a section legitimately differs from it."""

    function: Callable[..., Any]
    more: str = ""  #: keys that are no arguments: of several maps, of what is claimed, or of steps before and after the call
    less: str = ""  #: arguments that are no keys, apart from `RUN`
    defaults: str = ""  #: keys with another default, or with one where the function has none


CALLS = {
    "diagonal": Call(nsmaps.NearDiagonal, "family sweep shown orders deltas grid"),
    "partition": Call(nsmaps.Partition),
    "parametric_map": Call(nsmaps.parametric_map, "n_nodes compare require", "composites", "degree"),
    "orbits": Call(nsmaps.orbit, "start track", "starts how"),
    "bifurcation_diagram": Call(nsmaps.bifurcation_diagram, "map", "values borders"),
    "branches": Call(
        nsmaps.continue_branch, "name start period chatter n_doublings", "orbit max_points until tolerance", "value direction"
    ),
    "parameter_plane": Call(nsmaps.parameter_plane, "bifurcation_curves"),
    "lyapunov": Call(nsmaps.lyapunov, "", "values", "parameter starts"),
    "basins": Call(nsmaps.basins, "boundary map", "attractors", "starts"),
    "global_continuation": Call(nsmaps.global_continuation, "", "values scale"),
    "manifolds": Call(nsmaps.manifold, "name start period scale", "orbit inverse", "which"),
    "observe": Call(nsmaps.observe, "", "orbits transient n_batches chatter rates"),
    "optimize": Call(nsmaps.optimize, "noisy", "guess"),
    "estimate": Call(nsmaps.estimate, "", "profile"),
    "basin_distance": Call(nsmaps.estimation.basin_distance, "", "estimate"),
    "noise": Call(
        nsmaps.noisy_orbits,
        "start sigma tau scale modes map min_returns impacts",
        "starts noise chatter max_impacts",
        "n_returns n_realisations",
    ),
    "domains": Call(nsmaps.attracting_domain, "name map require", "n_samples tolerance error around max_seconds"),
    "second_iterate": Call(
        nsmaps.symbolic.second_iterate, "domain updates", "polynomial phi_min phi_max held variable piece coordinates"
    ),
    "morse_sets": Call(nsmaps.cells.morse_sets, "require"),
    "exit_times": Call(nsmaps.cells.exit_times, "max_period", "regions target cycles"),
    "proof": Call(prove, "closed_set", "around", "top"),
    "horseshoe": Call(prove_horseshoe),
}
#: sections without one public function: what is returned, and the steps of the algorithm of the paper
STEPS = {"grid", "families", "slices", "composite", "auxiliary_map"}


def fields_of(key: str) -> Mapping[str, FieldInfo]:
    """The keys of a section, or of an entry of one that is a list."""
    fields = Study.kinds()[key].model_fields  # type: ignore[attr-defined]
    return fields["root"].annotation.__args__[0].model_fields if "root" in fields else fields


def default_of(given: Any) -> Any:
    """The default of a key or an argument, `Parameter.empty` without one, None for an empty one, as of no quantifiers."""
    if isinstance(given, Parameter):
        return None if given.default in ((), {}, []) else given.default
    value = Parameter.empty if given.is_required() else given.get_default(call_default_factory=True)
    return None if value in ((), {}, []) else value


def test_every_section_has_its_function_here() -> None:
    assert [key for key in Study.kinds() if key not in STEPS] == list(CALLS)


@pytest.mark.parametrize("key", CALLS)
def test_keys_are_arguments(key: str) -> None:
    call, fields = CALLS[key], fields_of(key)
    arguments = signature(call.function).parameters
    assert set(fields) - set(arguments) - SWEEP == set(call.more.split())
    assert set(arguments) - set(fields) - RUN == set(call.less.split())
    assert [name for name in fields if name in arguments] == [name for name in arguments if name in fields], "their order"
    both = [name for name in fields if name in arguments]
    assert both
    other = [name for name in both if default_of(fields[name]) != default_of(arguments[name])]
    assert set(other) == set(call.defaults.split())


def test_maps_have_one_name_among_arguments() -> None:
    rooms = [nsmaps, *(getattr(nsmaps, room) for room in ("auxiliary", "cells", "dynamics", "reduced", "symbolic"))]
    public = {name: getattr(room, name) for room in rooms for name in dir(room) if not name.startswith("_")}
    taken = {name: list(signature(each).parameters) for name, each in public.items() if isfunction(each)}
    assert len(taken) > 40
    assert not [name for name, arguments in taken.items() if "return_map" in arguments]
    assert not [name for name, arguments in taken.items() if "system" in arguments[1:]]
