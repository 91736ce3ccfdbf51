"""The engine as JavaScript, for a page or node: tuples are objects with the members m0, m1, ..., whole numbers are doubles."""

from string import Template
from typing import Any

import numpy as np

from nsmaps.exports.engine.c import DIRECTIONS, CPrinter
from nsmaps.exports.engine.kinds import FLOAT, OPEN, Array, Function, Kind, Record, passed
from nsmaps.exports.engine.printer import WHOLE, Node, Printer
from nsmaps.exports.engine.records import used

LARGEST = 2**53  #: up to which doubles hold every whole number: words with larger codes are cut
TYPED = {"f": "Float64Array", "i": "Float64Array", "b": "Uint8Array"}
HELPERS = {
    "smaller": "const smaller = (x, y) => y < x ? y : x",
    "larger": "const larger = (x, y) => y > x ? y : x",
    "whole_power": """function whole_power(x, n) {
    let power = 1
    for (; n > 0; n = Math.floor(n / 2), x *= x) if (n % 2) power *= x
    return power
}""",
    "complex_size": "const complex_size = x => hypot(x.re, x.im)",
    "complex_sum": "const complex_sum = (x, y) => ({re: x.re + y.re, im: x.im + y.im})",
    "complex_difference": "const complex_difference = (x, y) => ({re: x.re - y.re, im: x.im - y.im})",
    "complex_product": "const complex_product = (x, y) => ({re: x.re * y.re - x.im * y.im, im: x.re * y.im + x.im * y.re})",
    "complex_quotient": """function complex_quotient(x, y) {
    if (fabs(y.re) >= fabs(y.im)) {
        const ratio = y.im / y.re, size = y.re + y.im * ratio
        return {re: (x.re + x.im * ratio) / size, im: (x.im - x.re * ratio) / size}
    }
    const ratio = y.re / y.im, size = y.re * ratio + y.im
    return {re: (x.re * ratio + x.im) / size, im: (x.im * ratio - x.re) / size}
}""",
}
HELPERS |= {f"{name}_whole": f"const {name}_whole = {name}" for name in ("smaller", "larger")}
SCRIPT = Template("""/*
$about

    $name.of(state)             // {outcome, image, turns, time, code, derivative}, the derivative NaN
    $name.of(state, true)       // with the derivative
    $name.word(code)            // word of a code
*/
const $name = (() => {
"use strict"
const {isNaN: isnan, isFinite: isfinite} = Number
const {abs: fabs, acos, acosh, asin, asinh, atan, atan2, atanh, cbrt, ceil, cos, cosh, exp, expm1, floor} = Math
const {hypot, log, log10, log1p, log2, pow, sin, sinh, sqrt, tan, tanh, trunc} = Math
const ldexp = (x, n) => x * 2 ** n, fmod = (x, y) => x % y, copysign = (x, y) => Object.is(y, -0) || y < 0 ? -fabs(x) : fabs(x)
const OUTCOMES = [$names], LETTERS = [$letters]
$data

$functions
$entry

/* The image of one state and the number of its outcome, 0 where it has returned; others have -1. */
function image_of(state) {
    const got = of(state)
    return [got.image, got.outcome === OUTCOMES[0] ? 0 : -1]
}

/* The word of a code. */
function word(code) {
    let text = ""
    for (let left = fabs(code); left > 0; left = floor(left / $base)) text += LETTERS[left % $base - 1]
    return code < 0 ? text + "..." : text
}

return {of, word, image_of, images: states => states.map(image_of)}
})()
if (typeof module !== "undefined") module.exports = $name
""")


class JavaScriptPrinter(CPrinter):
    """JavaScript."""

    stop, arrow = "", "."

    def type_of(self, kind: Kind) -> str:
        return ""

    def variable(self, kind: Kind, name: str) -> str:
        return f"let {name}"

    def constant(self, name: str, value: Any) -> str:
        return f"const {name} = {self.entries(value)}"

    def entries(self, value: Any) -> str:
        """A number, or an array of one axis as a typed one, others as arrays of these."""
        if not isinstance(value, np.ndarray):
            return self.literal(value)
        inside = ", ".join(map(self.entries, value if value.ndim > 1 else value.tolist()))
        return f"[{inside}]" if value.ndim > 1 else f"{TYPED[value.dtype.kind]}.of({inside})"

    def whole(self, function: Function) -> str:
        taken = [name for name, kind in function.arguments.items() if passed(kind)]
        own = [f"    let {', '.join(self.above)}"] if self.above else []
        head = f"function {function.name}({', '.join(taken)}) {{"
        return "\n".join([self.comment(function), head, *own, *self.lines, "}", ""])

    def tuple_of(self, nodes: list[Node], kind: Kind) -> tuple[str, int]:
        return f"{{{', '.join(f'm{k}: {text}' for k, text in enumerate(self.handed(nodes, kind)))}}}", WHOLE

    def given_to(self, function: Function, nodes: list[Node]) -> list[str]:
        return Printer.given_to(self, function, nodes)

    def directions(self, node: Node, axis: int) -> str:
        return f"{self.value(node)}.length" if axis == 0 else f"{self.value(node)}[0].length"

    def literal(self, value: Any) -> str:
        if isinstance(value, int) and not isinstance(value, bool):
            return str(max(-LARGEST, min(value, LARGEST)))
        return super().literal(value).replace("INFINITY", "Infinity").replace("NAN", "NaN")

    def _Attribute(self, node: Node, kind: Kind) -> tuple[str, int]:
        text, binds = super()._Attribute(node, kind)
        return {"INFINITY": "Infinity", "NAN": "NaN"}.get(text, text), binds

    def complex(self, real: str, imaginary: str) -> str:
        return f"{{re: {real}, im: {imaginary}}}"

    def quotient(self, left: str, right: str) -> str:
        return f"floor({left} / {right})"

    def counted(self, text: str) -> str:
        return f"Number({text})"

    def library(self, name: str, node: Node) -> str:
        text = super().library(name, node)
        return {"(int64_t)": "trunc", "(int64_t)floor": "floor"}.get(text, text)


def tables(printer: JavaScriptPrinter, record: Record) -> list[str]:
    """The fixed fields of a record as constants."""
    if record.fixed:
        inside = ", ".join(f"{name}: {printer.entries(value)}" for name, _, value in used(printer, record))
        return [f"const {record.name} = {{{inside}}}"] if inside else []
    own = [(name, value) for name, _, value in used(printer, record) if name in record.constant]
    return [printer.constant(f"{record.name}_{name}", value) for name, value in own]


def memory(printer: JavaScriptPrinter, record: Record) -> str:
    """The function that makes a memory, for so many directions; numbers are arguments."""
    numbers = [name for name in record.value._fields if record.kind(name) == FLOAT]
    own = [(name, kind, value) for name, kind, value in used(printer, record) if name not in record.constant]
    parts = [f"    {name}," if kind == FLOAT else f"    {name}: {_start(printer, kind, value)}," for name, kind, value in own]
    return "\n".join([f"const memory = ({', '.join([DIRECTIONS, *numbers])}) => ({{", *parts, "})"])


def _start(printer: JavaScriptPrinter, kind: Kind, value: Any) -> str:
    """A part of a memory as it begins."""
    if not isinstance(kind, Array) or np.any(value):
        return printer.entries(value)
    *outer, last = [DIRECTIONS if size == OPEN else str(size) for size in kind.shape]
    text = f"new {TYPED[kind.of[0]]}({last})"
    for size in reversed(outer):
        text = f"Array.from({{length: {size}}}, () => {text})"
    return text
