"""Fits to the beginnings of records, which are extended to the whole: of many guesses those that fit worse are left out in turn.

A motion that fits the beginning predicts the next impacts well enough that these are paired rightly, also where motions are
sensitive to their starts. Half of the guesses remain after each extension (successive halving: K. Jamieson and A. Talwalkar,
Proc. AISTATS 2016, p. 240).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from nsmaps.arrays import Floats, Ints
from nsmaps.estimation.shooting.event_map import EventModel
from nsmaps.estimation.shooting.fitting import COARSE, Fit, fitted
from nsmaps.estimation.shooting.guesses import GROWTH, REFINED, STAGES, Library, beginning, first_count, first_starts, variants_of
from nsmaps.estimation.shooting.problem import Problem, Shooting, enough_events, most_events

KEPT = 3  #: guesses that remain at least
SAME = 1e-3  #: of the scale of unknowns: guesses that differ by less are the same
ROUNDS = 2  #: of pairing and least squares at each extension
GOOD = 4.0  #: mean squared residual below which other guesses of a start are not tried


@dataclass(frozen=True)
class Guess:
    """Unknowns, of which those of the beginnings are fitted, and the number of the start of the search."""

    x: Floats
    number: int
    cost: float


def part_of(problem: Problem, counts: Sequence[int]) -> tuple[Problem, Ints]:
    """The problem of the beginnings of records, of so many instants, and the places of its unknowns among all."""
    shooting, places = problem.shooting, [np.arange(problem.free)]
    records = [beginning(record, count) for record, count in zip(shooting.records, counts, strict=True)]
    for number, record in enumerate(records):
        own = np.arange(shooting.begins[number], shooting.begins[number + 1])
        phase = own[len(own) - int(shooting.offsets_free[number]) :]
        places += [own[: (len(record.segments) - 1) * shooting.width], phase]
    index = np.concatenate(places)
    low, high = problem.limits
    part = Shooting(shooting.model, records, shooting.units)
    return replace(problem, shooting=part, limits=(low[index], high[index]), scale=problem.scale[index]), index


def grow(problem: Problem, guess: Guess, counts: Sequence[int]) -> Guess | None:
    """A guess fitted to the beginnings of records, of so many instants; None where there is no motion."""
    part, index = part_of(problem, counts)
    x = guess.x.copy()
    own = x[index]
    if not _filled(part.shooting, own):
        return None
    found = fitted(part, own, ROUNDS, COARSE)
    if found is None:
        return None
    x[index] = found.x
    return Guess(x, guess.number, found.cost)


def _filled(shooting: Shooting, x: Floats) -> bool:
    """Put the starts of segments that are NaN where the motion of the segment before is, in place; False where it ends before."""
    model = shooting.model
    event_map, places = model.at(x[: len(model.free)]), [model.definition.states.index(name) for name in model.names]
    section = [model.letters.index(letter) for letter in model.section]
    for number, record in enumerate(shooting.records):
        starts, offsets = shooting.starts(x, number)
        for k in np.flatnonzero(np.isnan(starts[:, -1])):
            at, end = starts[k - 1 : k], record.segments[k : k + 1]
            _, times = enough_events(event_map, at, offsets[:1], end, most_events(record))
            events = event_map.events(at, offsets[:1], times.shape[1], False)
            distance = np.where(np.isin(events.letter[0, 1:], section), np.abs(events.time[0, 1:] - end), np.inf)
            j = 1 + int(np.argmin(np.nan_to_num(distance, nan=np.inf)))
            starts[k] = np.append(events.states[0, j, places], events.time[0, j])
            if not np.isfinite(starts[k]).all():
                return False
    return True


def first_guesses(problem: Problem, values: Floats, library: Library, random: np.random.Generator, number: int) -> list[Guess]:
    """Guesses at values of the parameters, whose starts are fitted to the beginning of each record by itself.

    Of several records the best starts, and one of the others in turn.
    """
    shooting, free, ranked = problem.shooting, problem.free, []
    model = EventModel(shooting.model.at(values).system, ())
    for k, record in enumerate(shooting.records):
        found = list[Guess]()
        for early in variants_of(shooting.model, [record]):
            for start, phase, cost in first_starts(model, record, library, random, early):
                x = np.full(shooting.size, np.nan)
                x[:free] = values
                x[shooting.begins[k] : shooting.begins[k] + shooting.width] = start
                x[shooting.begins[k + 1] - 1 :][: int(shooting.offsets_free[k])] = phase
                found.append(Guess(x, number, cost))
        if not found:
            return []
        ranked.append(sorted(found, key=lambda one: one.cost)[:REFINED])
    choices = [tuple(0 for _ in ranked)]
    choices += [tuple(j * (k == i) for i in range(len(ranked))) for k, each in enumerate(ranked) for j in range(1, len(each))]
    return [_joined(shooting, ranked, choice) for choice in choices]


def _joined(shooting: Shooting, ranked: Sequence[Sequence[Guess]], choice: Sequence[int]) -> Guess:
    """The guess of all records, of each one of its own."""
    chosen = [each[j] for each, j in zip(ranked, choice, strict=True)]
    x = chosen[0].x.copy()
    for k, one in enumerate(chosen):
        own = slice(shooting.begins[k], shooting.begins[k + 1])
        x[own] = one.x[own]
    return Guess(x, chosen[0].number, sum(one.cost for one in chosen))


def grown(
    problem: Problem, guesses: Sequence[Guess], counts: Sequence[int], limit: float = np.inf
) -> tuple[list[Guess], list[Guess]]:
    """The best guesses after all extensions, and those that were not tried, as a better one of their start is good.

    With a limit all are tried, and left out where the beginning alone costs more.
    """
    whole, waiting = [len(record.times) + len(record.sample_times) for record in problem.shooting.records], list[Guess]()
    left, last = sorted(guesses, key=lambda one: one.cost), False
    while left and not last:
        longer, good = list[Guess](), set[int]()
        last = all(count >= all_ for count, all_ in zip(counts, whole, strict=True))
        for guess in left:
            if guess.number in good:
                waiting.append(guess)
                continue
            one = grow(problem, guess, counts)
            if one is not None and one.cost < limit and not any(_same(problem, one, other) for other in longer):
                longer.append(one)
                enough = limit == np.inf and one.cost < GOOD * sum(map(min, counts, whole))
                good |= {one.number} if enough else set()
        left = sorted(longer, key=lambda one: one.cost)[: max(KEPT, len(left) // 2)]
        counts = [int(np.ceil(GROWTH * count)) for count in counts]
    return left, waiting


def is_good(found: Fit) -> bool:
    """Whether a fit may be that of the motion, so that guesses that were not tried may be left."""
    return found.cost < GOOD * len(found.residuals)


def _same(problem: Problem, one: Guess, other: Guess) -> bool:
    """Whether two guesses are at one minimum."""
    known = np.isfinite(one.x)
    return bool((np.abs(one.x - other.x)[known] <= SAME * problem.scale[known]).all())


def first_counts(shooting: Shooting) -> list[int]:
    """The numbers of instants of the first beginnings, those to which starts were fitted."""
    return [int(first_count(shooting.model, record) * GROWTH ** (STAGES - 1)) for record in shooting.records]
