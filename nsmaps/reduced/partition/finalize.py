"""Step vii: the composite map with resets outside of the grid's box, and its errors at held-out states."""

from collections import Counter
from collections.abc import Container
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returnmap import ReturnMap
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.reduced.composite.composite import CompositeMap
from nsmaps.reduced.partition.candidates import box_of
from nsmaps.reduced.partition.orders import errors
from nsmaps.reduced.partition.result import LogRow, PartitionResult
from nsmaps.reduced.validation.destinations import ends, random_states

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System
    from nsmaps.reduced.partition.refine import Leaf, Refinement
    from nsmaps.reduced.partition.spec import Partition

VALIDATION = 20_000  #: random states of the grid's box, and of each attracting piece


def arrivals(return_map: ReturnMap, composite: CompositeMap, attracting: Container[str], grid: Grid) -> float:
    """The share of these orbits whose last states visit attracting pieces."""
    numbers = [k for k, each in enumerate(composite.pieces) if each.name in attracting]
    return float(np.isin(ends(return_map, composite, box_of(grid)), numbers).any(axis=0).mean())


def finalize(system: "System", grid: Grid, spec: "Partition", refinement: "Refinement") -> PartitionResult:
    """The result of a refinement, validated at new states."""
    leaves = sorted(refinement.leaves, key=lambda leaf: leaf.role != "attracting")
    composite = refinement.composite()
    attracting = tuple(f"R{leaf.number}" for leaf in leaves if leaf.role == "attracting")
    states = random_states(box_of(grid), VALIDATION)
    exact, fitted = system.first_return(states), composite.first_return(states)
    lost = fitted.outcome == Outcome.uncovered
    names = [Outcome(value).name for value in exact.outcome[lost]]
    both = exact.valid & fitted.valid
    same = composite.piece_of(exact.image[both]) == composite.piece_of(fitted.image[both])
    arrives = [arrivals(formulas, composite, attracting, grid) for formulas in (system, composite)]
    error, points = _attracting_error(system, composite, leaves)
    return PartitionResult(
        spec=spec,
        composite=composite,
        log=tuple(row(leaf, grid) for leaf in refinement.log),
        attracting=attracting,
        unmet=tuple(f"R{leaf.number}" for leaf in leaves if not (leaf.chosen and leaf.chosen.met)),
        max_error=error,
        points=points,
        covered=float(1 - lost.mean()),
        uncovered={name: count / len(states) for name, count in Counter(names).items()},
        right_next=float(same.mean()) if both.any() else float("nan"),
        arrives=(arrives[0], arrives[1]),
        same_end=refinement.destinations.agreement(composite),
    )


def _attracting_error(system: "System", composite: CompositeMap, leaves: "list[Leaf]") -> tuple[float, int]:
    """The largest error at new random states of the attracting pieces, and the number of these states."""
    worst, points = float("nan"), 0
    for number, leaf in enumerate(leaves):
        if leaf.role == "attracting":
            low, high = leaf.cell.around.T
            states = np.random.default_rng(11 + number).uniform(low, high, (VALIDATION, len(low)))
            exact = system.first_return(states[composite.piece_of(states) == number])
            if exact.valid.any():
                error = errors(composite.first_return(exact.start).image, exact)[exact.valid]
                worst, points = float(np.fmax(worst, error.max())), points + len(error)
    return worst, points


def row(leaf: "Leaf", grid: Grid) -> LogRow:
    """A region as a row of the log."""
    box = box_of(grid)
    share = float(leaf.sample.area / np.prod(box[:, 1] - box[:, 0]))
    common = leaf.name, leaf.role, leaf.chosen.word if leaf.chosen else "", leaf.cell.text, share
    demanded = tuple(leaf.demand.errors.tolist())
    if leaf.chosen is None or leaf.chosen.map.report is None:
        return LogRow(*common, "", 0, (), (), (), 1.0, demanded, len(leaf.sample.held_out), False, leaf.became)
    chosen, report = leaf.chosen, leaf.chosen.map.report
    figures = tuple(report.r2.tolist()), tuple(report.sse.tolist()), tuple(chosen.max_error.tolist())
    terms = int(report.terms.sum())
    return LogRow(*common, chosen.order, terms, *figures, chosen.missed, demanded, chosen.states, chosen.met, leaf.became)
