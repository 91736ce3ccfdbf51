"""The section `manifolds`: stable and unstable manifolds of saddles of the exact map."""

from collections.abc import Iterator, Mapping
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from nsmaps.arrays import Floats
from nsmaps.errors import NsmapsError
from nsmaps.progress import beat
from nsmaps.reduced.conditions.condition import Number
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import point
from nsmaps.study.estimates import COPIES, DERIVED, STATE, Size
from nsmaps.study.pictures.figure import FigurePart, StudyFigure
from nsmaps.study.reading.values import Name, Period, Section
from nsmaps.study.sections.base import Entries, Finding, Table, Verdict, verdict
from nsmaps.study.sections.maps.surfaces import areas_by_surface, over_plane

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axes import Axes

    from nsmaps.dynamics.manifolds.manifold import Manifold
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

WHOLE = ("length", "an attractor")  #: first words of the reasons of sides that were grown as far as they go


class ManifoldSection(Section):
    """The manifolds of the saddle near a state.

    A start that leads to no saddle, or to one without the manifold, gives a verdict that says why.
    """

    name: Name = Field(description="name of the saddle")
    start: dict[str, Number] = Field(description="a state near the saddle")
    period: Period = 1
    scale: dict[str, Annotated[Number, Field(gt=0)]] | None = Field(
        None, description="unit of each coordinate; by default the extent of the motion of the saddle, a radian of an angle"
    )
    which: Literal["both", "unstable", "stable"] = Field("both", description="which of its manifolds")
    length: Number = Field(10.0, gt=0, description="arclength of each side, in radians and extents of the motion of the saddle")
    gap: Number = Field(0.02, gt=0, description="largest distance of neighbours, in the same units")
    max_points: int = Field(100_000, ge=2, description="largest number of states of a side")


def _grown(result: "StudyResult") -> "Sequence[Manifold]":
    """The manifolds of all saddles; NsmapsError with the reasons where none has any."""
    found = [each for some in result.manifolds.values() for each in some]
    if result.manifolds and not found:
        raise NsmapsError(next(iter(result.no_manifold.values())))
    return found


def _below(result: "StudyResult") -> "Callable[[Axes], Axes] | None":
    """The panel over which manifolds are drawn."""
    if result.basins is not None:
        return partial(import_module("nsmaps.figures.longrun.basins").basins, result.basins)
    if not (shown := over_plane(result)):
        return None
    words = import_module("nsmaps.figures.returns.words").words
    return partial(words, shown, mesh=areas_by_surface(result), diagonal=result.diagonal)


MANIFOLDS: "FigurePart[Sequence[Manifold]]" = FigurePart("manifolds of saddles", ("manifolds",), _grown)
BELOW: "FigurePart[Callable[[Axes], Axes]]" = FigurePart("basins or families", (), _below, optional=True)


class Manifolds(Entries[ManifoldSection]):
    """Stable and unstable manifolds of saddles of the exact map, of two coordinates."""

    key: ClassVar[str] = "manifolds"
    results: ClassVar[Mapping[str, Any]] = {
        "manifolds": {},  #: by name: the unstable one, then the stable one
        "no_manifold": {},  #: by name, the reasons why one or both of them are not there
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "longrun.manifolds",
            "The stable and unstable manifolds of saddles as lines in the plane of states.",
            "The stable (black) and unstable (red) manifolds of the saddles (crosses), grown to the lengths of the study and "
            "interrupted where the map jumps, over the basins or the words where the study has them. A saddle is enlarged of "
            "which both manifolds are shown.",
            (MANIFOLDS, BELOW),
        ),
    )

    def check(self, study: "Study") -> None:
        study.once("manifolds", [each.name for each in self])

    def bind(self, binding: "Binding") -> tuple[tuple[Floats, Floats | None], ...]:
        """The starts and scales, each of shape (n,)."""

        def state(key: str, number: int, given: dict[str, float] | None) -> Any:
            return None if given is None else binding.start(("manifolds", number, key), given)

        return tuple((state("start", number, each.start), state("scale", number, each.scale)) for number, each in enumerate(self))

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The manifolds of each saddle, or the reason why there are none."""
        from nsmaps.dynamics.manifolds.manifold import manifold
        from nsmaps.dynamics.periodic import periodic_orbit

        found: dict[str, tuple[Manifold, ...]] = {}
        reasons: dict[str, str] = {}
        for number, each in enumerate(self):
            start, scale = plan.bound["manifolds"][number]
            orbit, own = periodic_orbit(plan.system, start, each.period, scale=scale), []
            why = list[str]()
            for which in ("unstable", "stable"):
                if each.which in ("both", which):
                    try:
                        own.append(
                            manifold(plan.system, orbit, which, length=each.length, gap=each.gap, max_points=each.max_points)
                        )
                    except NsmapsError as error:
                        why.append(str(error))
            found[each.name] = tuple(own)
            reasons |= {each.name: "; ".join(dict.fromkeys(why))} if why else {}
            beat((number + 1) / len(self))
        return {"manifolds": found, "no_manifold": reasons}

    def describe(self, study: "Study") -> str:
        return ", ".join(f"{each.name} ({each.which}, length {each.length:g})" for each in self)

    def size(self, study: "Study", system: "System") -> Size:
        """States by length and gap, two sides at each state of the saddle; each is inserted and mapped several times."""
        found = Size()
        for each in self:
            sides = 2.0 * each.period * (2 if each.which == "both" else 1)
            found += Size(10 * DERIVED * each.period, COPIES * STATE).times(
                sides * min(2 * each.length / each.gap, each.max_points)
            )
        return found

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        rows = {name: [_row(each) for each in some] for name, some in result.manifolds.items()}
        return {"manifolds": rows | {f"{name}: none": why for name, why in result.no_manifold.items()}}

    def verdicts(self, result: "StudyResult") -> Iterator[Verdict]:
        """Whether each manifold was grown to its length, or to an attractor, on every side."""
        for each in self:
            own = result.manifolds.get(each.name)
            if own is None:
                continue
            ends = [f"{one.which}: {', '.join(dict.fromkeys(one.ended))}" for one in own]
            why = result.no_manifold.get(each.name, "")
            holds = not why and all(end.startswith(WHOLE) for one in own for end in one.ended)
            name = f"manifolds of {each.name}: grown to their length or to an attractor"
            yield verdict(name, result.system.map_name, holds, "; ".join(filter(None, [*ends, why])))

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """Each saddle, with the multiplier along each manifold, and the length that this has."""
        for name, some in result.manifolds.items():
            if not some:
                continue
            saddle = point(result.system.coordinates, some[0].saddle[0])
            lengths = [(one, float(one.arclength.max())) for one in some]
            grown = " and ".join(f"its {one.which} manifold of length {length:.3g} to a side" for one, length in lengths)
            numbers = [(f"{one.multiplier:.5g}", f"multiplier of {name} along its {one.which} manifold") for one in some]
            numbers += [(f"{len(one.states):,}", f"states of the {one.which} manifold of {name}") for one in some]
            period = f" of {len(some[0].saddle)} returns" if len(some[0].saddle) > 1 else ""
            yield Finding(result.system.map_name, f"a saddle{period} ({name}) at {saddle}, with {grown}", tuple(numbers))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The saddles, with what was grown from them."""
        rows = []
        for name, some in result.manifolds.items():
            for each in some:
                state = ", ".join(f"{x:.6g}" for x in each.saddle[0])
                lengths = np.array([each.arclength[each.side == k].max() for k in range(int(each.side.max()) + 1)])
                pieces = f"{len(each.states)} states, {len(each.lines)} pieces"
                rows.append((name, each.which, f"({state})", f"{each.multiplier:.6g}", f"{lengths.max():.4g}", pieces))
        heads = "saddle", "manifold", "at", "multiplier", "longest side", ""
        if rows:
            yield Table("Manifolds of saddles", heads, tuple(rows), ("Lengths: a radian, or the extent of the saddle's motion.",))

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The saddles, with the states and pieces of each of their manifolds."""
        rows = [
            f"{name}, {each.which}: {len(each.states):,} states in {len(each.lines)} pieces"
            for name, some in result.manifolds.items()
            for each in some
        ]
        return f"{at(result)}{'; '.join(rows)}." if rows else ""


def _row(each: "Manifold") -> dict[str, Any]:
    about = {"which": each.which, "saddle": each.saddle.tolist(), "multiplier": each.multiplier, "error": each.error}
    return about | {"states": len(each.states), "pieces": len(each.lines), "ended": list(each.ended)}
