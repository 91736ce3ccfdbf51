"""Records in front of the functions that use them: numbers of a system as constants, memory as a type of its own."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from nsmaps.exports.engine.c import DIRECTIONS, CPrinter
from nsmaps.exports.engine.julia import JuliaPrinter
from nsmaps.exports.engine.kinds import BOOL, FLOAT, INT, OPEN, Array, Kind, Record, spelt
from nsmaps.exports.engine.printer import Printer


def used(printer: Printer, record: Record) -> Iterator[tuple[str, Kind, Any]]:
    """The fields of a record that the functions use: name, kind and value."""
    for name in printer.fields.get(record.name, {}):
        yield spelt(name), record.kind(name), getattr(record.value, name)


def _constants(printer: CPrinter | JuliaPrinter, record: Record) -> str:
    """The fields of a record that are constants, each by itself."""
    fixed = [(f"{record.name}_{name}", value) for name, _, value in used(printer, record) if name in record.constant]
    return "\n".join(printer.constant(name, value) for name, value in fixed)


def c_constants(printer: CPrinter, record: Record) -> str:
    """The fixed fields of a record in C."""
    if not record.fixed:
        return _constants(printer, record)
    members = [f"    {printer.member(kind, name)};" for name, kind, _ in used(printer, record)]
    values = [f"    .{name} = {printer.entries(value)}," for name, _, value in used(printer, record)]
    return "\n".join(["static const struct {", *members, f"}} {record.name} = {{", *values, "};"]) if members else ""


def c_memory(printer: CPrinter, record: Record) -> tuple[str, str]:
    """The type of a memory in C, and its initial value: numbers are arguments; as many directions as `derivative` wants."""
    fields = [(name, kind, value) for name, kind, value in used(printer, record) if name not in record.constant]
    members = [f"    {printer.member(kind, name)};" for name, kind, _ in fields]
    filled = [f".{name} = {name}" for name, kind, _ in fields if kind == FLOAT]
    filled += [f".{name} = {printer.entries(value)}" for name, kind, value in fields if kind != FLOAT and np.any(value)]
    if printer.max_directions:
        members.append(f"    int64_t {DIRECTIONS};")
        filled.append(f".{DIRECTIONS} = derivative ? {printer.max_directions} : 0")
    return "\n".join(["typedef struct {", *members, f"}} {record.name};"]), ", ".join(filled) or "0"


def julia_constants(printer: JuliaPrinter, record: Record) -> str:
    """The fixed fields of a record in Julia."""
    if not record.fixed:
        return _constants(printer, record)
    values = [f"    {name} = {printer.entries(value)}," for name, _, value in used(printer, record)]
    return "\n".join([f"const {record.name} = (", *values, ")"]) if values else ""


def julia_memory(printer: JuliaPrinter, record: Record) -> str:
    """The function that makes a memory in Julia, for so many directions; numbers are arguments."""
    values = []
    numbers = [name for name in record.value._fields if record.kind(name) == FLOAT]
    for name, kind, value in used(printer, record):
        if name not in record.constant:
            if not isinstance(kind, Array):
                values.append(f"    {name} = {name},")
                continue
            shape = ", ".join(DIRECTIONS if size == OPEN else str(size) for size in reversed(kind.shape))
            zeros = f"zeros({'Int64, ' if kind.of == INT else 'Bool, ' if kind.of == BOOL else ''}{shape})"
            values.append(f"    {name} = {printer.entries(value) if np.any(value) else zeros},")
    return "\n".join([f"{record.name}({', '.join([DIRECTIONS, *numbers])}) = (", *values, ")"])
