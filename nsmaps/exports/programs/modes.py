"""The first return of a system with modes, from `exact/modes`."""

from string import Template
from types import SimpleNamespace

import numpy as np

from nsmaps.coordinates import TWO_PI
from nsmaps.exact.modes.definitions.definition import Definition
from nsmaps.exact.modes.paths.placing import Surfaces
from nsmaps.exact.modes.tables.memory import memory
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.words import CHATTER, REST
from nsmaps.exports.engine.kinds import FLOAT, OPEN, Array, Record
from nsmaps.exports.programs.laws import reset_text
from nsmaps.exports.programs.program import FirstReturn
from nsmaps.exports.programs.section import first_return_from_section, return_of_row
from nsmaps.exports.programs.templates import MODES, Entry

MARGINS, PARAMETERS, TAYLOR = "margins", "moved", "piece"  #: parts of memory that first returns on affine flights do not use


def modes_return(system: HybridSystem) -> FirstReturn:
    """The first return of a system with modes at its parameters.

    Raises:
        NsmapsError: a reset has a function without a counterpart.
    """
    kernel = system._kernel().modes
    definition, n = kernel.definition, len(kernel.coordinates)
    laws = [*(one.curved for one in definition.transitions), *(start.curved for start in definition.starts)]
    curved = np.array([bool(law) for law in laws])
    resets, starts = np.split(np.cumsum(curved) * curved, [len(definition.transitions)])
    table = Record("p", kernel.table._replace(laws=resets, start_laws=starts), fixed=True)
    room = Record("memory", memory(kernel.table, OPEN), constant=(MARGINS, PARAMETERS), unused=(TAYLOR,))
    names = [str(name) for name in kernel.coordinates]
    known = (table, _surfaces(kernel.surfaces)) if kernel.surfaces else (table,)
    return FirstReturn(
        system=system,
        n=n,
        about=_about(definition, kernel.letters),
        coordinates=f"{', '.join(names)}; phases in [0, 2 pi)",
        letters=kernel.letters,
        outcomes=range(len(Outcome)),
        entry=first_return_from_section if kernel.surfaces else return_of_row,
        kinds=[*known, Array(FLOAT, (n,), fixed=True), Array(FLOAT, (n,)), Array(FLOAT, (n, OPEN)), room],
        memory=room,
        fixed=(*known, Record(PARAMETERS, room.value.moved, fixed=True)),
        own={"call_reset": ""},
        directions=n,
        texts=_entry(kernel.table.places.tolist()),
        laws=lambda language: reset_text([law for law in laws if law], definition, language) if any(laws) else "",
    )


def _surfaces(given: Surfaces) -> Record:
    """The surfaces of starts, filled up with zeros to as many functions each."""
    rows = np.zeros((len(given), max(map(len, given)), given[0].shape[1]))
    for k, each in enumerate(given):
        rows[k, : len(each)] = each
    return Record("surfaces", SimpleNamespace(rows=rows), fixed=True)


def _entry(places: list[int]) -> Entry:
    """How a first return is called that has coordinates in these places, -1 for the phase."""
    if -1 not in places:
        return _with_turns("0", "0", "0")
    k, known = places.index(-1), Outcome.invalid.value
    c = f"found.outcome == {known} ? 0 : got.m3 + (int64_t)floor(state[{k}] / {TWO_PI})"
    julia = f"got[1] == {known} ? 0 : got[4] + floor(Int64, row[{k + 1}] / {TWO_PI})"
    return _with_turns(c, julia, f"got.m0 === {known} ? 0 : got.m3 + floor(state[{k}] / {TWO_PI})")


def _with_turns(*turns: str) -> Entry:
    """The texts for C, Julia and JavaScript with the number of turns of the phase."""
    texts = (MODES.c, MODES.julia, MODES.javascript)
    return Entry(*(Template(text.safe_substitute(turns=each)) for text, each in zip(texts, turns, strict=True)))


def _about(definition: Definition, letters: tuple[str, ...]) -> list[str]:
    """What coordinates and words are."""
    events = " or ".join(dict.fromkeys(definition.transitions[start.transition].name for start in definition.starts))
    side = "after" if definition.after else "before"
    return [
        f"State: {', '.join(map(str, definition.coordinates))} just {side} the event {events}, in the system's units; "
        "phases in radians.",
        f"Words: a letter for each event ({', '.join(letters)}), {CHATTER} for chatter, {REST} for rest on a surface.",
    ]
