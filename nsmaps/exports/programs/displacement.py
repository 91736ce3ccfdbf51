"""The first return of an impact system whose flights are in closed form, from `exact/engine`."""

from nsmaps.exact.engine.flight import layout
from nsmaps.exact.engine.kernel import SpectralKernel
from nsmaps.exact.engine.observers import first_return
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.exact.words import CHATTER, REST
from nsmaps.exports.engine.kinds import BOOL, FLOAT, Record
from nsmaps.exports.programs.laws import REBOUND, law_texts
from nsmaps.exports.programs.program import FirstReturn
from nsmaps.exports.programs.templates import DISPLACEMENT

ADDRESSES = (layout.LAW, layout.LAW_SLOPE, layout.BALL_LAW)  #: in a table, two each: of compiled laws, which a program has itself


def displacement_return(system: ImpactSystem) -> FirstReturn:
    """The first return of an impact system at its parameters.

    Raises:
        NsmapsError: flights that are integrated, or an impact law without a counterpart.
    """
    kernel = system._kernel().closed_form("programs of the exact map")
    table = kernel.table.copy()
    for place in ADDRESSES:
        table[place : place + 2] = 0.0
    flow = Record("flow", kernel.flow._replace(table=table), constant=("table",))
    letters = tuple(system.letters)
    return FirstReturn(
        system=system,
        n=2,
        about=[
            f"State: impact speed v on the wall {letters[0]} just before the impact, at least 0, in the system's units; "
            "phase phi in radians.",
            f"Impact words: a letter for each impact ({' and '.join(letters)}), {CHATTER} for chatter, "
            f"{REST} for a rest on a wall.",
        ],
        coordinates="impact speed and phase, in [0, 2 pi)",
        letters=letters,
        outcomes=(*range(Outcome.simultaneous.value), Outcome.endless.value),
        entry=first_return,
        kinds=[flow, FLOAT, FLOAT, FLOAT, BOOL],
        memory=flow,
        fixed=(),
        own={"rebound": (FLOAT, FLOAT)},
        directions=0,
        texts=DISPLACEMENT,
        laws=lambda language: _rebound(kernel, language),
    )


def _rebound(kernel: SpectralKernel, language: str) -> str:
    """The function of the speed after an impact and its derivative."""
    first = 1 if language == "julia" else 0
    laws = law_texts(kernel, "flow_table", first)
    lower, upper = (
        ", ".join(law or (f"flow_table[{place}] * v", f"flow_table[{place}]"))
        for law, place in zip(laws, range(layout.RESTITUTION + first, layout.RESTITUTION + first + 2), strict=True)
    )
    return REBOUND[language].substitute(lower=lower, upper=upper)
