"""What a run of a study will need in memory and time, estimated before anything is computed, and refused beyond a limit.

The estimates count returns, states and images of boxes, with the time and memory that one took on one core of 2025 for the
systems that come with nsmaps. They may be off by a factor of ten, which tells 10^12 returns from 10^6 all the same.
"""

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError
from nsmaps.exact.chain import most_returns
from nsmaps.exact.family import LONG, is_pattern
from nsmaps.study.ranges import Span
from nsmaps.study.spec import FitSection, Study
from nsmaps.study.steps import SECTION, steps_of

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

GIGABYTE, HOUR = 1e9, 3600.0
HOURS = 24.0  #: of the limit where none is given
MEMORY = 8.0  #: gigabytes of the limit where neither it is given nor the machine says how many it has
RETURN, DERIVED, NOISY, IMAGE = 1e-6, 3e-6, 2e-5, 1e-3  #: seconds a return, with its derivative, under noise; an image of a box
VALUE, POINT = 1e-2, 2e-2  #: seconds that a value of a parameter, and a point of a branch, take whatever its returns
UPDATE = 1.0  #: seconds that an update of a domain of the exact map takes; of a polynomial's a tenth
STATE, MEMBER, STORED, CELL = 100.0, 300.0, 150.0, 1e4  #: bytes: state of a grid, of a surface, return of an orbit, cell
COPIES = 3.0  #: of what is kept, while it is written


@dataclass(frozen=True, slots=True)
class Size:
    """What a step needs, in seconds on one core and in bytes of memory."""

    seconds: float = 0.0
    memory: float = 0.0

    def __add__(self, other: "Size") -> "Size":
        return Size(self.seconds + other.seconds, self.memory + other.memory)

    def times(self, count: float) -> "Size":
        """So many of them, all kept."""
        return Size(self.seconds * count, self.memory * count)

    def told(self) -> str:
        """Such as `2 min and 0.3 GB`."""
        return f"{_duration(self.seconds)} on one core and {self.memory / GIGABYTE:.1g} GB of memory"


def sizes(study: Study, system: "ImpactSystem") -> dict[str, Size | None]:
    """What each step of a run needs, None for one of which that cannot be said beforehand."""
    return {name: SIZES[name](study, system) if name in SIZES else None for name in steps_of(study)[1:]}


def total(found: Mapping[str, Size | None]) -> Size:
    """What all steps need together, but for those of which it cannot be said."""
    return sum((size for size in found.values() if size), Size())


def check_sizes(
    study: Study, system: "ImpactSystem", max_memory: float | None = None, max_hours: float | None = None
) -> dict[str, Size | None]:
    """What each step needs, or a StudyError at the section that needs most where all together are beyond a limit.

    Args:
        max_memory: in gigabytes; by default that of the environment variable `NSMAPS_MAX_MEMORY`, else the memory of the machine.
        max_hours: on one core; by default those of `NSMAPS_MAX_HOURS`, else 24.
    """
    found = sizes(study, system)
    known = {name: size for name, size in found.items() if size}
    needs = total(found)
    limits = (
        ("memory", needs.memory / GIGABYTE, memory_limit(max_memory), "GB"),
        ("time", needs.seconds / HOUR, _limit(max_hours, "HOURS", HOURS), "hours"),
    )
    for what, amount, most, unit in limits:
        if not amount <= most:
            name = max(known, key=lambda name: known[name].memory if what == "memory" else known[name].seconds)
            option = "max-memory" if what == "memory" else "max-hours"
            raise study.source.error(
                (SECTION[name],),
                f"a run needs about {amount:.2g} {unit} of {what}, most of it for {SECTION[name]!r}, as estimated; accepted: "
                f"at most {most:.3g}, or what is told by --{option} or {VARIABLE.format(option.removeprefix('max-').upper())}",
                key=True,
            )
    return found


VARIABLE = "NSMAPS_MAX_{}"


def memory_limit(given: float | None = None) -> float:
    """Gigabytes that a run may need: those given, of the environment, or of the machine."""
    return _limit(given, "MEMORY", _own_memory())


def _limit(given: float | None, name: str, default: float) -> float:
    """The limit that is given, by a call or in the environment; zero or less, or no number, is an error."""
    text = os.environ.get(VARIABLE.format(name), "")
    try:
        limit = given if given is not None else float(text) if text else default
    except ValueError:
        limit = math.nan
    if not limit > 0:
        raise NsmapsError(
            f"{VARIABLE.format(name)} is {text if given is None else given!r}; accepted: a number above zero, or inf"
        )
    return limit


def _own_memory() -> float:
    """The memory of this machine in gigabytes, where the system says it."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GIGABYTE
    except (AttributeError, ValueError, OSError):
        return MEMORY


def _duration(seconds: float) -> str:
    for unit, length in (("years", 8766 * HOUR), ("days", 24 * HOUR), ("h", HOUR), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.2g} {unit}"
    return f"{seconds:.0f} s" if seconds >= 1 else f"{seconds:.1g} s"


def _states(grid: Mapping[str, Span] | None) -> float:
    return math.prod(float(span.points) for span in (grid or {}).values())


def _longest(study: Study) -> int:
    """Returns in a row that the longest word of a family may make."""
    words = [word for family in study.families.values() for word in family]
    return max((LONG if is_pattern(word) else most_returns(word) for word in words), default=1)


def _surface(study: Study, states: float, families: int) -> Size:
    """The surfaces of some families over a grid."""
    return Size(RETURN * states * _longest(study), states * (STATE + COPIES * MEMBER * families))


def _surfaces(study: Study, system: "ImpactSystem") -> Size:
    return _surface(study, _states(study.grid), max(1, len(study.families)))


def _slices(study: Study, system: "ImpactSystem") -> Size:
    points = sum(_states(section.along) for section in study.slices)
    return Size(RETURN * points, COPIES * STATE * points)


def _diagonal(study: Study, system: "ImpactSystem") -> Size:
    section = study.diagonal
    assert section is not None
    values = section.sweep.points if section.sweep else 1
    states = _states(section.grid or study.grid)
    fits = sum((_fit(fit, states) for fit in section.orders.values()), Size())
    return _surface(study, states, 1).times(values) + fits.times(1 + len(section.deltas))


def _fit(fit: FitSection, states: float) -> Size:
    """A least-squares problem of so many states, dense in the terms."""
    degrees = [d for each in (fit.full or {}).values() for d in ([each] if isinstance(each, int) else each.values())]
    terms = math.prod(float(degree + 1) for degree in degrees[:2]) if degrees else 50.0
    return Size(1e-9 * states * terms * terms, 8.0 * COPIES * states * terms)


def _pieces(study: Study) -> Size:
    states = _states(study.grid)
    return sum((_fit(piece.fit, states) for piece in study.composite if piece.fit), Size())


def _composite(study: Study, system: "ImpactSystem") -> Size:
    return _pieces(study)


def _parametric(study: Study, system: "ImpactSystem") -> Size:
    section = study.parametric
    assert section is not None
    nodes = section.nodes or 2 * section.order + 1
    made = _surfaces(study, system) + Size(seconds=_pieces(study).seconds)
    return made.times(2 * nodes + 1) + Size(memory=_pieces(study).memory)


def _orbits(study: Study, system: "ImpactSystem") -> Size:
    return sum((Size(3 * RETURN, 2 * COPIES * STORED).times(orbit.returns) for orbit in study.orbits), Size())


def _bifurcation(study: Study, system: "ImpactSystem") -> Size:
    section = study.bifurcation
    assert section is not None
    values = float(section.points * (2 if section.follow == "both" else 1))
    one = Size(VALUE + RETURN * (section.transient + 5 * section.returns), COPIES * STORED * section.returns)
    refit = Size(seconds=_surfaces(study, system).seconds + _pieces(study).seconds)
    return one.times(values * len(section.of)) + refit.times(values if "composite" in section.of else 0)


def _branches(study: Study, system: "ImpactSystem") -> Size:
    """Points a branch by its longest step; the cycles of a doubled one have twice the period."""
    found = Size()
    for section in study.branches:
        points = len(section.ways) * 2 / section.step
        for doubled in range(section.doublings + 1):
            period = float(section.period) * 2**doubled
            found += Size(POINT + 20 * DERIVED * period, COPIES * STORED * period).times(points)
    return found


def _stability(study: Study, system: "ImpactSystem") -> Size:
    section = study.stability
    assert section is not None
    one = Size(VALUE + RETURN * (section.transient + 10.0 * section.longest), COPIES * (STATE + STORED * section.longest))
    return one.times(float(section.along.points) * section.across.points)


def _lyapunov(study: Study, system: "ImpactSystem") -> Size:
    section = study.lyapunov
    assert section is not None
    return Size(VALUE + DERIVED * (section.transient + section.returns), COPIES * STATE).times(section.points)


def _basins(study: Study, system: "ImpactSystem") -> Size:
    section = study.basins
    assert section is not None
    one = Size(RETURN * (section.returns + 2.0 * section.longest), COPIES * STATE + STORED * section.longest)
    return one.times(_states(study.grid))


def _noise(study: Study, system: "ImpactSystem") -> Size:
    section = study.noise
    assert section is not None
    usual = min(float(system.period()) / 100, section.tau / 10)
    one = Size(NOISY * max(1.0, usual / (section.step or usual)), COPIES * STORED)
    found = one.times(float(section.returns) * section.realisations * len(section.sigma))
    if (along := section.impacts) is not None:
        kept = Size(memory=COPIES * STORED).times(4.0 * along.points * along.returns)
        found += kept + Size(one.seconds).times(4.0 * along.points * (along.transient + along.returns))
    return found


def _domains(study: Study, system: "ImpactSystem") -> Size:
    """All updates that are asked for, though most domains come to rest before."""
    of_pieces = {piece.name for piece in study.composite}
    each = [(UPDATE / 10 if d.map in of_pieces else UPDATE) * (3 if d.grow else 1) * d.updates for d in study.domains]
    return Size(sum(each), 1e5 * float(sum(d.updates for d in study.domains)))


def _morse(study: Study, system: "ImpactSystem") -> Size:
    assert study.morse is not None
    return _cover(study.morse.cells, len(system.coordinates), study.morse.depth)


def _transient(study: Study, system: "ImpactSystem") -> Size:
    assert study.transient is not None
    return _cover(study.transient.cells, len(system.coordinates), study.transient.depth)


def _cover(cells: int, coordinates: int, depth: int) -> Size:
    """The first level whole, then twice as many cells a level: of what is thin, such as an attractor or an edge."""
    count = float(cells) ** coordinates * 2.0**depth
    return Size(IMAGE, CELL).times(count)


SIZES: Mapping[str, Callable[[Study, "ImpactSystem"], Size]] = {
    "surfaces": _surfaces,
    "slices": _slices,
    "diagonal": _diagonal,
    "composite": _composite,
    "parametric": _parametric,
    "orbits": _orbits,
    "bifurcation": _bifurcation,
    "branches": _branches,
    "stability": _stability,
    "lyapunov": _lyapunov,
    "basins": _basins,
    "noise": _noise,
    "domains": _domains,
    "morse": _morse,
    "transient": _transient,
}
