"""Wrong arguments of public functions: an error of nsmaps that names the argument, its value and what is expected."""

import inspect
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from messages import message
from nsmaps_soft_impact import SoftImpact

import nsmaps
from nsmaps.errors.arguments import checked


class Parabola(nsmaps.PiecewiseMap):
    """x' = a x (1 - x) + c."""

    coordinates = ("x",)
    a: float = 2.8
    c: float = 0.0

    def pieces(self, x: Any) -> Any:
        return {"P": (True, {"x": self.a * x.x * (1 - x.x) + self.c})}


MAP, PAIR, START, BOX = Parabola(), nsmaps.load_system("vi_pair", d=0.35, g_bar=0.2113), [0.6], [[0.1, 0.9]]
STATES = nsmaps.Grid(axes={"x": nsmaps.Axis(low=0.1, high=0.9, points=3)})
RETURNS = nsmaps.Grid(axes={"v": nsmaps.Axis(low=0.7, high=1, points=3), "phi": nsmaps.Axis(low=0.2, high=0.6, points=3)})
ORBIT = nsmaps.periodic_orbit(MAP, nsmaps.orbit(MAP, START, 200).final)
POINT = nsmaps.continue_branch(MAP, "a", ORBIT, 2.8, (2.7, 3.1)).events[0]
BASINS = nsmaps.basins(MAP, STATES, max_returns=200)
SHORT = {"n_returns": 64, "transient": 9}

#: the arguments of a call of each public function that is given a map, parameters or numbers
CALLS: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
    "attracting_domain": ((MAP, BOX), {"max_updates": 1, "tolerance": 0.01}),
    "basin_boundary": ((MAP, BASINS), {"max_returns": 50, "tolerance": 1e-3}),
    "basins": ((MAP, STATES), {"max_returns": 50, "tolerance": 1e-6, "max_period": 4}),
    "bifurcation_curve": ((MAP, POINT, {"a": (2.7, 3.1), "c": (-0.1, 0.1)}), {"step": 0.5, "max_points": 1}),
    "bifurcation_diagram": ((MAP, "a", [2.8, 2.9], START), {**SHORT, "direction": "up", "tolerance": 1e-6}),
    "continue_branch": ((MAP, "a", ORBIT, 2.8, (2.7, 2.9)), {"direction": "up", "step": 0.5, "max_points": 3}),
    "envelopes": ((MAP, BOX), {"n_samples": 3}),
    "global_continuation": ((MAP, "a", [2.8], BOX), {"n_samples": 2, "max_returns": 99, "kick": 0.01, "n_kicks": 1}),
    "lyapunov": ((MAP, "a", [2.8, 2.9], START), {**SHORT, "direction": "up"}),
    "manifold": ((MAP, ORBIT), {"which": "unstable", "length": 0.1, "gap": 0.1}),
    "noisy_orbits": ((MAP, START, nsmaps.Noise(sigma=0.01)), {"n_returns": 4, "n_realisations": 2}),
    "observe": ((MAP, START, ["x"]), {**SHORT, "n_batches": 2}),
    "optimize": ((MAP, "x", {"a": (2.7, 2.9)}, START), {"period": 1, "n_guesses": 1, "sense": "max"}),
    "orbit": ((MAP, START, 5), {}),
    "parameter_plane": ((MAP, {"a": [2.8, 2.9], "c": [0.0]}, START), {**SHORT, "max_period": 4, "tolerance": 1e-6}),
    "parametric_map": (({}, "a", (2.7, 2.9), 2), {}),
    "partition": ((PAIR, RETURNS, nsmaps.Partition(tolerance=0.1)), {}),
    "period_doubling_cascade": ((MAP, "a", ORBIT, 2.8, (2.7, 2.9)), {"n_doublings": 1, "step": 0.5}),
    "periodic_orbit": ((MAP, START, 1), {"tolerance": 1e-10}),
    "periodic_orbits": ((MAP, [START], 1), {"tolerance": 1e-10}),
    "rotation_number": ((MAP, START), SHORT),
    "staircase": ((MAP, "a", (2.7, 2.9), START), {"max_period": 1, "transient": 9}),
    "surfaces": ((PAIR, RETURNS, [nsmaps.WordFamily(name="any", words=("BTB",))]), {}),
    "switch_branch": ((MAP, "a", POINT, (2.7, 3.1)), {"step": 0.5, "max_points": 1, "doubled": True}),
    "track": ((PAIR, [0.8, 0.4], 3, 5), {}),
    "uncertainty": ((MAP, {"a": (2.7, 2.9)}, lambda system: system.a), {"n_draws": 2}),
    "cells.conley_indices": ((MAP, BOX), {"depth": 1}),
    "cells.find_cycles": ((MAP, BOX), {"max_period": 1, "depth": 0, "n_cells": 2}),
    "cells.forward_invariant_box": ((MAP, BOX), {"n_cells": 2}),
    "cells.morse_sets": ((MAP, BOX), {"depth": 0, "n_cells": 2}),
    "dynamics.hausdorff": (([[0.0]], [[1.0]], ("x",)), {}),
    "dynamics.match_attractors": (([],), {"tolerance": 0.03}),
    "dynamics.periodic_orbits_by_word": ((MAP, 1), {"tolerance": 1e-10}),
    "reduced.chebyshev_nodes": (((0.1, 0.2), 3), {}),
    "reduced.strip_map": ((PAIR, [[0.8, 0.81], [0.4, 0.41]], 0.01), {}),
}
WRONG = (None, "zz", 3, -1, 2.5, float("nan"), [1.0, 2.0, 3.0, 4.0, 5.0], object())


def function_of(name: str) -> Callable[..., Any]:
    """A public function of nsmaps or of a room."""
    found: Any = nsmaps
    for part in name.split("."):
        found = getattr(found, part)
    return found


def error_of(name: str, args: tuple[Any, ...], options: dict[str, Any]) -> Exception | None:
    """What a call raises."""
    try:
        function_of(name)(*args, **options)
    except Exception as error:
        return error
    return None


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_an_error_of_nsmaps(name: str) -> None:
    """Each argument in turn is None, a text, a number, a list of another length, NaN and an object."""
    args, options = CALLS[name]
    tried: list[tuple[Any, Exception | None]] = []
    for k in range(len(args)):
        tried += [(wrong, error_of(name, (*args[:k], wrong, *args[k + 1 :]), options)) for wrong in WRONG]
    for key in options:
        tried += [(wrong, error_of(name, args, options | {key: wrong})) for wrong in WRONG]
    errors = [(wrong, error) for wrong, error in tried if error is not None]
    assert len(errors) > len(tried) / 2
    assert [(wrong, repr(error)) for wrong, error in errors if not isinstance(error, nsmaps.NsmapsError)] == []


@pytest.mark.parametrize("name", CALLS)
def test_numbers_are_no_text_and_counts_are_not_negative(name: str) -> None:
    function, (args, options) = function_of(name), CALLS[name]
    names = list(inspect.signature(function).parameters)
    given = dict(zip(names, args, strict=False)) | options
    numbers = [key for key, value in given.items() if type(value) in (int, float)]
    for key in numbers:
        error = error_of(name, (), given | {key: "zz"})
        assert isinstance(error, nsmaps.NsmapsError)
        assert re.match(message("errors.value", name=key, value="'zz'", expected="a "), str(error))
    for key in (key for key in numbers if key.startswith(("n_", "max_", "tolerance"))):
        assert isinstance(error_of(name, (), given | {key: -1}), nsmaps.NsmapsError)


@pytest.mark.parametrize("rng", [-1, [1, -2]])
def test_numbers_that_seed_are_not_negative(rng: Any) -> None:
    expected = re.compile(".*, numbers of at least 0, as in noisy_orbits")
    with pytest.raises(nsmaps.NsmapsError, match=message("errors.value", name="rng", value=rng, expected=expected)):
        nsmaps.noisy_orbits(MAP, START, nsmaps.Noise(sigma=0.01), n_returns=4, n_realisations=2, rng=rng)


@pytest.mark.parametrize("name", [name for name, (args, _) in CALLS.items() if len(args) > 1 and name != "dynamics.hausdorff"])
def test_another_order_of_arguments_is_an_error_of_nsmaps(name: str) -> None:
    args, options = CALLS[name]
    for swapped in ((args[1], args[0], *args[2:]), (args[0], *args[1:3][::-1], *args[3:]) if len(args) > 2 else args[::-1]):
        error = error_of(name, swapped, options)
        assert isinstance(error, nsmaps.NsmapsError), repr(error)
        assert "expected" in str(error)


def test_an_unknown_parameter_and_the_order_are_named() -> None:
    ranges = {"a": (2.7, 3.1), "c": (-0.1, 0.1)}
    with pytest.raises(nsmaps.NsmapsError, match=message("errors.curve-from-no-event", given="dict", cls="Bif")):
        nsmaps.bifurcation_curve(MAP, ranges, POINT)
    with pytest.raises(
        nsmaps.NsmapsError,
        match=message(
            "errors.value", name="value", value="'zz'", expected="a number, as in continue_branch(system, parameter, orb"
        ),
    ):
        nsmaps.continue_branch(MAP, "a", ORBIT, "zz", (2.7, 2.9))
    for call in (nsmaps.bifurcation_diagram, nsmaps.lyapunov):
        with pytest.raises(nsmaps.NsmapsError, match=message("errors.no-such-near", kind="parameter", name="A", near="a")):
            call(MAP, "A", [2.8], START)


def test_what_fits_reaches_the_function_and_its_own_errors_stay() -> None:
    @checked
    def f(count: int, *, share: float = 0.5, names: "list[str] | None" = None, pair: tuple[float, float] = (0, 1)) -> Any:
        if share == 0:
            raise KeyError("raised by the test")
        return count, share, names, pair

    assert f(np.int64(3), share=np.float32(2), pair=np.array([0.0, 1.0]))[0] == 3
    assert f(3, names=["a"])[2] == ["a"]
    with pytest.raises(KeyError, match=message("others.raised")):
        f(3, share=0)
    with pytest.raises(TypeError, match=message("others.not-built", name="shares")):
        f(3, shares=1)
    for wrong in ({"count": 3.0}, {"count": True}, {"share": float("nan")}, {"pair": (0, 1, 2)}, {"pair": "ab"}):
        (key,) = wrong
        with pytest.raises(nsmaps.NsmapsError, match=message("errors.value", name=key)):
            f(**{"count": 1} | wrong)


def test_a_method_of_impact_systems_is_named_with_what_modes_have() -> None:
    system = SoftImpact(xi=0.05, e=0.3, a=0.7, beta=29, w=0.8)
    with pytest.raises(
        nsmaps.NsmapsError, match=message("exact.of-modes", name="impacts", system="SoftImpact", call="nsmaps.track(")
    ):
        system.impacts([0.72, 1.32], 3)
    assert not hasattr(system, "impacts")
    with pytest.raises(AttributeError, match=message("others.attribute", name="impact")):
        system.impact()
