"""The style of figures: colours that colour-blind readers distinguish, one typeface, uniform labels.

Lines have the colours of Okabe and Ito. Distances are in CIELAB, the least with normal sight and in simulated deuteranopia and
protanopia: fills of pieces are at least 25 apart, those of families, at any tint up to 0.4, at least 26, areas of `MOTIONS`, of
others, chaos and white 30, `INKS` 25; lines of `LOOKS` are 17 apart and differ in dashes and marker too. Colours follow the
paper: words BB black and BTB magenta, exact orbits orange and composite orbits green, upper maps blue.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.patheffects import withStroke
from matplotlib.textpath import TextPath
from matplotlib.ticker import MultipleLocator

from nsmaps.arrays import Floats
from nsmaps.coordinates import is_angle
from nsmaps.errors import NsmapsError, near_match
from nsmaps.figures.ticks import angle_ticks, decimal_ticks

BLACK, MAGENTA, BLUE, ORANGE, GREEN = "#000000", "#CC79A7", "#0072B2", "#E69F00", "#009E73"
SKY, YELLOW, RED, GREY, OLIVE, BROWN = "#56B4E9", "#F0E442", "#D55E00", "#7F7F7F", "#8A8000", "#6B3A0E"
LOOKS = (
    (BLUE, "-", "o"),
    (RED, "--", "s"),
    (GREEN, "-.", "^"),
    (MAGENTA, ":", "D"),
    (BLACK, "-", "v"),
)  #: of lines: colour, dashes, marker
INKS = (BLACK, "#8A0B67", "#0574B4", "#B86000", "#00531F")  #: of dots and thin lines, dark on white; `INK` is that of all others
INK = "#7B796D"
FAMILIES = (BLACK, MAGENTA, YELLOW, "#1A14F0", "#3B6303", "#C56FFF", "#F1DAA4", "#030B72")
PIECES = ("#858585", "#C0D284", "#489FEC", "#C76A00", "#E8D700", "#630052", "#005EFF", "#562800")
MOTIONS = (
    "#94C5FF",
    "#A58907",
    "#497E44",
    "#F8F041",
    "#C89AA6",
    "#1056B3",
)  #: areas of periods or motions over parameters, at least 10 apart in lightness: also in print without colour
OTHERS, QUASI, OPEN = "#49484C", "#62206B", "#E7D3B1"  #: beside these: further motions, quasi-periodic and unresolved ones
FILL = 0.4  #: of white in the colour of an area
MOST = len(PIECES)  #: pieces that have a colour of their own where there are more
REST = "#E4E4E4"  #: of all others
_ALIKE = 2.5  #: axes of one angle whose spans differ by no more have the same ticks
_GREEK = re.compile(
    "alpha|beta|[gG]amma|[dD]elta|zeta|eta|[tT]heta|kappa|[lL]ambda|mu|nu|[xX]i|rho|[sS]igma|tau|[pP]hi|chi|[pP]si|[oO]mega"
)
_LETTERS = {"eps": r"\varepsilon", "epsilon": r"\varepsilon"}  #: names that are not those of TeX
_ACCENTS = ("bar", "hat", "tilde", "dot")  #: parts of names after `_` that are accents
_UNITS: ContextVar[Mapping[str, str]] = ContextVar("units", default={})  # noqa: B039 - never changed
_STYLE: ContextVar[str] = ContextVar("style", default="")
_NOTES: ContextVar[list[str]] = ContextVar("notes")
SIZE = 8.0  #: points, of all type
_MARKS = (("major", "size", 2.5), ("major", "width", 0.6), ("major", "pad", 2.5), ("minor", "size", 1.5), ("minor", "width", 0.4))

STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": SIZE,
    "mathtext.fontset": "dejavusans",
    "text.usetex": False,  # names of a study never become TeX that is run
    "axes.labelsize": SIZE,
    "axes.titlesize": SIZE,
    "axes.titley": 1.0,  # nothing stands between a panel and its title, which need not be looked for
    "axes.titlepad": 4.0,
    "axes.labelpad": 2.0,
    "axes.linewidth": 0.6,
    "axes.grid": False,
    "figure.titlesize": SIZE,
    "xtick.labelsize": SIZE,
    "ytick.labelsize": SIZE,
    **{f"{axis}tick.{kind}.{name}": size for axis in "xy" for kind, name, size in _MARKS},
    "legend.fontsize": SIZE,
    "legend.frameon": True,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "0.8",
    "legend.handlelength": 1.6,
    "legend.borderpad": 0.3,
    "legend.labelspacing": 0.35,
    "patch.linewidth": 0.6,
    "lines.linewidth": 0.9,
    "lines.markersize": 3.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "nsmaps",
    "figure.constrained_layout.w_pad": 0.04,
    "figure.constrained_layout.h_pad": 0.04,
}
"""The settings of every drawn file; for `matplotlib.rc_context`, never written to matplotlib's own."""


HALO = (withStroke(linewidth=1.8, foreground="white"),)  #: around lines and names over areas


@lru_cache(maxsize=64)
def extent_of(text: str, size: float = SIZE) -> tuple[float, float]:
    """The width and the height of a text in a type size, points; one of a figure is asked for in each of its panels."""
    lines = [TextPath((0, 0), line, size=size).get_extents() for line in text.splitlines()]
    return max(line.width for line in lines), 1.2 * size * (len(lines) - 1) + lines[0].height


def tint(colour: str, amount: float = 0.65) -> tuple[float, float, float]:
    """The colour mixed with this share of white."""
    r, g, b = ((1 - amount) * part + amount for part in to_rgb(colour))
    return r, g, b


def darker(colour: str) -> tuple[float, float, float]:
    """The colour mixed with black until its contrast with white is 4.5 (WCAG 2.1, 1.4.3), as letters need.

    >>> darker(BLACK), darker(YELLOW)[0] < 0.6
    ((0.0, 0.0, 0.0), True)
    """
    shades = np.linspace(1, 0, 101)[:, None] * to_rgb(colour)
    r, g, b = shades[int(np.argmax(1.05 / (luminance(shades) + 0.05) >= 4.5))].tolist()
    return r, g, b


def luminance(colours: Floats) -> Floats:
    """The luminance Y of colours (..., 3) in sRGB, from 0 to 1 (IEC 61966-2-1)."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear @ [0.2126, 0.7152, 0.0722])


def fill_of(colour: str) -> tuple[float, float, float]:
    """The colour of an area: of a piece or a family 0.4 white; of what has no colour of its own as it is."""
    return tint(colour, 0.0 if colour in (REST, "#FFFFFF") else FILL)


def family_colours(names: Sequence[str], colours: Sequence[str] = FAMILIES) -> dict[str, str]:
    """A colour a family, by the length of its word: two impacts black, three magenta, four yellow, as in the paper.

    Eight are distinguished; all further ones are grey.

    >>> family_colours(["BTB", "BB"]) == {"BTB": MAGENTA, "BB": BLACK}
    True
    """
    chosen: dict[str, str] = {}
    for name in names:
        wish = max(len(name) - 2, 0)
        slots = [colours[(wish + k) % len(colours)] for k in range(len(colours))]
        chosen[name] = next((colour for colour in slots if colour not in chosen.values()), GREY)
    return chosen


def piece_colours(names: Sequence[str], resets: Sequence[bool]) -> list[str]:
    """A colour a piece: R1, R2, ... have the first, second, ..., every reset is white, others take what is left.

    An expanded piece, such as R1+, has the colour of the piece whose place it takes.

    >>> piece_colours(["reset", "R2", "mine"], [True, False, False]) == ["#FFFFFF", PIECES[1], PIECES[7]]
    True
    >>> piece_colours(["R1+", "R2"], [False] * 2) == [PIECES[0], PIECES[1]]
    True
    """
    bases = [name.removesuffix("+") for name in names]
    numbers = [
        re.fullmatch(r"R_?(\d+)", base if bases.count(base) == 1 else name) for base, name in zip(bases, names, strict=True)
    ]
    own = {k: (int(found[1]) - 1) % len(PIECES) for k, found in enumerate(numbers) if found and not resets[k]}
    free = [slot for slot in reversed(range(len(PIECES))) if slot not in own.values()] or [0]
    others = [k for k, reset in enumerate(resets) if k not in own and not reset]
    own |= {k: free[n % len(free)] for n, k in enumerate(others)}
    return [PIECES[own[k]] if k in own else "#FFFFFF" for k in range(len(names))]


def piece_label(name: str) -> str:
    r"""The name of a piece as the paper writes it.

    >>> piece_label("R1+"), piece_label("reset")
    ('$\\mathcal{R}_{1}^+$', 'reset')
    """
    found = re.fullmatch(r"R_?(\d+)(\+?)", name)
    return rf"$\mathcal{{R}}_{{{found[1]}}}{'^+' if found[2] else ''}$" if found else name


def bare(name: str) -> str:
    r"""A name in mathematical type without its dollars: Greek letters, accents after `_`, and one letter or number as an index.

    >>> bare("phi"), bare("g_bar"), bare("eps"), bare("speed"), bare("tau_R"), bare("x1"), bare("v_bar_2")
    ('\\phi', '\\bar{g}', '\\varepsilon', '\\mathrm{speed}', '\\tau_{R}', 'x_{1}', '\\bar{v}_{2}')
    """
    letter = _LETTERS.get(name) or (f"\\{name}" if _GREEK.fullmatch(name) else name if len(name) == 1 else "")
    if letter:
        return letter
    stem, _, side = name.rpartition("_")
    digits = re.fullmatch(r"(.*[a-zA-Z])_?(\d+)", name)
    if digits:
        stem, side = digits.groups()
    inner = bare(stem) if stem else r"\mathrm"
    if inner.startswith(r"\mathrm") or (len(side) > 1 and not digits and side not in _ACCENTS):
        return rf"\mathrm{{{name}}}".replace("_", r"\_")
    return rf"\{side}{{{inner}}}" if side in _ACCENTS else f"{inner}_{{{side}}}"


def symbol(name: str, index: str = "") -> str:
    r"""A coordinate in mathematical type, with an index such as the step.

    >>> symbol("phi", "k+1"), symbol("v")
    ('$\\phi_{k+1}$', '$v$')
    """
    plain = bare(name)
    return f"${plain}$" if not index else f"${{{plain}}}_{{{index}}}$" if "_" in plain else f"${plain}_{{{index}}}$"


STYLES: Mapping[str, Mapping[str, Any]] = {
    "": STYLE,
    "journal": STYLE | {"font.family": "STIXGeneral", "mathtext.fontset": "stix"},
}
"""Settings by the name of a style. A journal has serif type, and units and titles of panels in the caption."""


@contextmanager
def drawing(units: Mapping[str, str], style: str = "") -> Iterator[list[str]]:
    """While figures are drawn, labels have these units of coordinates and parameters (`nsmaps.results.units_of`).

    In a style of a journal the list that is yielded receives what its captions must say: units, and titles of panels.

    Raises:
        NsmapsError: there is no such style.
    """
    if style not in STYLES:
        raise NsmapsError(f"there is no style {style!r}{near_match(style, STYLES)}; expected: journal")
    notes: list[str] = []
    values: tuple[tuple[ContextVar[Any], Any], ...] = ((_UNITS, units), (_STYLE, style), (_NOTES, notes))
    tokens = [(variable, variable.set(value)) for variable, value in values]
    try:
        with matplotlib.rc_context(settings()):  # type: ignore[arg-type]
            yield notes
    finally:
        for variable, token in tokens:
            variable.reset(token)


def settings() -> Mapping[str, Any]:
    """The settings of matplotlib in the style in which figures are drawn now."""
    return STYLES[_STYLE.get()]


def noted(text: str) -> bool:
    """Whether a text stands in the caption, as the style has it, and not in the picture."""
    if not _STYLE.get():
        return False
    _NOTES.get().append(text)
    return True


def with_unit(text: str, name: str = "", unit: str = "") -> str:
    """The text of an axis with the unit of what it shows: `rad` of an angle, else what the system says; none if it is silent.

    `name` is that of a coordinate or parameter, or `time`, `displacement`, `velocity`; other quantities have a `unit`.

    >>> from nsmaps.coordinates import Angle
    >>> with_unit("phase", Angle("phi"))
    'phase (rad)'
    """
    unit = unit or ("rad" if is_angle(name) else _UNITS.get().get(name, "") if name else "")
    return text if not unit or noted(f"{text} in {unit}") else f"{text} ({unit})"


def label(coordinate: str, step: str = "") -> str:
    """The text of an axis: symbol, and unit where there is one."""
    return with_unit(symbol(coordinate, step), coordinate)


def dress(ax: Axes, x: tuple[str, str], y: tuple[str, str]) -> Axes:
    """Labels on both axes, each given as (coordinate, step), and ticks in pi on angles; after the data."""
    ax.set_xlabel(label(*x))
    ax.set_ylabel(label(*y))
    spans = [float(np.ptp(limits)) for limits in (ax.get_xlim(), ax.get_ylim())]
    if x[0] == y[0]:  # of one kind on both axes
        spans = [max(spans) if max(spans) <= _ALIKE * min(spans) else min(spans)] * 2
    for axis, coordinate, span in ((ax.xaxis, x[0], spans[0]), (ax.yaxis, y[0], spans[1])):
        if is_angle(coordinate):
            angle_ticks(axis, span)
        if axis.get_scale() == "linear" and not isinstance(axis.get_major_locator(), MultipleLocator):
            decimal_ticks(axis)
    return ax
