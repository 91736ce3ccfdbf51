"""The steps of a study that rest on enclosures of the exact map: what stays in a window, what is left, cycles."""

from itertools import count
from typing import Any

from nsmaps.errors import NsmapsError
from nsmaps.study.plan import Plan
from nsmaps.study.result import StudyResult


def morse(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """A cover of what stays in a window, and the closed set about its first minimal component."""
    from nsmaps.auxiliary.cover import morse_sets, trap

    section = plan.study.morse
    assert section is not None
    told = plan.levels(0, 1, section.depth)
    with plan.study.source.located(("morse",)):
        window, levels = plan.windows["morse"].array, count()
        cover = morse_sets(plan.system, window, section.depth, section.cells, progress=lambda _: told(next(levels)))
    if not cover.finished:  # by Ctrl-C: a run that goes on begins this step anew
        raise KeyboardInterrupt
    return {"morse": cover, "trap": trap(plan.system, cover, cover.minimal[0]) if cover.minimal else None}


def transient(plan: Plan, result: StudyResult) -> dict[str, Any]:
    """What of the regions of the composite map is left and arrives, and the cycles up to a period."""
    from nsmaps.auxiliary.search import find_cycles
    from nsmaps.auxiliary.transient import transient

    section, window = plan.study.transient, plan.windows["transient"].array
    assert section is not None
    target = result.trap if result.trap is not None and result.trap.trapped else None
    how = section.depth, section.cells
    with plan.study.source.located(("transient",)):
        if result.composite is None:
            raise NsmapsError("strips have no regions; accepted: a 'composite' map, or a 'partition' of closed forms")
        searched = plan.levels(0, 2, section.depth)
        found = find_cycles(plan.system, window, section.period, *how, progress=searched) if section.period else None
        cycles, told = found.cycles if found else (), plan.levels(1, 2, section.depth)
        made = transient(plan.system, result.composite, window, *how, target=target, cycles=cycles, progress=told)
    return {"cycles": found, "transient": made}
