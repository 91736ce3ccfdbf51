"""The first return of an exact system as a program: functions of the engine around the numbers of the system."""

import ast
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from nsmaps.errors import NsmapsError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.flow import FlowSystem
from nsmaps.exact.words import CHATTER, REST, base_of_words
from nsmaps.exports.engine.c import CPrinter
from nsmaps.exports.engine.julia import JuliaPrinter
from nsmaps.exports.engine.kinds import Kind, Record
from nsmaps.exports.engine.printer import Printer
from nsmaps.exports.engine.records import c_constants, c_memory, julia_constants, julia_memory
from nsmaps.exports.program import own_version
from nsmaps.exports.programs import javascript
from nsmaps.exports.programs.helpers import HELPERS, JULIA_HELPERS
from nsmaps.exports.programs.laws import ALIASES
from nsmaps.exports.programs.templates import HEADER, MODULE, SOURCE, Entry

PUBLIC = ("of", "return", "batch", "word", "outcome")  #: behind the name of a program in C
AROUND = ("smaller", "larger", "whole_part", "whole_floor", "square_root", "word", "complex_number")  #: the engine's functions


@dataclass(frozen=True)
class FirstReturn:
    """The first return of one system, as the engine computes it."""

    system: FlowSystem
    n: int  #: coordinates
    about: list[str]  #: what they are
    coordinates: str  #: the same of an image, in short
    letters: tuple[str, ...]  #: of words
    outcomes: Sequence[int]  #: numbers of `Outcome` that occur
    entry: Any  #: the function of the engine
    kinds: list[Kind]  #: of its arguments
    memory: Record
    fixed: tuple[Record, ...]  #: what all its functions know
    own: dict[str, Kind]  #: what functions return that the program has of its own
    directions: int  #: of derivatives in memory
    texts: Entry
    laws: Callable[[str], str]  #: the functions of its own in a language


def program_files(what: FirstReturn, language: str, name: str) -> dict[str, str]:
    """The files of a program by their name. NsmapsError for a name that its tables or its memory have."""
    return {"c": _c_files, "julia": _julia_files, "javascript": _javascript_files}[language](what, name)


def _c_files(what: FirstReturn, name: str) -> dict[str, str]:
    printer = CPrinter(what.own, what.directions)
    known = _known(what, name, printer)
    about = _about(what)
    memory, start = c_memory(printer, what.memory)
    result = printer.structure(list(printer.functions.values())[-1].returns)
    constants = [printer.constant(*each) for each in printer.constants.items()]
    tables = [c_constants(printer, each) for each in (*what.fixed, what.memory)]
    complex_numbers = HELPERS["complex_number"] if "complex_number" in known["functions"] else ""
    helpers = [HELPERS[each] for each in printer.helpers]
    parts = ["\n".join(constants), *tables, complex_numbers, printer.structures_text(), memory, *helpers, what.laws("c")]
    known |= {
        "data": "\n\n".join(filter(None, parts)),
        "entry": what.texts.c.substitute(known, result=result, start=start),
        "about": "\n".join(f" * {line}".rstrip().replace("*/", "* /") for line in about),
        "guard": f"{name.upper()}_H",
        "title": about[0].replace("*/", "* /"),
    }
    return {f"{name}.h": HEADER.substitute(known), f"{name}.c": SOURCE.substitute(known)}


def _julia_files(what: FirstReturn, name: str) -> dict[str, str]:
    printer = JuliaPrinter(what.own)
    known = _known(what, name, printer)
    laws = what.laws("julia")
    constants = [printer.constant(*each) for each in printer.constants.items()]
    tables = [julia_constants(printer, each) for each in (*what.fixed, what.memory)]
    helpers = [JULIA_HELPERS[each] for each in printer.helpers]
    aliases = ALIASES if "pow(" in laws or "fabs(" in laws or "sqrt(" in laws or "log(" in laws else ""
    parts = ["\n".join(constants), *tables, julia_memory(printer, what.memory), aliases, *helpers, laws]
    known |= {
        "data": "\n\n".join(filter(None, parts)),
        "entry": what.texts.julia.substitute(known),
        "about": "\n".join(_about(what)).replace("\\", "\\\\").replace('"', '\\"').replace("$", "\\$"),
        "module": "".join(part.capitalize() for part in name.split("_")),
        "state": ", ".join(map(str, what.system.coordinates)),
    }
    return {f"{name}.jl": MODULE.substitute(known)}


def _javascript_files(what: FirstReturn, name: str) -> dict[str, str]:
    printer = javascript.JavaScriptPrinter(what.own)
    known = _known(what, name, printer)
    tables = [text for each in (*what.fixed, what.memory) for text in javascript.tables(printer, each)]
    laws, memory = what.laws("javascript"), javascript.memory(printer, what.memory)
    constants = [printer.constant(*each) for each in printer.constants.items()]
    helpers = [javascript.HELPERS[each] for each in dict.fromkeys(("smaller", "larger", *printer.helpers))]
    known |= {
        "data": "\n".join([*constants, *tables, *helpers, memory, laws]),
        "entry": what.texts.javascript.substitute(known),
        "about": "\n".join(_about(what)).replace("*/", "* /"),
    }
    return {f"{name}.js": javascript.SCRIPT.substitute(known)}


def _known(what: FirstReturn, name: str, printer: Printer) -> dict[str, Any]:
    """What the texts of both languages need."""
    printer.public = (name, *(f"{name}_{part}" for part in PUBLIC))
    printer.reach(ast.Name(what.entry.py_func.__name__), what.entry, what.kinds)
    functions = "\n".join(printer.texts())
    *_, first_return = printer.functions.values()
    records = {each.name for each in (*what.fixed, what.memory)}
    if clash := {*printer.public} & {*records, *what.own, *printer.helpers, *AROUND}:
        raise NsmapsError(f"the name {name!r}, by which the program would have {clash.pop()} twice; expected: another")
    letters = [*what.letters, CHATTER, REST]
    return {
        "name": name,
        "n": what.n,
        "coordinates": what.coordinates.replace("*/", "* /"),
        "functions": functions,
        "first_return": first_return.name,
        "letters": ", ".join(map(json.dumps, letters)),
        "base": base_of_words(what.letters),
        "chatter": SUMMED_SPEED,
        "names": ", ".join(json.dumps(each.name) for each in Outcome),
        "outcomes": ", ".join(f"{each.value} {each.name}" for each in Outcome if each.value in what.outcomes and each.value != 5),
        "outcome_count": len(Outcome),
    }


def _about(what: FirstReturn) -> list[str]:
    """What a program says of itself."""
    values = ", ".join(f"{name} = {value!r}" for name, value in what.system.parameters.items())
    return [
        f"The exact first return of {type(what.system).__name__}{f' at {values}' if values else ''}.",
        *what.about,
        "Flights are followed from event to event by the march of nsmaps, none of whose steps can pass one, in the same",
        f"order of floating-point operations. Written by nsmaps {own_version()}".rstrip() + ".",
    ]
