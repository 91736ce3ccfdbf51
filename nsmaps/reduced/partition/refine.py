"""Steps iii to vi in turn: regions are fitted, and split where the fit is insufficient, until all meet their demand."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from nsmaps.arrays import Floats
from nsmaps.errors import FitError
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Returns
from nsmaps.exact.surfaces.surface import Grid
from nsmaps.progress import beat
from nsmaps.reduced.composite.composite import CompositeMap, Piece
from nsmaps.reduced.conditions.region import Region
from nsmaps.reduced.fit.filter import NearDiagonal
from nsmaps.reduced.partition.candidates import attracting_boxes, box_of
from nsmaps.reduced.partition.cell import HELD_OUT, Cell, Cut, Sample, Sorting, cells_of, parts_of, roots, rounded, sample
from nsmaps.reduced.partition.orders import Chosen, Demand, choose_order, commonest, errors, highest_of, orders_of
from nsmaps.reduced.partition.resets import resets
from nsmaps.reduced.partition.separators import best_separator, bound, sheets
from nsmaps.reduced.validation.destinations import Destinations, ends, random_states
from nsmaps.results import units_of

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System
    from nsmaps.reduced.partition.spec import Partition, Role

LOOSE = 0.1  #: error demanded of transient pieces, as a share of the grid's side
STRAY = 0.05  #: share of the transient states that may have larger errors
SPECK = 0.005  #: least share of the grid's box for a transient piece of its own
STRAY_EVERYWHERE = 0.01  #: the same where one tolerance holds everywhere
FRACTIONS = (0.25, 0.5, 0.75)  #: places in a cell at which it may be split
SHIFTS = (0.05, 0.15, 0.3)  #: width of a strip along a curved edge that is split off, as a share of the cell
NARROWEST = 1e-12  #: share of a coordinate, below which it is not split
FINE, STRICT = 80, 8000  #: points along a planar grid to find edges; held-out states of which none may miss the demand
TIGHTER = 2.0  #: factor by which the demand on a piece is divided, round by round
TIGHTEST = 16.0  #: factor below the tolerance to which an attracting piece is tightened at most
ROUNDS = 8  #: of tightening transient pieces that hold part of an attractor, or lead to another


@dataclass(frozen=True, slots=True, eq=False)
class Leaf:
    """A region R_{n.m} with its fit."""

    number: int
    iteration: int
    role: "Role"
    cell: Cell
    sample: Sample
    demand: Demand
    chosen: Chosen | None  #: None if nothing in it returns
    states: Floats  #: shape (M, n), states that indicate that it may attract
    became: str = ""

    @property
    def name(self) -> str:
        """Its name in the paper."""
        return f"R{self.number}.{self.iteration}"

    @property
    def missed(self) -> float:
        """The area of the states that miss the demand."""
        return self.sample.area * self.chosen.missed if self.chosen else 0.0

    @property
    def weight(self) -> float:
        """The possible gain by a split."""
        return 0.0 if self.chosen is None or self.chosen.met else self.missed

    def piece(self) -> Piece:
        """The piece of a composite map: where no exact image is negative, negative values of a polynomial lose their sign."""
        assert self.chosen is not None
        polymap = self.chosen.map
        held_out = self.sample.held_out
        signed = (held_out.image[held_out.valid] < 0).any(axis=0)
        negative = (polymap(held_out.start) < 0).any(axis=0) & ~held_out.coordinates.angles & ~signed
        own = polymap.absolute
        names = tuple(name for name, each in zip(held_out.coordinates, negative, strict=True) if each or name in own)
        return Piece(f"R{self.number}", self.cell.region, replace(polymap, absolute=names), self.chosen.word)


@dataclass(eq=False)
class Refinement:
    """The regions while they are refined."""

    system: "System"
    grid: Grid
    spec: "Partition"
    log: list[Leaf] = field(default_factory=list)
    leaves: list[Leaf] = field(default_factory=list)
    taken: tuple[Region, ...] = ()  #: the union of the attracting pieces
    resets: tuple[Piece, ...] = ()  #: the complement of the grid's box
    count: int = 0  #: number of numbered regions

    def run(self) -> "Refinement":
        """Attracting regions first, the transient remainder after them, which is tightened where attractors pass through it."""
        returns = self.system.first_return(self.grid.states())
        self.resets = tuple(resets(self.system, returns, self.grid))
        cells, states = self.attracting(returns)
        self.refine(self.divided(parts_of(cells, self.spec.regions), "attracting", states), max(1, 2 * self.spec.max_pieces // 3))
        self.taken = tuple(leaf.cell.region for leaf in self.leaves)
        remaining = roots(self.system.coordinates, box_of(self.grid))
        self.refine(self.divided(parts_of(remaining, self.spec.regions), "transient", states), self.spec.max_pieces)
        for _ in range(ROUNDS if self.taken else 0):
            loose = self.loose()
            if not loose or len(self.leaves) >= self.spec.max_pieces:
                break
            self.leaves = [leaf for leaf in self.leaves if leaf not in loose]
            self.log = [replace(leaf, became=f"tightened: {loose[leaf]}") if leaf in loose else leaf for leaf in self.log]
            self.refine([self.tightened(leaf) for leaf in loose], self.spec.max_pieces)
        return self

    @cached_property
    def destinations(self) -> Destinations:
        """Where orbits of the exact map end."""
        return Destinations.of(self.system, box_of(self.grid))

    def attracting(self, returns: Returns) -> tuple[list[Cell], Floats]:
        """Step iii: cells around possible attractors with states that indicate them, or given ones with states everywhere."""
        names = self.system.coordinates
        if not self.spec.attracting:
            criterion = NearDiagonal(delta=self.spec.delta, slope=self.spec.slope, region=None)
            boxes, states = attracting_boxes(self.system, returns, self.grid, criterion, Sorting(self.spec.families))
            return [cell for box in boxes for cell in roots(names, box)], states
        cells = [cell for each in self.spec.attracting for cell in cells_of(names, each, box_of(self.grid))]
        return cells, np.concatenate([random_states(cell.around, STRICT) for cell in cells])

    def demand(self, role: "Role") -> Demand:
        """The demand on a role: the tolerance, or a tenth of the grid's sides where the map is transient."""
        tolerance = np.full(len(self.system.coordinates), self.spec.tolerance)
        if role == "attracting":
            return Demand(tolerance, 0.0)
        if self.spec.everywhere:
            return Demand(tolerance, STRAY_EVERYWHERE)
        box = box_of(self.grid)
        return Demand(np.maximum(tolerance, LOOSE * (box[:, 1] - box[:, 0])), STRAY)

    def divided(self, cells: Sequence[Cell], role: "Role", states: Floats) -> list[Leaf]:
        """Step ii: the regions R_{n.1}, cells cut along the edges between words as long as a curve separates them."""
        found: list[Leaf] = []
        todo = list(cells)
        while todo:
            cell = todo.pop(0)
            drawn = sample(self.system, cell, self.taken, FINE, sorting=Sorting(self.spec.families))
            cut = self.separator(drawn, role)
            if cut is not None and len(self.leaves) + len(found) + len(todo) + 2 <= self.spec.max_pieces:
                todo += [cell.cut(side) for side in cut.sides()]
            elif (leaf := self.leaf(cell, role, self.demand(role), states)) is not None:
                found.append(leaf)
        return found

    def leaf(self, cell: Cell, role: "Role", demand: Demand, states: Floats, number: int = 0, iteration: int = 1) -> Leaf | None:
        """Step iv: a region with the lowest order that meets its demand; None if it is empty, or if no part of it attracts."""
        attracts = role == "attracting"
        held_out = HELD_OUT if demand.share else STRICT
        drawn = sample(self.system, cell, () if attracts else self.taken, held_out=held_out, sorting=Sorting(self.spec.families))
        if attracts:
            states = states[cell.region.contains(states)]
        if not len(drawn.held_out) or (attracts and not len(states)):
            return None
        if not number:
            self.count += 1
            number = self.count
        chosen = choose_order(drawn, demand, orders_of(self.spec, role, self.system.coordinates))
        return Leaf(number, iteration, role, cell, drawn, demand, chosen, states)

    def separator(self, drawn: Sample, role: "Role") -> Cut | None:
        """The curve that best separates the sheets of the map; the part that it separates must be worth a piece."""
        if not drawn.inside.any():
            return None
        return best_separator(drawn, sheets(self.system, drawn, self.spec.tolerance), self.least(role))

    def least(self, role: "Role") -> float:
        """The least area of a piece."""
        loose = role == "transient" and not self.spec.everywhere
        return SPECK * float(np.prod(np.ptp(box_of(self.grid), axis=1))) if loose else 0.0

    def refine(self, found: Sequence[Leaf], max_pieces: int) -> None:
        """Step v: split the region with the largest possible gain until all meet their demand together, or at max_pieces."""
        todo, done = list(found), len(self.leaves)
        allowed = sum(leaf.sample.area * leaf.demand.share for leaf in found)
        while todo:
            todo.sort(key=lambda leaf: leaf.weight)
            missed = sum(leaf.missed for leaf in (*todo, *self.leaves[done:]))
            leaf = todo.pop()
            became, parts = self.step(leaf, missed <= allowed, max_pieces - len(self.leaves) - len(todo) - 1)
            self.log.append(replace(leaf, became=became))
            if parts:
                todo += parts
            elif leaf.chosen is not None:
                self.leaves.append(self.log[-1])
            beat(len(self.leaves) / self.spec.max_pieces, f"{len(self.leaves)} pieces")

    def step(self, leaf: Leaf, enough: bool, room: int) -> tuple[str, list[Leaf]]:
        """The decision on a region, and its parts if it is split."""
        if leaf.chosen is None:
            outcomes = [Outcome(value).name for value in np.unique(leaf.sample.held_out.outcome)]
            return f"left uncovered: nothing returns ({', '.join(outcomes)})", []
        if leaf.chosen.met:
            return "accepted", []
        if enough and leaf.demand.share:
            return f"accepted: at most {100 * leaf.demand.share:g} % of the states of its role have larger errors", []
        if room < 1:
            return f"given up: max_pieces = {self.spec.max_pieces}", []
        cut = self.cut(leaf)
        if cut is None:
            return "given up: no part of it is worth a piece", []
        parts, number = [], leaf.number
        for side in cut.sides():
            part = self.leaf(leaf.cell.cut(side), leaf.role, leaf.demand, leaf.states, number, leaf.iteration + 1)
            if part is not None:
                parts.append(part)
                number = 0
        return f"split at {cut.text(self.system.coordinates).replace('<=', '=')}", parts

    def cut(self, leaf: Leaf) -> Cut | None:
        """The place to split a region: along an edge between sheets of the map if there is one, else where the fits gain most."""
        separator = self.separator(leaf.sample, leaf.role)
        if separator is not None:
            return separator
        scored = [(self.excess(leaf, cut), k, cut) for k, cut in enumerate(splits(leaf.cell)) if self.worth(leaf, cut)]
        return min(scored)[2] if scored else None

    def worth(self, leaf: Leaf, cut: Cut) -> bool:
        """True if both parts of a split are worth a piece."""
        share = cut.beyond(leaf.sample.held_out.start).mean()
        return bool(leaf.sample.area * min(share, 1 - share) >= self.least(leaf.role)) and 0 < share < 1

    def excess(self, leaf: Leaf, cut: Cut) -> float:
        """The decades by which the errors exceed the demand after a split, on average and at most."""
        total, largest, count = 0.0, 0.0, len(leaf.sample.held_out)
        for side in cut.sides():
            part = leaf.sample.restricted(side)
            data = commonest(part)
            exact = part.held_out.select(part.held_out.valid)
            if data is None or not len(exact):
                continue
            try:
                polymap = highest_of(self.spec, self.system.coordinates).fit(data[1])
            except FitError:
                continue
            ratio = (errors(polymap(exact.start), exact) / leaf.demand.errors).max(axis=1)
            decades = np.log10(np.maximum(1.0, ratio))
            total += float(decades.sum()) / count
            largest = max(largest, float(decades.max()))
        return total + (0.1 * largest if leaf.demand.share == 0 else 0.0)

    def composite(self) -> CompositeMap:
        """The pieces so far, the attracting ones first and the resets last."""
        pieces = tuple(leaf.piece() for leaf in sorted(self.leaves, key=lambda leaf: leaf.role != "attracting"))
        return CompositeMap(self.system.coordinates, self.system.letters, pieces + self.resets, units_of(self.system))

    def loose(self) -> dict[Leaf, str]:
        """The regions that must be more accurate, with the reason.

        They are transient ones in which orbits of the composite map end, and any by which they leave the basin of the attractor
        of the exact map.
        """
        composite = self.composite()
        ended = {composite.pieces[k].name for k in np.unique(ends(composite, composite, box_of(self.grid))) if k >= 0}
        misleads = dict.fromkeys(self.destinations.misleading(composite), "by it orbits leave the basin of their attractor")
        ends_there = dict.fromkeys(ended, "attractors of the composite map pass through it")
        loose = dict[Leaf, str]()
        for leaf in (leaf for leaf in self.leaves if (leaf.demand.errors > self.least_error(leaf)).any()):
            why = (ends_there if leaf.role == "transient" else {}) | misleads
            if f"R{leaf.number}" in why:
                loose[leaf] = why[f"R{leaf.number}"]
        return loose

    def least_error(self, leaf: Leaf) -> float:
        """The error to which a region is tightened at most: the tolerance, of an attracting one a share of it."""
        return self.spec.tolerance / (TIGHTEST if leaf.role == "attracting" else 1.0)

    def tightened(self, leaf: Leaf) -> Leaf:
        """The region with a demand twice as tight."""
        demand = replace(leaf.demand, errors=np.maximum(self.least_error(leaf), leaf.demand.errors / TIGHTER))
        again = self.leaf(leaf.cell, leaf.role, demand, leaf.states, leaf.number, leaf.iteration + 1)
        assert again is not None
        return again


def splits(cell: Cell) -> Iterator[Cut]:
    """The places where a cell may be split: across each coordinate, and along its own curved edges."""
    low, high = cell.around.T
    width = high - low
    for i in range(len(low)):
        if width[i] > NARROWEST * max(1.0, abs(low[i])):
            yield from (bound(i, low[i] + share * width[i], width[i]) for share in FRACTIONS)
    for cut in cell.cuts:
        for share in SHIFTS:
            reach = width[cut.dependent] * (share if cut.above else -share)
            start = rounded(cut.coefficients[0] + reach, width[cut.dependent])
            yield replace(cut, coefficients=(start, *cut.coefficients[1:]), above=False)
