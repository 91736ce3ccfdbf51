"""Pictures drawn from what is kept: measured times from tables, what is proved from a certificate."""

import re
from hashlib import sha256
from pathlib import Path

from matplotlib.lines import Line2D

from nsmaps.bench.plot import sheet
from nsmaps.bench.result import BenchResult, Row
from nsmaps.cells.certified import Orders
from nsmaps.figures.cells.proved import sheet as proved
from nsmaps.figures.page import Sheet
from nsmaps.figures.style import BLUE, GREEN, RED
from nsmaps.verify.certificate import read

CERTIFICATE = Path(__file__).parents[1] / "certificates" / "fp-coarse.proof"
MEASURED = Path(__file__).parents[1] / "benchmarks"  #: the folder of the tables
_PROGRAM = re.compile(r"(?P<family>C loop|nsmaps|NumPy)(?: (?P<setting>.*))?|(?P<other>.*?)(?: (?P<tolerance>[\d.]+e[-+]\d+))?")
_COLOURS = {"accurate": BLUE, "closed form": GREEN, "exact": RED}
_MARKERS = "os^"  #: of the values of d


def text_of(table: str) -> str:
    """The lines of a table, or the hash of the certificate."""
    if table == "proved":
        return sha256(CERTIFICATE.read_bytes()).hexdigest()
    return (MEASURED / f"{table}.txt").read_text(encoding="utf-8")


def rows_of(table: str) -> list[list[str]]:
    """The cells of a table, without its head."""
    return [[cell.strip() for cell in line.strip("| ").split("|")] for line in text_of(table).splitlines()[2:]]


def bench() -> BenchResult:
    """The benchmark as its table has it."""
    return BenchResult(tuple(_row(*cells) for cells in rows_of("bench")), "C loop plain", {}, 60)


def _row(program: str, returns: str, time: str, ratio: str, worst: str, quantile: str, wrong: str, hard: str) -> Row:
    found = _PROGRAM.fullmatch(program)
    family, setting = found["family"] or found["other"], found["setting"] or found["tolerance"] or ""
    missed = int(wrong.split(" of ")[0])
    return Row(family, setting, "", int(returns), (float(time) / 1e6,), float(worst), float(quantile), missed, int(hard))


def surrogates() -> dict[tuple[str, str], list[tuple[float, float]]]:
    """Processor time, nanoseconds a state, and largest error, by kind of map and value of d, in the order of the tolerances."""
    points: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for cells in rows_of("surrogates"):
        points.setdefault((cells[1], cells[0]), []).append((float(cells[5]), float(cells[6])))
    return points


def _surrogates(ax):
    runs = surrogates()
    markers = dict(zip(dict.fromkeys(d for _, d in runs), _MARKERS, strict=True))
    for (name, d), points in runs.items():
        ax.semilogy(*zip(*points, strict=True), marker=markers[d], color=_COLOURS[name], lw=0.6, ms=4)
    kinds = [(colour, f"{name} (attracting pieces)" if name == "closed form" else name) for name, colour in _COLOURS.items()]
    handles = [Line2D([], [], color=colour, label=label) for colour, label in kinds]
    handles += [Line2D([], [], color="0.3", ls="", marker=marker, ms=4, label=f"$d$ = {d}") for d, marker in markers.items()]
    ax.set(xlim=(0, None), xlabel="processor time (ns a state)", ylabel="largest held-out error of\nspeed or phase (rad)")
    ax.grid(color="0.9")
    ax.set_axisbelow(True)
    ax.legend(handles=handles)
    return ax


def draw(table: str, folder: Path, dpi: float) -> Path:
    """The picture of a table as a PNG in a folder."""
    if table == "proved":
        certificate = read(CERTIFICATE)
        drawn = proved(Orders.of(certificate), [(certificate.trap["wall"], *certificate.trap["centre"], True)], table)
    else:
        drawn = sheet(bench(), table) if table == "bench" else Sheet(table, (_surrogates,), 1, 0.6, legend=True)
    return drawn.save(folder, ("png",), dpi)[0]
