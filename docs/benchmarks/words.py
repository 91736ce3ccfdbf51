"""Random first returns of systems with modes against a plain integrator: python docs/benchmarks/words.py [STARTS [SYSTEM ...]].

The integrator shares nothing with nsmaps but the formulas of the class: Runge-Kutta steps of order 4, and an event wherever a
function of the mode is negative at the end of a step, found in ever smaller parts of it. Where a word differs it is computed
again with steps of a tenth and of a hundredth, short after events. What still differs is listed: both words, clearance and
slowest event.
"""

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import sympy as sp

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from hybrid import SYSTEMS, numbers, reference, system

STEPS, LONGEST, FINER = 100, 40, (10, 100)  # a radian of the forcing, radians, finer steps for those that differ
GROWTH, FIRST = 0.2, 1e-6  # steps after an event, for those: at most a share of the time since then, and of a step at first
PARTS, ROUNDS = 16, 13  # of a step in which an event is looked for at once, and how often: to 2^-52 of it
T = sp.Symbol("t", real=True)


@dataclass(frozen=True)
class Plain:
    """The formulas of a system as functions of time and states, arrays of one column a motion."""

    system: object

    @cached_property
    def states(self):
        noise = {self.system.noise: 0} if self.system.noise else {}
        return SimpleNamespace(**noise, **{name: sp.Symbol(name, real=True) for name in self.system.states})

    @cached_property
    def symbols(self):
        return [getattr(self.states, name) for name in self.system.states]

    def function(self, expr):
        made = sp.lambdify((T, *self.symbols), expr, "numpy")

        def values(t, y):
            value = made(t, *y)
            return value if isinstance(value, np.ndarray) else np.full(t.shape, float(value))

        return values

    @cached_property
    def modes(self):
        given = self.system.modes(T, self.states)
        rows = {name: [rates[state] for state in self.system.states] for name, rates in given.items()}
        return {name: sp.lambdify((T, *self.symbols), row, "numpy") for name, row in rows.items()}

    @cached_property
    def guards(self):
        rows = []
        for name, guard in self.system.guards(T, self.states).items():
            reset = [self.function(guard.reset.get(state, y)) for state, y in zip(self.system.states, self.symbols, strict=True)]
            letter = name[0] if guard.letter is None else guard.letter
            where = [self.function(one) for one in guard.where]
            rows.append((name, guard.watched, self.function(guard.function), where, reset, guard.to, letter, guard.ends))
        return rows

    def step(self, mode, t, y, h):
        """One Runge-Kutta step of order 4."""

        def rates(t, y):
            made = np.empty_like(y)
            for k, rate in enumerate(self.modes[mode](t, *y)):
                made[k] = rate
            return made

        a = rates(t, y)
        b = rates(t + h / 2, y + h / 2 * a)
        c = rates(t + h / 2, y + h / 2 * b)
        return y + h / 6 * (a + 2 * b + 2 * c + rates(t + h, y + h * c))


def returns(plain, t, y, mode, h, longest, careful):
    """The first returns of motions just after an event of the section: words, and time and states at the section."""
    names = plain.system.section(T, plain.states)
    sections = (names.guards,) if isinstance(names.guards, str) else tuple(names.guards)
    n, word, mode = len(t), np.full(len(t), "", object), np.array(mode, object)
    t, y, done, since, whole = t.copy(), y.copy(), np.zeros(n, bool), t.copy(), h
    start, armed = t.copy(), {row[0]: np.zeros(n, bool) for row in plain.guards}
    image = np.full((len(y) + 1, n), np.nan)
    while not done.all():
        h = np.minimum(whole, np.maximum(GROWTH * (t - since), FIRST * whole)) if careful else np.full(n, whole)
        for name in plain.modes:
            own = np.flatnonzero((mode == name) & ~done)
            if not len(own):
                continue
            new = plain.step(name, t[own], y[:, own], h[own])
            first, which = np.ones(len(own)), np.full(len(own), -1)
            for k, (label, watched, function, *_) in enumerate(plain.guards):
                if name not in watched:
                    continue
                value = function(t[own] + h[own], new)
                falls = (value < 0) & armed[label][own]
                armed[label][own] |= value > 0
                if falls.any():
                    when = np.ones(len(own))
                    when[falls] = zeros(plain, name, function, t[own[falls]], y[:, own[falls]], h[own[falls]])
                    sooner = falls & (when < first)
                    first[sooner], which[sooner] = when[sooner], k
            hit = which >= 0
            if hit.any():
                new[:, hit] = plain.step(name, t[own[hit]], y[:, own[hit]], first[hit] * h[own[hit]])
            y[:, own] = new
            t[own] += first * h[own]
            for k in np.unique(which[hit]) if hit.any() else ():
                since[own[which == k]] = t[own[which == k]]
                happen(plain, k, own[which == k], (t, y, mode, word, done, image, armed), sections, names.side)
        late = (t - start > longest) & ~done
        done |= late
        word[late] = "late"
    return word, image


def zeros(plain, mode, function, t, y, h):
    """The shares of steps at whose ends a function has fallen, from where it is no longer positive."""
    low, high, parts = np.zeros(len(t)), np.ones(len(t)), np.arange(1, PARTS)[:, None] / PARTS
    for _ in range(ROUNDS):
        places = low + (high - low) * parts
        times, steps = np.tile(t, PARTS - 1), (places * h).ravel()
        there = function(times + steps, plain.step(mode, times, np.tile(y, PARTS - 1), steps)).reshape(places.shape)
        ends = np.vstack([low, places, high])
        end = np.where((there > 0).all(axis=0), PARTS, np.argmin(there > 0, axis=0) + 1)
        low, high = ends[end - 1, np.arange(len(t))], ends[end, np.arange(len(t))]
    return high


def happen(plain, k, rows, motion, sections, side):
    """The event of a function: that of the first guard with it whose conditions hold."""
    t, y, mode, word, done, image, armed = motion
    left = rows
    for name, watched, _, where, reset, to, letter, ends in plain.guards[k:]:
        if name != plain.guards[k][0] and not (where and plain.guards[k][3]):
            continue
        left = left[np.isin(mode[left].astype(str), watched)]
        holds = np.ones(len(left), bool)
        for condition in where:
            holds &= condition(t[left], y[:, left]) >= 0
        own, left = left[holds], left[~holds]
        if not len(own):
            continue
        after = np.array([f(t[own], y[:, own]) for f in reset])
        ending = name in sections
        if ending:
            image[:, own] = np.vstack([t[own], y[:, own] if side == "before" else after])
        y[:, own] = after
        word[own] = word[own] + letter
        mode[own] = to or mode[own]
        done[own] |= ending or ends
        for other, _, function, *_ in plain.guards:
            value = function(t[own], y[:, own])
            armed[other][own] = value > 1e-9 * (1 + np.abs(y[:, own]).max(axis=0))


def main(count, only):
    for name in only or SYSTEMS:
        given = reference(name)
        for key, parameters in given["parameters"].items():
            rows = np.array([numbers(row["start"]) for row in given["returns"] if row["params"] == key])
            if len(rows) > 1:
                compare(f"{name} {key}", system(name, parameters), rows, count)


def compare(title, made, rows, count):
    starts, found, words, off = judged(made, rows, count)
    differ = others(words, found.words)
    near = made.itineraries(starts[differ])
    margins = zip(differ, near.clearance, near.slowest, strict=True)
    left = [(words[k], str(found.words[k]), f"{clearance:.1e}", f"{slowest:.1e}") for k, clearance, slowest in margins]
    told = f"{len(starts)} returns, {len(differ)} words differ, images differ by {np.median(off):.1e} in the median"
    print(f"{title}: {told}", *left, flush=True)


def judged(made, rows, count):
    """Random starts over the ranges of some, their returns, the words of the integrator, and the differences of images."""
    rng = np.random.default_rng(11)
    starts = made.on_section(rng.uniform(rows.min(axis=0), rows.max(axis=0), (count, rows.shape[1])))
    found, plain = made.first_return(starts), Plain(made)
    unit = 1 / made.phase_rate() if made.phase_rate() else float(made._kernel().table.steps.min())
    known = found.valid & (found.time < LONGEST * unit)
    starts, found = starts[known], found.select(np.flatnonzero(known))
    words, images = again(plain, made, starts, unit / STEPS, 2 * LONGEST * unit)
    for finer in FINER:
        differ = others(words, found.words)
        if len(differ):
            words[differ], images[:, differ] = again(plain, made, starts[differ], unit / STEPS / finer, 2 * LONGEST * unit, True)
    place = [images[1 + made.states.index(c)] if c in made.states else images[0] * made.phase_rate() for c in made.coordinates]
    return starts, found, words, np.abs(made.coordinates.difference(np.transpose(place), found.image))


def others(words, found):
    """Where words differ; of long ones nsmaps tells the beginning."""
    pairs = zip(words, found.tolist(), strict=True)
    return np.flatnonzero([not word.startswith(told[:-3]) if told.endswith("...") else word != told for word, told in pairs])


def again(plain, made, starts, h, longest, careful=False):
    """Words and images by the plain integrator, from the states of nsmaps just after the section's event."""
    t, y, mode, letters = begun(plain, made, starts)
    words, image = returns(plain, t, y, mode, h, longest, careful)
    return letters + words, image


def begun(plain, made, starts):
    """Time, states and mode just after the event of the section, from its coordinates."""
    section = made.section(T, plain.states)
    sections = (section.guards,) if isinstance(section.guards, str) else tuple(section.guards)
    phase = [k for k, name in enumerate(made.coordinates) if name not in made.states]
    t = starts[:, phase[0]] / made.phase_rate() if phase else np.zeros(len(starts))
    chosen = {name: starts[:, k] for k, name in enumerate(made.coordinates)}
    y = np.full((len(made.states), len(starts)), np.nan)
    guards = made.guards(T, plain.states)
    symbols = dict(zip(plain.system.states, plain.symbols, strict=True))
    for k, state in enumerate(made.states):
        if state in chosen:
            y[k] = chosen[state]
        elif state in section.states:
            known = np.nan_to_num(y)
            y[k] = plain.function(section.states[state])(t, known)
    for k, state in enumerate(made.states):
        if np.isnan(y[k]).any():
            solved = sp.solve(guards[sections[0]].function, symbols[state])[0]
            y[k] = plain.function(solved)(t, np.nan_to_num(y))
    mode, letters, left = np.full(len(t), "", object), np.full(len(t), "", object), np.ones(len(t), bool)
    for name, watched, _, where, reset, to, letter, _ in plain.guards:
        if name not in sections or not left.any():
            continue
        holds = left & np.all([condition(t, y) >= 0 for condition in where] or [left], axis=0)
        if made.section(T, plain.states).side == "before":
            y[:, holds] = np.array([f(t, y) for f in reset])[:, holds]
        mode[holds], letters[holds], left = to or watched[0], letter, left & ~holds
    return t, y, mode, letters


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000, sys.argv[2:])
