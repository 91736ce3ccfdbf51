"""The section `basins`: basins of attraction of the exact map over a grid, and of the composite map beside them."""

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import Field

from nsmaps.dynamics.motion import MEANING, kind_of
from nsmaps.figures.parts import plane
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.validation.counterpart import counterpart
from nsmaps.study.conclusions.phrases import at
from nsmaps.study.conclusions.texts import count_of, cycle_of, grid_text, percent, plain, returns_text, shares_text
from nsmaps.study.estimates import COPIES, RETURN, STATE, STORED, Size, states
from nsmaps.study.pictures.figure import FigurePart, StudyFigure, optional
from nsmaps.study.reading.values import Compared, MaxPeriod, MaxReturns, Side, Tolerance
from nsmaps.study.sections.base import Finding, Need, Quantified, Quantifiers, Table

if TYPE_CHECKING:
    from nsmaps.dynamics.attractors.basins import BasinBoundary, Basins
    from nsmaps.exact.surfaces.surface import Grid
    from nsmaps.study.sections.base import Binding, Plan, Study, StudyResult, System

MOST = 6  #: attractors that a sentence lists
LONG = 24  #: largest number of letters of the words in a row


def _over_plane(result: "StudyResult") -> "Basins | Mapping[str, Basins] | None":
    """Basins over a plane through the states, of both maps by title where there are two."""
    found, reduced = result.basins, result.reduced_basins
    if found is None or found.grid is None:
        return None
    plane(found.grid)
    return found if reduced is None else {result.system.map_name: found, "composite map": reduced}


BASINS: "FigurePart[Basins | Mapping[str, Basins]]" = FigurePart("basins over a grid", ("basins",), _over_plane)


class BasinsSection(Quantified):
    """Basins of attraction of the exact map over a grid."""

    key: ClassVar[str] = "basins"
    quantified: ClassVar[str] = "nsmaps.dynamics.attractors.basins:Basins"
    results: ClassVar[Mapping[str, Any]] = {
        "basins": None,  #: of the grid
        "basin_boundary": None,  #: between them
        "reduced_basins": None,  #: those of the composite map, if the study requests them
        "same_attractor": None,  #: for each attractor of the composite map, the index of that of the exact map it is on
    }
    figures: ClassVar[tuple[StudyFigure, ...]] = (
        StudyFigure(
            "longrun.basins",
            "The plane of states coloured by the attractor reached, beside the number of returns taken.",
            "Basins of attraction over the grid: the attractor that each state reaches, with the share of its basin, and the "
            "number of returns taken. Marks are states of the attractors.",
            (BASINS, optional("same_attractor")),
        ),
    )

    starts: dict[str, Side] | None = Field(None, description="a grid of its own; the study's by default")
    max_returns: MaxReturns = 1000
    tolerance: Tolerance = 1e-6
    max_period: MaxPeriod = 32
    quantifiers: Quantifiers = Field(default_factory=dict)
    boundary: Number | None = Field(None, gt=0, description="find points between basins by bisection to this distance")
    map: Compared = Field(("exact",), description="the maps; the basins of `composite` are compared with those of `exact`")

    def needs(self) -> Iterator[Need]:
        if self.starts is None:
            yield ("basins",), "'basins' without 'starts' of its own", "grid"
        if "composite" in self.map:
            yield ("basins", "map"), "the basins of the composite map", "composite"

    def bind(self, binding: "Binding") -> "Grid":
        self.functions(binding.study)
        loc, starts = (("basins", "starts"), self.starts) if self.starts else (("grid",), binding.study.grid)
        return binding.grid(loc, starts)

    def compute(self, plan: "Plan", result: "StudyResult") -> dict[str, Any]:
        """The basins over the grid, and the points on their boundaries if the study requests them."""
        from nsmaps.dynamics.attractors.arrivals import follow
        from nsmaps.dynamics.attractors.basins import basin_boundary, basins

        how = self.model_dump(include={"max_returns", "tolerance", "max_period"})
        how["quantifiers"] = self.functions(plan.study)
        both = "composite" in self.map
        first = plan.portion(0, 2, "exact") if both else plan.parallel
        found = basins(plan.system, plan.bound["basins"], **how, parallel=first)
        line = None
        if self.boundary is not None:
            line = basin_boundary(plan.system, found, tolerance=self.boundary, max_returns=self.max_returns)
        if not both or result.composite is None:
            return {"basins": found, "basin_boundary": line}
        reduced = basins(result.composite, plan.bound["basins"], **how, parallel=plan.portion(1, 2, "composite"))
        there = counterpart(plan.system, result.composite)
        last = np.array([each.states[-1] for each in reduced.attractors]).reshape(-1, found.start.shape[1])
        same = follow(there, last, found.attractors, self.max_returns).label
        return {"basins": found, "basin_boundary": line, "reduced_basins": reduced, "same_attractor": same}

    def describe(self, study: "Study") -> str:
        grid = self.starts or study.grid
        total = returns_text(int(states(grid)) * self.max_returns)
        return f"{grid_text(grid)}, up to {self.max_returns} returns each; at most {total}"

    def size(self, study: "Study", system: "System") -> Size:
        one = Size(RETURN * (self.max_returns + 2.0 * self.max_period), COPIES * STATE + STORED * self.max_period)
        return one.times(states(self.starts or study.grid))

    def numbers(self, result: "StudyResult") -> dict[str, Any]:
        """Each attractor with its fraction of the grid, the most returns to reach it, and its distance from the boundary."""
        basins, line = result.basins, result.basin_boundary
        rows = []
        for k, attractor in enumerate(basins.attractors):
            row = {"label": attractor.label, "period": attractor.period, "words": list(attractor.words)}
            row |= {"fraction": float(basins.fractions[k]), "error": float(basins.fraction_error[k])}
            values = {name: plain(values[k]) for name, values in basins.quantifiers.items()}
            row |= {"quantifiers": values} if values else {}
            arrival = basins.arrival[basins.label == k]
            row |= {"most_returns": int(arrival.max()) if arrival.size else None}
            rows.append(row | ({} if line is None else {"distance": plain(np.array([line.distance(k)]))[0]}))
        kinds: dict[str, Any] = dict(zip(("unresolved", "ended"), basins.fractions[-2:].tolist(), strict=True))
        if (reduced := result.reduced_basins) is not None:
            found = zip(reduced.attractors, reduced.fractions.tolist(), strict=False)
            attractors = [{"label": each.label, "period": each.period, "fraction": share} for each, share in found]
            kinds["composite"] = {"attractors": attractors, "same": alike(result)}
        return {"basins": {"attractors": rows, **kinds, "stuck_on_the_way": float(basins.stuck.mean())}}

    def findings(self, result: "StudyResult") -> Iterator[Finding]:
        """The number of attractors and of starts, and the share of the starts that reach each."""
        found = result.basins
        names = [each.label for each in found.attractors]
        kinds = [f"a {cycle_of(each.period)}" if each.period else MEANING[kind_of(each.label)] for each in found.attractors]
        shares = found.fractions.tolist()
        each = zip(shares, kinds, names, strict=False)
        listed = [f"{percent(share)} to {kind} ({name})" for share, kind, name in islice(each, MOST)]
        listed += [f"{percent(sum(shares[MOST:-2]))} to the others"] if len(names) > MOST else []
        ends = (("to none", shares[-2]), ("ended", shares[-1]))
        listed += [f"{percent(share)} {what}" for what, share in ends if share > 0]
        text = f"{count_of(len(names), 'attractor')} found from {len(found.label)} states of the grid: {', '.join(listed)}"
        numbers = [(percent(share), f"of the starts reach {name}") for name, share in zip(names, shares, strict=False)]
        numbers += [(percent(share), f"of the starts, {what}") for what, share in ends if share > 0]
        yield Finding(result.system.map_name, text, tuple(numbers))

    def tables(self, result: "StudyResult") -> Iterator[Table]:
        """The attractors, and the percentage of the states of the grid that reach each."""
        basins = result.basins
        far = "to boundary" if result.basin_boundary is not None else ""
        note = "within: returns after which all these states have reached it"
        note += "; to boundary: the smallest distance of the attractor from it." if far else "."
        heads = "attractor", "period", "words", "share", "within", far
        title = f"Basins of the {result.system.map_name}, of {len(basins.label)} states of the grid"
        yield Table(title, heads, tuple(_rows(basins, result.basin_boundary, self.max_returns)), (note,))
        if result.reduced_basins is not None:
            title = f"Basins of the composite map, of {len(basins.label)} states of the grid"
            note = f"{percent(alike(result))} of the states come to the attractor of the exact map."
            yield Table(
                title, heads[:-1], tuple(row[:-1] for row in _rows(result.reduced_basins, None, self.max_returns)), (note,)
            )

    def caption(self, result: "StudyResult", figure: str, part: str) -> str:
        """The share of each basin."""
        found = result.basins
        names = [f"{each.label or 'attractor'} ({number})" for number, each in enumerate(found.attractors, 1)]
        shares = dict(zip([*names, "no attractor", "the orbit ends"], found.fractions.tolist(), strict=True))
        return f"{at(result)}{len(found.label):,} states, of which reach {shares_text(shares)}."


def alike(result: "StudyResult") -> float:
    """The share of the states of the grid that come to the same attractor under both maps, of those that come to one."""
    exact, reduced, same = result.basins, result.reduced_basins, result.same_attractor
    if exact is None or reduced is None or same is None:
        return float("nan")
    known = exact.label >= 0
    to = np.append(same, [-1, -1])[reduced.label]
    return float((to == exact.label)[known].mean()) if known.any() else float("nan")


def _rows(basins: "Basins", line: "BasinBoundary | None", returns: int) -> list[tuple[str, ...]]:
    """A row per attractor: motion, period, words, share of the starts, most returns to reach it, distance from the boundary.

    Further rows are for starts that reached none in so many returns, and for those whose orbits ended.
    """
    rows: list[tuple[str, ...]] = []
    for k, (attractor, share) in enumerate(zip(basins.attractors, basins.fractions, strict=False)):
        words = " ".join(attractor.words)
        arrival = basins.arrival[basins.label == k]
        most_returns = str(arrival.max()) if arrival.size else ""
        far = "" if line is None else f"{line.distance(k):.3g}"
        period = str(attractor.period) if attractor.period else "none"
        rows.append((attractor.label, period, words if len(words) <= LONG else "several", percent(share), most_returns, far))
    others = {f"none within {returns} returns": basins.fractions[-2], "the orbit ends": basins.fractions[-1]}
    return rows + [(name, "", "", percent(share), "", "") for name, share in others.items() if share > 0]
