"""Maps, closed forms and exact systems as LaTeX documents that compile with amsmath alone."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import sympy as sp
from sympy.printing.latex import LatexPrinter

from nsmaps.exports.headers import described
from nsmaps.exports.program import Exportable, Part, Program, own_version, program_of
from nsmaps.reduced.fit.variables import expression
from nsmaps.symbolic.curve_iterates import HeldIterate
from nsmaps.symbolic.formula import symbol
from nsmaps.symbolic.map_iterates import ClosedMap

WIDTH = 95  #: characters of formula source on one line, about the width of a page
PLAIN = 30  #: terms up to which plain monomials are written beside the Chebyshev products

DOCUMENT = r"""%% Written by nsmaps %s.
\documentclass{article}
\usepackage{amsmath}
\usepackage[margin=2cm]{geometry}
\allowdisplaybreaks
\begin{document}
\section*{%s}
%s
\end{document}
"""
SPECIAL = {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"} | {c: f"\\{c}" for c in "&%$#_{}"}


def files(result: Exportable, name: str, about: Sequence[str]) -> dict[str, str]:
    """The document, by file name, with lines about where the result is from."""
    if isinstance(result, HeldIterate):
        title, body = f"Iterate {len(result.curves)} of ${math(result.variable)}$", _iterate(result)
    elif isinstance(result, ClosedMap):
        title, body = f"Closed form of degree {result.degree}", _closed(result)
    else:
        program = program_of(result, name)
        title = text(program.title)
        body = _composite(program) if program.kind == "pieces" else _part(program, program.parts[0])
    provenance = "\\\\\n".join(text(line) for line in (*about, *described(result)))
    return {f"{name}.tex": page(title, [provenance, *body] if provenance else body)}


def page(title: str, body: Iterable[str]) -> str:
    """A whole document; title and paragraphs are LaTeX."""
    return DOCUMENT % (own_version(), title, "\n\n".join(body))


def text(words: str) -> str:
    """Plain words, with what LaTeX takes for itself escaped; what is not ASCII becomes a question mark."""
    return "".join(SPECIAL.get(c, c) for c in words.encode("ascii", "replace").decode())


class _Printer(LatexPrinter):  # type: ignore[misc]
    """LaTeX with floats in as few digits as read back to them."""

    def _print_Float(self, expr: sp.Float) -> str:
        return number(float(expr)) if expr == sp.Float(float(expr)) else str(LatexPrinter._print_Float(self, expr))


def math(expr: Any) -> str:
    """A sympy expression, or the symbol of a name."""
    return str(_Printer({"full_prec": False}).doprint(symbol(expr) if isinstance(expr, str) else expr))


def number(value: float) -> str:
    """A float in as few digits as read back to it."""
    digits, _, power = repr(float(value)).partition("e")
    return rf"{digits}\cdot 10^{{{int(power)}}}" if power else digits


def aligned(left: str, terms: Sequence[str]) -> str:
    """An equation with a sum on its right, in as many lines as it takes; terms begin with their sign."""
    lines, line = [], ""
    for k, term in enumerate(terms or ["0"]):
        term = term.removeprefix("+ ") if k == 0 else term
        if line and len(line) + len(term) > WIDTH:
            lines.append(line)
            line = ""
        line += f" {term}"
    rows = (" \\\\\n&\\quad").join([*lines, line])
    return f"\\begin{{align*}}\n{left} &={rows}\n\\end{{align*}}"


def _signed(value: float, product: str) -> str:
    return f"{'-' if value < 0 else '+'} {number(abs(value))}{f' {product}' if product else ''}"


def terms_of(expr: Any) -> list[str]:
    """The terms of a sympy sum, each with its sign; floats in all their digits."""
    found = []
    for term in expr.as_ordered_terms():
        minus = term.could_extract_minus_sign()
        found.append(f"{'-' if minus else '+'} {math(-term if minus else term)}")
    return found


def _image(name: str) -> str:
    return f"{math(name)}_{{k+1}}"


def _absolute(taken: bool, terms: list[str]) -> list[str]:
    return [r"\Bigl|", terms[0].removeprefix("+ "), *terms[1:], r"\Bigr|"] if taken else terms


def _part(program: Program, part: Part) -> list[str]:
    """The polynomials of one piece, in Chebyshev products of scaled coordinates, and plainly where that is short."""
    polymap = part.polymap
    names = polymap.coordinates
    of = names if polymap.variables is None else [expression(text, names) for text in polymap.variables]
    scales = zip(map(math, of), polymap.centre, polymap.scale, strict=True)
    shifted = [(x if c == 0 else f"{x} {_signed(-c, '')}", s) for x, c, s in scales]
    sides = [x if s == 1 else rf"\frac{{{x}}}{{{number(s)}}}" for x, s in shifted]
    scaled = [f"s_{{{j}}} = {side}" for j, side in enumerate(sides, 1)]
    about = r"\\ ".join(text(line.strip()) for line in part.about)
    rows = ", \\\\\n".join(scaled)
    body = [f"{about}\n\n$T_i$ are Chebyshev polynomials of", f"\\begin{{gather*}}\n{rows}.\n\\end{{gather*}}"]
    for i, name in enumerate(program.outputs):
        pairs = zip(polymap.exponents[i].tolist(), polymap.coefficients[i].tolist(), strict=True)
        terms = [_signed(c, " ".join(f"T_{{{e}}}(s_{{{j}}})" for j, e in enumerate(key, 1) if e)) for key, c in pairs]
        body.append(aligned(_image(name), _absolute(part.absolute[i], terms)))
    if max(len(each) for each in polymap.exponents[: part.outputs]) <= PLAIN:
        body += _plain(program, part) if polymap.variables is None else _whole(program, part)
    return body


def _plain(program: Program, part: Part) -> list[str]:
    """The same in plain monomials, with what their cancellation costs."""
    polymap, body = part.polymap, []
    symbols = [math(name) for name in polymap.coordinates]
    for i, name in enumerate(program.outputs):
        terms = []
        for key, c in polymap.monomials(name).items():
            powers = zip(symbols, key, strict=True)
            terms.append(_signed(c, " ".join(x if e == 1 else f"{x}^{{{e}}}" for x, e in powers if e)))
        body.append(aligned(_image(name), _absolute(part.absolute[i], terms)))
    errors = ", ".join(f"${math(name)}$: {polymap.monomial_error(name):.2g}" for name in program.outputs)
    return [f"In plain monomials, which in floats differ from these by at most ({errors}):", *body]


def _whole(program: Program, part: Part) -> list[str]:
    """The same of a map with variables as one formula."""
    polymap = replace(part.polymap, absolute=())
    pairs = zip(program.outputs, part.absolute, strict=True)
    return ["As one formula:", *(aligned(_image(name), _absolute(a, terms_of(polymap.symbolic(name)))) for name, a in pairs)]


def _composite(program: Program) -> list[str]:
    """The cases in order, then each piece."""
    inputs = ", ".join(math(name) for name in program.inputs)
    pieces = [part for part in program.parts if part.region is not None]
    rows = [
        rf"M_{{{k}}}({inputs}), & {_condition(part.region.condition())} \\" for k, part in enumerate(pieces, 1) if part.region
    ]
    cases = [r"\[ M(" + inputs + r") = \begin{cases}", *rows, r"\end{cases} \]"]
    limits = [f"${number(low)} \\le {math(program.inputs[i])} \\le {number(high)}$." for i, low, high in program.limits]
    intro = "The first condition that holds decides; angles in $[0, 2\\pi)$. A state of none has no image. " + " ".join(limits)
    body = [intro, "\n".join(cases)]
    for k, part in enumerate(pieces, 1):
        body += [rf"\subsection*{{$M_{{{k}}}$: {text(part.title)}}}", *_part(program, part)]
    return body


def _condition(expr: Any) -> str:
    """A condition, one part a line where a line would not hold it."""
    whole = math(expr)
    if len(whole) <= WIDTH or not isinstance(expr, sp.And | sp.Or):
        return whole
    sign = r" \\ \wedge\;" if isinstance(expr, sp.And) else r" \\ \vee\;"
    parts = [math(part) if part.is_Relational else rf"({math(part)})" for part in expr.args]
    return rf"\begin{{array}}[t]{{@{{}}l}} {sign.join(parts)} \end{{array}}"


def _iterate(result: HeldIterate) -> list[str]:
    """The polynomial in its alpha coefficients, these, and the curves."""
    x, n = math(result.variable), len(result.curves)
    powers = ["" if k == 0 else f" {x}_k" if k == 1 else f" {x}_k^{{{k}}}" for k in range(len(result.alpha))]
    body = [aligned(f"{x}_{{k+{n}}}", [rf"+ \alpha_{{{k}}}{power}" for k, power in enumerate(powers)])]
    body += [aligned(rf"\alpha_{{{k}}}", terms_of(alpha)) for k, alpha in enumerate(result.alpha)]
    body.append("It is the composition of these curves, the first applied first:")
    for k, curve in enumerate(result.curves, 1):
        body.append(aligned(rf"\xi_{{{k}}}({x})", terms_of(sp.expand(_decimals(curve)))))
    return body


def _closed(result: ClosedMap) -> list[str]:
    bodies = {name: terms_of(sp.expand(_decimals(image))) for name, image in result.images.items()}
    return [aligned(_image(name), _absolute(name in result.absolute, terms)) for name, terms in bodies.items()]


def _decimals(expr: Any) -> Any:
    """Long fractions as decimals of 40 digits."""
    long = {r: r.n(40) for r in expr.atoms(sp.Rational) if len(str(r)) > 12}
    return expr.xreplace(long)
