"""Whether the pieces of a map given by formulas are those of a map: conditions, images, borders, angles and an inverse."""

import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import sympy as sp
from sympy.core.relational import Relational

from nsmaps.arrays import Floats
from nsmaps.coordinates import TWO_PI, is_angle
from nsmaps.errors import CheckError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.piecewise.formulas import Choices, PieceFormulas, formulas_of
from nsmaps.exact.returns import Returns
from nsmaps.exact.systems.piecewise import PiecewiseMap

PLACES = 3  #: states beside which borders are looked for
BESIDE = sp.Rational(1, 10**6)  #: distance from a border of what is on either side of it
SAME = 1e-6  #: of a state and the preimage of its image, relative to the larger of both and 1


def check_pieces(system: PiecewiseMap, returns: Returns, chosen: bool) -> None:
    """Refuse pieces that are not those of a map by their returns of trial states, which are `chosen` by the user or not."""
    formulas = formulas_of(Choices.of(system))
    _check_use(system, formulas)
    _check_order(system, formulas)
    _check_images(system, returns)
    _check_cover(system, returns, chosen)
    _check_borders(system, formulas, returns)
    _check_circles(system, formulas, returns.start)
    _check_inverse(system, returns)


def _check_use(system: PiecewiseMap, formulas: PieceFormulas) -> None:
    """Every parameter is in a formula."""
    used = set[Any]().union(*(each.free_symbols for row in (formulas.conditions, *formulas.images) for each in row))
    for symbol, name in zip(formulas.symbols, system.parameter_names(), strict=True):
        if symbol not in used:
            raise CheckError(f"no formula of {type(system).__name__} has its parameter {name!r}; expected: a use, or none such")


def _check_order(system: PiecewiseMap, formulas: PieceFormulas) -> None:
    """Every piece can apply: none follows a piece whose condition is True, and no condition is False."""
    for k, condition in enumerate(formulas.conditions):
        if condition == sp.true and k < len(formulas.letters) - 1:
            after = ", ".join(map(repr, formulas.letters[k + 1 :]))
            raise CheckError(
                f"the condition of the piece {formulas.letters[k]!r} of {type(system).__name__} is True, so that {after} "
                "after it never applies; expected: the piece with True as the last one"
            )
        if condition == sp.false:
            raise CheckError(f"the condition of the piece {formulas.letters[k]!r} of {type(system).__name__} is never true")


def _check_images(system: PiecewiseMap, returns: Returns) -> None:
    """Images are finite wherever the condition of a piece holds."""
    lost = np.flatnonzero(returns.outcome == Outcome.escaped)
    if lost.size:
        state = ", ".join(
            f"{name} = {value:.4g}" for name, value in zip(returns.coordinates, returns.start[lost[0]], strict=True)
        )
        raise CheckError(
            f"{lost.size} of {len(returns)} states of {type(system).__name__} are in a piece that has no finite image there, "
            f"such as ({state}); expected: conditions under which the formulas of a piece are real and finite, or other `states`"
        )


def _check_cover(system: PiecewiseMap, returns: Returns, chosen: bool) -> None:
    """Every state is in a piece, and every piece has states: an error of states that were chosen, else a warning."""
    name, letters = type(system).__name__, system.letters
    out = np.flatnonzero(returns.outcome == Outcome.uncovered)
    if out.size:
        state = ", ".join(f"{x} = {value:.4g}" for x, value in zip(returns.coordinates, returns.start[out[0]], strict=True))
        text = f"{out.size} of {len(returns)} states of {name} are in no piece, such as ({state})"
        if chosen:
            raise CheckError(f"{text}; expected: a last piece whose condition is True, or `states` and `box` within the pieces")
        warnings.warn(f"{text}; their orbits end there as `uncovered`", stacklevel=4)
    if none := [letter for letter in letters if not returns.has_word(letter).any()]:
        found = ", ".join(map(repr, none))
        warnings.warn(f"no state of {len(returns)} of {name} is in the piece {found}; give `states` or `box` there", stacklevel=4)


def _check_borders(system: PiecewiseMap, formulas: PieceFormulas, returns: Returns) -> None:
    """Warn of borders that are in no piece although both sides are, and of borders at which a derivative is not finite."""
    name, seen = type(system).__name__, set[str]()
    known = zip((*formulas.variables, *formulas.symbols), (*system.coordinates, *system.parameter_names()), strict=True)
    shown = {symbol: sp.Symbol(str(text)) for symbol, text in known}
    for relation, at in _border_states(system, formulas, returns):
        there = str(relation.subs(shown))
        if there in seen:
            continue
        state = np.array([[float(at[variable]) for variable in formulas.variables]])
        if not _covered(formulas, at):
            seen.add(there)
            text = f"states with equality in {there} are in no piece of {name}, although both sides are"
            warnings.warn(f"{text}; expected: one of the relations with <= or >=, unless orbits are to end there", stacklevel=4)
            continue
        found = system.first_return(state, derivative=True)
        if found.valid[0] and found.derivative is not None and not np.isfinite(found.derivative).all():
            seen.add(there)
            text = f"the derivative of {name} is not finite where equality holds in {there}, as of a square root"
            warnings.warn(f"{text}; cycles through that border have no multipliers", stacklevel=4)


def _border_states(system: PiecewiseMap, formulas: PieceFormulas, returns: Returns) -> Iterator[tuple[Any, dict[Any, Any]]]:
    """Relations of conditions that are linear in a coordinate, with states at equality both sides of which are in pieces."""
    values = {symbol: sp.Rational(value) for symbol, value in zip(formulas.symbols, system.parameters.values(), strict=True)}
    relations = dict.fromkeys(each for condition in formulas.conditions for each in condition.atoms(Relational))
    for relation in relations:
        gap = (relation.lhs - relation.rhs).subs(values)
        for variable in sorted(gap.free_symbols, key=str):
            slope = sp.diff(gap, variable)
            if slope == 0 or slope.has(variable):
                continue
            for state in returns.start[:PLACES]:
                at = {
                    each: sp.Rational(round(float(x), 3)).limit_denominator(1000)
                    for each, x in zip(formulas.variables, state, strict=True)
                }
                at[variable] = variable - gap / slope
                at[variable] = sp.simplify(at[variable].subs({k: v for k, v in at.items() if k != variable}))
                beside = [{**at, variable: at[variable] + side} for side in (-BESIDE, BESIDE)]
                fixed = {**at, **values}
                if fixed[variable].is_real and all(_covered(formulas, {**each, **values}) for each in beside):
                    yield relation, fixed


def _covered(formulas: PieceFormulas, at: Mapping[Any, Any]) -> bool:
    """Whether a state is in a piece, in exact numbers."""
    return any(condition.subs(at) == sp.true for condition in formulas.conditions)


def _check_circles(system: PiecewiseMap, formulas: PieceFormulas, states: Floats) -> None:
    """Warn of a coordinate that is not an angle although the map is the same a whole turn further and has sines of it."""
    functions = [
        f
        for row in (*formulas.conditions, *(sp.Tuple(*image) for image in formulas.images))
        for f in row.atoms(sp.sin, sp.cos, sp.tan)
    ]
    here = system.first_return(states)
    for k, (name, variable) in enumerate(zip(system.coordinates, formulas.variables, strict=True)):
        if is_angle(name) or not any(f.has(variable) for f in functions):
            continue
        further = np.array(states)
        further[:, k] += TWO_PI
        there = system.first_return(further)
        moved = (there.image - here.image)[here.valid & there.valid]
        turns = np.rint(moved[:, k] / TWO_PI)
        moved[:, k] -= TWO_PI * turns
        size = 1e-9 * (1 + np.abs(states).max())
        if len(moved) and np.array_equal(there.codes, here.codes) and (np.abs(moved) <= size).all():
            warnings.warn(
                f"the map {type(system).__name__} is the same a whole turn further in {name!r}, which is not an angle; expected: "
                f'Angle("{name}") among its coordinates, if states a turn apart are one state',
                stacklevel=4,
            )


def _check_inverse(system: PiecewiseMap, returns: Returns) -> None:
    """The preimages that a class gives are those of its images."""
    if type(system).preimages is PiecewiseMap.preimages:
        return
    images = returns.select(returns.valid).image
    back = system.inverse().first_return(images)
    again = system.first_return(back.image)
    known = np.flatnonzero(back.valid)
    size = np.maximum(np.maximum(np.abs(images), np.abs(back.image)).max(axis=1), 1.0)
    off = np.abs(returns.coordinates.difference(again.image, images)).max(axis=1) / size
    wrong = known[~(off[known] <= SAME)]
    if wrong.size or not known.size:
        row = int(wrong[0]) if wrong.size else 0
        raise CheckError(
            f"`preimages` of {type(system).__name__} leads from {images[row]} to {back.image[row]}, whose image is "
            f"{again.image[row]}; expected: the state whose image it is, in the piece of each letter"
        )
