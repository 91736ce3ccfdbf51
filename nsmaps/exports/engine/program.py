"""The first return of an impact system as a program: the engine's functions around the system's table."""

import json
from collections.abc import Callable, Sequence
from typing import Any

from nsmaps.errors import NsmapsError
from nsmaps.exact.chatter import SUMMED_SPEED
from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.returns import first_return
from nsmaps.exact.kernel import Kernel, closed_form_of
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.words import CHATTER, REST
from nsmaps.exports.engine.c import CPrinter
from nsmaps.exports.engine.julia import JuliaPrinter
from nsmaps.exports.engine.kinds import BOOL, FLOAT, FLOW
from nsmaps.exports.engine.laws import ALIASES, law_texts
from nsmaps.exports.engine.printer import Printer
from nsmaps.exports.engine.templates import HEADER, MODULE, SOURCE
from nsmaps.exports.program import own_version

ADDRESSES = (layout.LAW, layout.LAW_SLOPE, layout.BALL_LAW)  #: in a table, two each: of compiled laws, which a program has itself
ARGUMENTS = [FLOW, FLOAT, FLOAT, FLOAT, BOOL]


def first_return_files(system: ImpactSystem, format: str, name: str) -> dict[str, str]:
    """The files of the first return of a system at its parameters, by their name.

    Raises:
        NsmapsError: flights that are integrated, an impact law without a counterpart, or a name that the engine uses.
    """
    kernel = closed_form_of(system, "programs of the exact map")
    return WRITERS[format](kernel, name)


def _c_files(kernel: Kernel, name: str) -> dict[str, str]:
    printer = CPrinter({"rebound": (FLOAT, FLOAT)})
    known = _known(kernel, name, printer, law_texts(kernel, "p->table", 0), "p->table[{}]")
    about = "\n".join(f" * {line}".rstrip().replace("*/", "* /") for line in _about(kernel))
    known |= {
        "table": _rows([float(x).hex() for x in _table(kernel)]),
        "constants": "\n".join(f"#define {each} {printer.literal(value)}" for each, value in printer.constants.items()),
        "result": printer.structure(printer.functions["first_return"].returns),
        "structures": printer.structures_text(),
        "about": about,
        "guard": f"{name.upper()}_H",
        "title": _about(kernel)[0].replace("*/", "* /"),
    }
    return {f"{name}.h": HEADER.substitute(known), f"{name}.c": SOURCE.substitute(known)}


def _julia_files(kernel: Kernel, name: str) -> dict[str, str]:
    printer = JuliaPrinter({"rebound": (FLOAT, FLOAT)})
    laws = law_texts(kernel, "p.table", 1)
    known = _known(kernel, name, printer, laws, "p.table[{}]", 1)
    known |= {
        "table": _rows([repr(float(x)).replace("inf", "Inf") for x in _table(kernel)]),
        "constants": "\n".join(f"const {each} = {printer.literal(value)}" for each, value in printer.constants.items()),
        "about": "\n".join(_about(kernel)).replace("\\", "\\\\").replace('"', '\\"').replace("$", "\\$"),
        "module": "".join(part.capitalize() for part in name.split("_")),
        "aliases": f"{ALIASES}\n" if any(laws) else "",
    }
    return {f"{name}.jl": MODULE.substitute(known)}


WRITERS: dict[str, Callable[[Kernel, str], dict[str, str]]] = {"c": _c_files, "julia": _julia_files}


def _known(kernel: Kernel, name: str, printer: Printer, laws: Sequence[Any], entry: str, first: int = 0) -> dict[str, Any]:
    """What the texts of both languages need."""
    printer.reach("first_return", first_return, ARGUMENTS)
    functions = "\n".join(printer.texts())
    if clash := {name, f"{name}_of", f"{name}_return", f"{name}_batch", f"{name}_word", f"{name}_outcome"} & set(
        printer.functions
    ):
        raise NsmapsError(f"the name {name!r}, by which the program would have {clash.pop()} twice; expected: another")
    lower, upper = (
        ", ".join(law or (f"{entry} * v".format(place), entry.format(place)))
        for law, place in zip(laws, range(layout.RESTITUTION + first, layout.RESTITUTION + first + 2), strict=True)
    )
    letters = [*kernel.system.letters, CHATTER, REST]
    return {
        "name": name,
        "functions": functions,
        "lower": lower,
        "upper": upper,
        "flight": int(kernel.table[layout.FLIGHT_SIZE]),
        "letters": ", ".join(map(json.dumps, letters)),
        "base": len(letters) + 1,
        "names": ", ".join(json.dumps(each.name) for each in Outcome),
        "outcomes": ", ".join(f"{each.value} {each.name}" for each in Outcome if each.value < 7 and each.value != 5),
        "outcome_count": len(Outcome),
        "chatter": SUMMED_SPEED,
    }


def _table(kernel: Kernel) -> list[float]:
    """The numbers of a system, without the addresses of compiled functions."""
    table = kernel.table.copy()
    for place in ADDRESSES:
        table[place : place + 2] = 0.0
    return table.tolist()


def _about(kernel: Kernel) -> list[str]:
    """What a program says of itself."""
    system = kernel.system
    values = ", ".join(f"{name} = {value!r}" for name, value in system.parameters.items())
    walls = " and ".join(system.letters)
    return [
        f"The exact first return of {type(system).__name__}{f' at {values}' if values else ''}.",
        f"State: impact speed v on the wall {system.letters[0]} just before the impact, at least 0, in the system's units; "
        "phase phi in radians.",
        f"Impact words: a letter for each impact ({walls}), {CHATTER} for chatter, {REST} for a rest on a wall.",
        "Flights are followed from impact to impact by the march of nsmaps, none of whose steps can pass a wall, in the same",
        f"order of floating-point operations. Written by nsmaps {own_version()}".rstrip() + ".",
    ]


def _rows(values: list[str], columns: int = 6) -> str:
    rows = [", ".join(values[k : k + columns]) for k in range(0, len(values), columns)]
    return "\n".join(f"    {row}," for row in rows)
