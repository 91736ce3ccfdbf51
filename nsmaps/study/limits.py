"""What a run of a study will need in memory and time, estimated before anything is computed, and refused beyond a limit.

The estimates count returns, states and images of boxes, with the time and memory that one took on one core of 2025 for the
systems that come with nsmaps. They may be off by a factor of ten, which tells 10^12 returns from 10^6 all the same.
"""

import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError
from nsmaps.study.estimates import GIGABYTE, HOUR, Size
from nsmaps.study.steps import SECTION, steps_of
from nsmaps.study.study import Study

if TYPE_CHECKING:
    from nsmaps.exact.system import ImpactSystem

HOURS = 24.0  #: of the limit where none is given
MEMORY = 8.0  #: gigabytes of the limit where neither it is given nor the machine says how many it has
VARIABLE = "NSMAPS_MAX_{}"


def sizes(study: Study, system: "ImpactSystem") -> dict[str, Size | None]:
    """What each step of a run needs, None for one of which that cannot be said beforehand."""
    sections = [SECTION[name] for name in steps_of(study)[1:]]
    return {made.name: made.size(getattr(study, made.key), study, system) if made.size else None for made in sections}


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
                (SECTION[name].key,),
                f"a run needs about {amount:.2g} {unit} of {what}, most of it for {SECTION[name].key!r}, as estimated; expected: "
                f"at most {most:.3g}, or what is told by --{option} or {VARIABLE.format(option.removeprefix('max-').upper())}",
                key=True,
            )
    return found


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
            f"{VARIABLE.format(name)} is {text if given is None else given!r}; expected: a number above zero, or inf"
        )
    return limit


def _own_memory() -> float:
    """The memory of this machine in gigabytes, where the system says it."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GIGABYTE
    except (AttributeError, ValueError, OSError):
        return MEMORY
