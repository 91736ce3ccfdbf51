"""The equations of a system with modes as a LaTeX document: modes, sliding and contact among them, events, resets and section."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sympy as sp

from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.modes.definitions.build import DEGREE, STEP
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.kernel import known_definition
from nsmaps.exact.systems.guards import Guard, PoincareSection, SlidingSurface
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import choices_of
from nsmaps.exports.equations.letters import letters_beside
from nsmaps.exports.languages.latex import aligned, math, number, page, terms_of, text


def mode_files(system: HybridSystem, name: str | None = None) -> dict[str, str]:
    """The document, by file name, from the formulas that the map itself is derived from."""
    cls = type(system)
    noise = {cls.noise: sp.Symbol(cls.noise, real=True)} if cls.noise else {}
    definition = known_definition(system, driven=bool(noise))
    parameters = {name: sp.Symbol(name, real=True) for name in cls.parameter_names()}
    y = {name: sp.Symbol(name, real=True) for name in cls.states}
    symbolic, states = cls.model_construct(**parameters, **choices_of(system)), cls._arguments(y | noise)
    own = letters_beside([*parameters, *cls.states, *noise])
    time = sp.Symbol(own["time"], real=True)
    guards, section = symbolic.guards(time, states), symbolic.section(time, states)
    values = ", ".join(f"${math(name)} = {number(getattr(system, name))}$" for name in parameters)
    period = symbolic.period()
    body = [
        f"Parameters: {values}." if values else "",
        f"The forcing has the period ${own['period']} = {math(sp.sympify(period))}$." if period is not None else "",
        "In each mode the states follow differential equations.",
        f"The noise is ${math(noise[cls.noise])}$, zero in the return map." if noise else "",
        *_modes(definition, symbolic.modes(time, states), [*parameters.values()], [*y.values()], [*noise.values()], time),
        "An event takes place where its function falls through zero; states just after it have a plus sign.",
        *(row for name, guard in guards.items() for row in _event(name, guard, own["function"])),
        _section(section, cls.states),
    ]
    return {f"{name or cls.__name__.lower()}.tex": page(f"The equations of {text(cls.__name__)}", filter(None, body))}


def _modes(
    definition: Definition,
    stated: Mapping[str, Mapping[str, Any]],
    parameters: Sequence[sp.Symbol],
    states: Sequence[sp.Symbol],
    noise: Sequence[sp.Symbol],
    time: sp.Symbol,
) -> Iterator[str]:
    """The equations of every mode, those that are derived among them; the noise, none or one, follows the states.

    Those of a mode that kinks divide are as `stated`, or one part after another.
    """
    driven = [*noise, *(STEP**k * _dotted(one, k) for one in noise for k in range(1, DEGREE + 1))]
    step = [STEP] if noise else []
    plain = dict(zip((*definition.symbols, *definition.variables), (*parameters, *step, *states, *driven), strict=True))
    clock = {PHI: (definition.phase_rate * time).xreplace(plain)}
    for mode, parts in _parts(definition).items():
        divided = len(parts) > 1 and mode in stated
        for rates in parts[: 1 if divided else None]:
            yield f"Mode {text(mode)}:"
            for state, rate in zip(states, rates, strict=False):  # not those of the noise, which come last
                shown = sp.sympify(stated[mode][str(state)]) if divided else rate.xreplace(plain).xreplace(clock)
                yield aligned(rf"\dot {{{math(state)}}}", terms_of(shown))


def _parts(definition: Definition) -> dict[str, list[tuple[sp.Expr, ...]]]:
    """The rates of all states in the parts of each mode, those that differ."""
    found: dict[str, list[tuple[sp.Expr, ...]]] = {}
    rows = [tuple(sp.expand(row.of(definition.columns)) for row in mode) for mode in definition.rates]
    for mode, rates in zip(definition.modes, definition.smooth or rows, strict=True):
        known = found.setdefault(mode, [])
        known += [rates] * (rates not in known)
    return found


def _dotted(noise: sp.Symbol, k: int) -> sp.Symbol:
    """The derivative of order k of the noise, as it is written."""
    return sp.Symbol(rf"{math(noise)}^{{({k})}}", real=True)


def _event(name: str, guard: Guard | SlidingSurface, letter: str) -> Iterator[str]:
    """The function of an event, when it takes place, and what follows."""
    function = sp.sympify(guard.function)
    if isinstance(guard, SlidingSurface):
        above, below = text(guard.above), text(guard.below)
        yield (
            f"Between the modes {above}, where the following function is positive, and {below} the motion crosses its zero, or "
            f"slides along it in the mode {text(name)} while both lead to it:"
        )
        yield aligned(letter, terms_of(function))
        return
    yield f"Event {text(name)} in {' and '.join(map(text, guard.watched))}{_after(guard)}:"
    yield aligned(letter, terms_of(function))
    for condition in guard.where:
        yield f"It takes place where ${math(sp.sympify(condition))} \\geq 0$."
    yield from _reset(guard.reset)


def _after(guard: Guard) -> str:
    """What follows an event."""
    ends = ", which ends the motion" if guard.ends else f", to the mode {text(guard.to)}" if guard.to else ""
    return ends + (f"; impacts that accumulate lead to the mode {text(guard.rests)}" if guard.rests else "")


def _reset(reset: Mapping[str, Any]) -> Iterator[str]:
    for state, given in reset.items():
        yield aligned(rf"{math(state)}^+", terms_of(sp.sympify(given)))


def _section(section: PoincareSection, states: Sequence[str]) -> str:
    """The section of the return map."""
    names = (section.guards,) if isinstance(section.guards, str) else tuple(section.guards)
    known = "".join(f", ${math(name)} = {math(sp.sympify(given))}$" for name, given in section.states.items())
    phase = "".join(f"; ${math(name)}$ is the phase of the forcing" for name in section.coordinates if name not in states)
    coordinates = ", ".join(math(name) for name in section.coordinates)
    events = " or ".join(map(text, names))
    return f"The return map leads from one event {events} to the next, just {section.side} it: $({coordinates})${known}{phase}."
