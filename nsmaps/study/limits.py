"""Estimates of the memory and time of a run before anything is computed; a run beyond a limit is refused.

The estimates are counts of returns, states and images of boxes, multiplied by the time and memory of one on a core of 2025 for
the systems included in nsmaps. They are correct to a factor of ten.
"""

import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from nsmaps.errors import NsmapsError
from nsmaps.study.estimates import GIGABYTE, HOUR, INTEGRATED, Size
from nsmaps.study.steps import analyses_by_step
from nsmaps.study.study import Study

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

HOURS = 24.0  #: default limit
MEMORY = 8.0  #: gigabytes, the default limit where the memory of the machine is unknown
VARIABLE = "NSMAPS_MAX_{}"


def sizes(study: Study, system: "System") -> dict[str, Size | None]:
    """The size of each step of a run, None where it cannot be estimated."""
    with study.source.located(("system",)):
        longer = INTEGRATED if system.is_integrated else 1.0
    found = {name: analysis.size(study, system) for name, analysis in analyses_by_step(study).items()}
    return {name: size and Size(longer * size.seconds, size.memory) for name, size in found.items()}


def total(found: Mapping[str, Size | None]) -> Size:
    """The sum of the known sizes."""
    return sum((size for size in found.values() if size), Size())


def check_sizes(
    study: Study, system: "System", max_memory: float | None = None, max_hours: float | None = None
) -> dict[str, Size | None]:
    """The size of each step; raises StudyError at the section with the largest share if the sum exceeds a limit.

    Args:
        max_memory: in gigabytes; by default the value of the environment variable `NSMAPS_MAX_MEMORY`, else the memory of the
            machine.
        max_hours: on one core; by default the value of `NSMAPS_MAX_HOURS`, else 24.
    """
    found = sizes(study, system)
    known = {name: size for name, size in found.items() if size}
    needs = total(found)
    limits = (
        ("memory", needs.memory / GIGABYTE, memory_limit(max_memory), "GB"),
        ("time", needs.seconds / HOUR, _limit(max_hours, "HOURS", HOURS), "hours"),
    )
    for what, amount, limit, unit in limits:
        if not amount <= limit:
            name = max(known, key=lambda name: known[name].memory if what == "memory" else known[name].seconds)
            option = "max-memory" if what == "memory" else "max-hours"
            raise study.source.error(
                (key := analyses_by_step(study)[name].key,),
                f"a run is estimated to need {amount:.2g} {unit} of {what}, most of it for {key!r}; expected: "
                f"at most {limit:.3g}, or another limit by --{option} or {VARIABLE.format(option.removeprefix('max-').upper())}",
                key=True,
            )
    return found


def memory_limit(given: float | None = None) -> float:
    """The limit of memory in gigabytes: as given, from the environment, or the memory of the machine."""
    return _limit(given, "MEMORY", _own_memory())


def _limit(given: float | None, name: str, default: float) -> float:
    """The limit as given, from the environment, or the default; raises NsmapsError unless it is a positive number."""
    text = os.environ.get(VARIABLE.format(name), "")
    try:
        limit = given if given is not None else float(text) if text else default
    except ValueError:
        limit = math.nan
    if not limit > 0:
        raise NsmapsError(f"{VARIABLE.format(name)} is {text if given is None else given!r}; expected: a positive number, or inf")
    return limit


def _own_memory() -> float:
    """The memory of this machine in gigabytes, or the default where it is unknown."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GIGABYTE
    except (AttributeError, ValueError, OSError):
        return MEMORY
