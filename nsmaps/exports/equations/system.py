"""The implicit exact map of an impact system as a LaTeX document, from the formulas that the map itself is derived from."""

from string import Template
from typing import Any

import sympy as sp

from nsmaps.exact.flows.formulas import in_symbols
from nsmaps.exact.flows.source import displacement_of, law_of, period_of, walls_of
from nsmaps.exact.systems.parameters import choices_of
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.systems.walls import Wall
from nsmaps.exports.equations.letters import letters_beside
from nsmaps.exports.languages.latex import WIDTH, aligned, math, number, page, terms_of, text

LEAST = 15  #: characters of a part of a formula that has a letter of its own


class _Line(Template):
    """A line of LaTeX in which @name stands for the letter of a quantity."""

    delimiter = "@"


def system_files(system: ImpactSystem, name: str | None = None) -> dict[str, str]:
    """The document, by file name: flight, walls, impact law, and the equations of the first return."""
    cls = type(system)
    names = cls.parameter_names()
    own = letters_beside(names)
    symbolic, internal = in_symbols(cls, choices_of(system))
    plain = {internal[name]: sp.Symbol(name, real=True) for name in names}
    t, *start = (
        sp.Symbol(_line(one, own), real=True) for one in ("@time", "@{time}_@impact", "@{place}_@impact", "@{velocity}_@impact")
    )
    u = sp.Symbol(own["speed"], nonnegative=True)
    flight = displacement_of(symbolic, t, *start).xreplace(plain)
    period = period_of(symbolic).xreplace(plain)
    walls = {name: Wall(wall.at.xreplace(plain), wall.side) for name, wall in walls_of(symbolic).items()}
    laws = {name: law_of(symbolic, u, name).xreplace(plain) for name in walls}
    values = ", ".join(f"${math(name)} = {number(getattr(system, name))}$" for name in names)
    body = [
        f"Parameters: {values}." if values else "",
        _line(
            "Between impacts, after the one at time $@{time}_@impact$ at displacement $@{place}_@impact$ with velocity "
            "$@{velocity}_@impact$ just after it,",
            own,
        ),
        *_flight(flight, t, own),
        *_impacts(walls, laws, own),
        *_return(walls, period, own),
        *_words(walls, own),
    ]
    return {f"{name or cls.__name__.lower()}.tex": page(f"The exact map of {text(cls.__name__)}", filter(None, body))}


def _line(line: str, own: dict[str, str], **more: str) -> str:
    """A line with its letters."""
    return _Line(line).substitute(own, **more)


def _flight(flight: sp.Expr, time: sp.Symbol, own: dict[str, str]) -> list[str]:
    """Displacement and velocity, as they are written; parts of a formula that a line would not hold have letters of their own."""
    of = "(@time; @{time}_@impact, @{place}_@impact, @{velocity}_@impact)"
    rate = sp.diff(flight, time)
    if not _wide(flight) and not _wide(rate):
        lines = (("@place", flight), (r"\dot @place", rate))
        return [aligned(_line(left + of, own), terms_of(one)) for left, one in lines]
    short, parts = _abbreviated(flight, own["part"])
    where = [aligned(math(symbol), terms_of(one)) for symbol, one in parts]
    rate_told = _line(r"and $\dot @place$ is its derivative by $@time$.", own)
    return [aligned(_line("@place" + of, own), terms_of(short)), "with" if parts else "", *where, rate_told]


def _wide(formula: sp.Expr) -> bool:
    """Whether a line does not hold every term of a formula."""
    return any(len(term) > WIDTH for term in terms_of(formula))


def _abbreviated(formula: sp.Expr, letter: str) -> tuple[sp.Expr, list[tuple[sp.Symbol, sp.Expr]]]:
    """A formula with letters for those of its parts that take most room, as long as it is too wide, and these parts."""
    parts: list[tuple[sp.Symbol, sp.Expr]] = []
    while _wide(formula):
        rooms = {part: len(math(part)) for part in sp.preorder_traversal(formula) if part.args}
        rooms = {part: formula.count(part) * room for part, room in rooms.items() if LEAST < room <= WIDTH}
        if not rooms:
            break
        part, symbol = max(rooms, key=lambda one: rooms[one]), sp.Symbol(f"{letter}_{len(parts) + 1}", real=True)
        formula, parts = formula.xreplace({part: symbol}), [*parts, (symbol, part)]
    return formula, parts


def _impacts(walls: dict[str, Wall], laws: dict[str, Any], own: dict[str, str]) -> list[str]:
    """Where the walls are, and what they do to a speed."""
    rows = []
    for name, wall in walls.items():
        sense, sign = ("growing", "-") if wall.side == 1 else ("falling", "")
        line = (
            r"Wall @wall: $@place = @at$, met with @sense $@place$. An impact of speed $@speed = |\dot @place|$ on it leaves "
            r"the velocity $@velocity = @sign@{law}_{@letter}(@speed)$, $@{law}_{@letter}(@speed) = @value$."
        )
        shown = {"wall": text(name), "letter": name, "at": math(wall.at), "value": math(laws[name])}
        rows.append(_line(line, own, sense=sense, sign=sign, **shown))
    return rows


def _return(walls: dict[str, Wall], period: Any, own: dict[str, str]) -> list[str]:
    """What a first return is."""
    base, wall = next(iter(walls.items()))
    lines = (
        "The forcing has the period $@period = @value$. A state $(@{state}_@return, @{phase}_@return)$ is an impact on @base: "
        "its speed just before it and the phase of the forcing. It starts a flight at",
        r"\[ @{time}_0 = \frac{@period @{phase}_@return}{2\pi}, \quad @{place}_0 = @at, \quad "
        r"@{velocity}_0 = @sign@{law}_{@letter}(@{state}_@return), \]",
        r"impacts follow one another, \[ @{time}_{@impact+1} = \min\,\{@time > @{time}_@impact : "
        r"@place(@time; @{time}_@impact, @{place}_@impact, @{velocity}_@impact) \text{ meets a wall}\}, \] each with the law of "
        r"its wall, until the $@last$-th is on @base again:",
        r"\[ @{state}_{@return+1} = |\dot @place(@{time}_@last; @{time}_{@last-1}, @{place}_{@last-1}, @{velocity}_{@last-1})|, "
        r"\quad @{phase}_{@return+1} = \frac{2\pi @{time}_@last}{@period} \bmod 2\pi. \]",
    )
    shown = {"base": text(base), "letter": base, "at": math(wall.at), "value": math(period)}
    return [_line(line, own, sign="-" if wall.side == 1 else "", **shown) for line in lines]


def _words(walls: dict[str, Wall], own: dict[str, str]) -> list[str]:
    """The equations of the shortest words: no impact on the way, and one on the other wall."""
    (base, wall), *others = walls.items()
    home = math(wall.at)
    body = [
        f"Word {text(base + base)}: the least " + _line("$@{time}_1 > @{time}_0$ with", own),
        _line(
            r"\[ @place(@{time}_1; @{time}_0, @home, @{velocity}_0) = @home, \qquad "
            r"@{state}_{@return+1} = |\dot @place(@{time}_1; @{time}_0, @home, @{velocity}_0)|. \]",
            own,
            home=home,
        ),
    ]
    for name, other in others:
        rows = (
            r"@place(@{time}_1; @{time}_0, @home, @{velocity}_0) &= @there, & @{velocity}_1 &= "
            r"@sign@{law}_{@letter}(|\dot @place(@{time}_1; @{time}_0, @home, @{velocity}_0)|), \\",
            r"@place(@{time}_2; @{time}_1, @there, @{velocity}_1) &= @home, & @{state}_{@return+1} &= "
            r"|\dot @place(@{time}_2; @{time}_1, @there, @{velocity}_1)|.",
        )
        shown = {"home": home, "there": math(other.at), "letter": name, "sign": "-" if other.side == 1 else ""}
        body += [
            f"Word {text(base + name + base)}: the least such " + _line("$@{time}_1 < @{time}_2$ with", own),
            "\\begin{align*}\n" + "\n".join(_line(row, own, **shown) for row in rows) + "\n\\end{align*}",
        ]
    return body
