"""The implicit exact map of an impact system as a LaTeX document, from the formulas that the map itself is derived from."""

from typing import Any

import sympy as sp

from nsmaps.exact.flows.formulas import in_symbols
from nsmaps.exact.flows.source import displacement_of, law_of, period_of, walls_of
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall
from nsmaps.exports.languages.latex import WIDTH, aligned, math, number, page, terms_of, text

U = sp.Symbol("u", nonnegative=True)


def system_files(system: ImpactSystem, name: str | None = None) -> dict[str, str]:
    """The document, by file name: flight, walls, impact law, and the equations of the first return."""
    cls = type(system)
    names = cls.parameter_names()
    symbolic, internal = in_symbols(cls, {name: getattr(system, name) for name in cls.model_fields if name not in names})
    plain = {internal[name]: sp.Symbol(name, real=True) for name in names}
    t, *start = sp.symbols("t t_j Z_j w_j", real=True)
    flight = displacement_of(symbolic, t, *start).xreplace(plain)
    period = period_of(symbolic).xreplace(plain)
    walls = {name: Wall(wall.at.xreplace(plain), wall.side) for name, wall in walls_of(symbolic).items()}
    laws = {name: law_of(symbolic, U, name).xreplace(plain) for name in walls}
    values = ", ".join(f"${math(name)} = {number(getattr(system, name))}$" for name in names)
    body = [
        f"Parameters: {values}." if values else "",
        "Between impacts, after the one at time $t_j$ at displacement $Z_j$ with velocity $w_j$ just after it,",
        _equation("Z(t; t_j, Z_j, w_j)", flight),
        _equation(r"\dot Z(t; t_j, Z_j, w_j)", sp.diff(flight, t)),
        *_impacts(walls, laws),
        *_return(walls, period),
        *_words(walls, laws),
    ]
    return {f"{name or cls.__name__.lower()}.tex": page(f"The exact map of {text(cls.__name__)}", filter(None, body))}


def _equation(left: str, right: Any) -> str:
    """An equation; products of sums are multiplied out where a line would not hold them."""
    if any(len(term) > WIDTH for term in terms_of(right)):
        right = sp.expand_mul(right)
    return aligned(left, terms_of(right))


def _impacts(walls: dict[str, Wall], laws: dict[str, Any]) -> list[str]:
    """Where the walls are, and what they do to a speed."""
    rows = []
    for name, wall in walls.items():
        sense, sign = ("growing", "-") if wall.side == 1 else ("falling", "")
        rows.append(
            f"Wall {text(name)}: $Z = {math(wall.at)}$, met with {sense} $Z$. An impact of speed $u = |\\dot Z|$ on it leaves "
            f"the velocity $w = {sign}\\rho_{{{name}}}(u)$, $\\rho_{{{name}}}(u) = {math(laws[name])}$."
        )
    return rows


def _return(walls: dict[str, Wall], period: Any) -> list[str]:
    """What a first return is."""
    base, wall = next(iter(walls.items()))
    sign = "-" if wall.side == 1 else ""
    first = rf"t_0 = \frac{{P \varphi_k}}{{2\pi}}, \quad Z_0 = {math(wall.at)}, \quad w_0 = {sign}\rho_{{{base}}}(v_k)"
    last = r"v_{k+1} = |\dot Z(t_n; t_{n-1}, Z_{n-1}, w_{n-1})|, \quad \varphi_{k+1} = \frac{2\pi t_n}{P} \bmod 2\pi"
    step = r"t_{j+1} = \min\,\{t > t_j : Z(t; t_j, Z_j, w_j) \text{ meets a wall}\}"
    return [
        f"The forcing has the period $P = {math(period)}$. A state $(v_k, \\varphi_k)$ is an impact on {text(base)}: its speed "
        "just before it and the phase of the forcing. It starts a flight at",
        rf"\[ {first}, \]",
        rf"impacts follow one another, \[ {step}, \] each with the law of its wall, until the $n$-th is on {text(base)} again:",
        rf"\[ {last}. \]",
    ]


def _words(walls: dict[str, Wall], laws: dict[str, Any]) -> list[str]:
    """The equations of the shortest words: no impact on the way, and one on the other wall."""
    (base, wall), *others = walls.items()
    home = math(wall.at)
    body = [
        f"Word {text(base + base)}: the least $t_1 > t_0$ with",
        rf"\[ Z(t_1; t_0, {home}, w_0) = {home}, \qquad v_{{k+1}} = |\dot Z(t_1; t_0, {home}, w_0)|. \]",
    ]
    for name, other in others:
        there = math(other.at)
        sign = "-" if other.side == 1 else ""
        rows = [
            rf"Z(t_1; t_0, {home}, w_0) &= {there}, & w_1 &= {sign}\rho_{{{name}}}(|\dot Z(t_1; t_0, {home}, w_0)|), \\",
            rf"Z(t_2; t_1, {there}, w_1) &= {home}, & v_{{k+1}} &= |\dot Z(t_2; t_1, {there}, w_1)|.",
        ]
        body += [
            f"Word {text(base + name + base)}: the least such $t_1 < t_2$ with",
            "\\begin{align*}\n" + "\n".join(rows) + "\n\\end{align*}",
        ]
    return body
