"""The formulas of observables in symbols: what they may contain, those that a system has by name, and how text is read."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, singledispatch
from typing import Any
from unicodedata import normalize

import numpy as np
import sympy as sp

from nsmaps.arrays import Bools, Floats
from nsmaps.coordinates import Coordinates, is_angle
from nsmaps.errors import NsmapsError, near_match
from nsmaps.exact.flows.formulas import PHI
from nsmaps.exact.flows.laws import rows_address, rows_source
from nsmaps.exact.flows.tables import formulas_of
from nsmaps.exact.observables.analysis import JUMPS, SMOOTH, powers, smoothness
from nsmaps.exact.observables.spec import Observable, ObservableLike, observable_of, with_distinct_names
from nsmaps.exact.observables.sums import Quantities
from nsmaps.exact.systems.hybrid import HybridSystem
from nsmaps.exact.systems.parameters import System
from nsmaps.exact.systems.system import ImpactSystem
from nsmaps.files.expressions import CAPITAL, FUNCTIONS, Reader, as_name

AFTER = "_after"  #: behind the name of a state, just after an event
FURTHER = "asinh", "acosh", "atanh", "erf"
READ: dict[str, Callable[..., float]] = {**FUNCTIONS, **{name: getattr(math, name) for name in FURTHER}}
WRITTEN = {name: getattr(sp, name.title() if name in CAPITAL else name) for name in (*FUNCTIONS, *FURTHER)}
WRITTEN |= {"pi": sp.pi, "e": sp.E}
NUMBERS = {"Integer": sp.Integer, "Float": sp.Float, "Rational": sp.Rational, "Symbol": sp.Symbol, "Function": sp.Function}
COUNTED = Observable(name="impacts", formula="1", of="impacts")
OF_IMPACTS = (
    COUNTED,
    Observable(name="speed", formula="v", of="impacts", per="1"),
    Observable(name="loss", formula=f"(v**2 - v{AFTER}**2)/2", of="impacts"),
    Observable(name="momentum", formula=f"v + v{AFTER}", of="impacts"),
    Observable(name="displacement", formula="abs(place)", of="flights", largest=True),
)  #: of every impact system; energies a unit of mass


@dataclass(frozen=True, eq=False)
class Vocabulary:
    """What formulas of one class of systems may contain."""

    inputs: Mapping[str, tuple[str, ...]]  #: of impacts and flights, or of returns, in the order in which compiled code has them
    parameters: tuple[sp.Symbol, ...]
    parameter_names: tuple[str, ...]
    phase_rate: sp.Expr  #: radians of phase a unit of time, zero without forcing
    places: Mapping[str, tuple[str, ...]]  #: by row of a table: letters of impacts, of walls or modes of flights, of pieces
    counts: tuple[bool, ...]  #: which rows of the first kind count unless letters are given

    def names(self, of: str) -> dict[str, sp.Expr]:
        """The symbols of formulas by name; a state goes before a parameter of the same name."""
        known = dict(zip(self.parameter_names, self.parameters, strict=True))
        waves = {} if self.phase_rate == 0 else {"phi": PHI, "t": PHI / self.phase_rate}
        return {**known, **waves, **dict(zip(self.inputs[of], self.variables(of), strict=True))}

    def variables(self, of: str) -> tuple[sp.Symbol, ...]:
        """The symbols of the inputs."""
        return tuple(sp.Symbol(f"_y_{name}", real=True) for name in self.inputs[of])

    def read(self, text: str, of: str) -> sp.Expr:
        """A formula in symbols. Raises ConditionError for a text that is not one, with the column."""
        return _read(self, text, of)

    def text(self, formula: sp.Expr, of: str) -> str:
        """A formula as text, with the names of the user."""
        shown = {symbol: sp.Symbol(name) for name, symbol in self.names(of).items() if symbol.is_Symbol}
        return str(sp.sstr(formula.xreplace(shown)))

    def whole(self, one: Observable) -> Observable:
        """An observable that says what it is of: by default of impacts, or of the returns of a map."""
        return one if one.of is not None else one.model_copy(update={"of": next(iter(self.inputs))})

    def rows(self, one: Observable) -> list[bool]:
        """The rows of a table that count for an observable. NsmapsError for a letter, or a kind, that there is not."""
        of = self.whole(one).of or ""
        if of not in self.places:
            raise NsmapsError(f"the observable {one.name!r} is of {of}; expected: of {' or '.join(self.places)}")
        places = self.places[of]
        known = tuple(dict.fromkeys(filter(None, places)))
        what = {"impacts": "an impact", "flights": "a flight", "returns": "a return"}[of]
        for letter in set(one.at) - set(known):
            raise NsmapsError(
                f"the observable {one.name!r} is of {what} at {letter!r}{near_match(letter, known)}; expected: {', '.join(known)}"
            )
        if one.at:
            return [place in one.at for place in places]
        found = [True] * len(places) if of == "flights" else list(self.counts)
        if not any(found):
            raise NsmapsError(
                f"the observable {one.name!r} is of impacts, and no event changes the states; expected: `at` with letters of "
                f"events: {', '.join(known)}"
            )
        return found


@lru_cache(maxsize=256)
def _read(vocabulary: Vocabulary, text: str, of: str) -> sp.Expr:
    names = {normalize("NFKC", name): symbol for name, symbol in vocabulary.names(of).items()}
    reader = Reader("formula", text, tuple(names), READ)
    reader.check_value(reader.tree())
    known = {**WRITTEN, **names, **{as_name(name): symbol for name, symbol in names.items()}}
    return sp.parse_expr(reader.plain.strip(), local_dict=known, global_dict=dict(NUMBERS))


@singledispatch
def vocabulary_of(system: System) -> Vocabulary:
    """What formulas of observables of a system may contain."""
    known = System.require(system, "observables")
    return _of_returns(Coordinates(known.coordinates), known.letters, known.parameter_names())


@vocabulary_of.register
def _(system: HybridSystem) -> Vocabulary:
    return of_modes(system._definition(), system.parameter_names())


@vocabulary_of.register
def _(system: ImpactSystem) -> Vocabulary:
    return _of_walls(formulas_of(system), system.parameter_names(), system.letters)


@lru_cache(maxsize=64)
def of_modes(d: Any, names: tuple[str, ...]) -> Vocabulary:
    """The vocabulary of a system with modes, by its definition."""
    inputs = {"impacts": (*d.states, *(f"{name}{AFTER}" for name in d.states)), "flights": d.states}
    places = {"impacts": tuple(one.letter for one in d.transitions), "flights": d.modes}
    changes = tuple(_changes(one, d) for one in d.transitions)
    return Vocabulary(inputs, d.symbols, names, d.phase_rate, places, changes)


@lru_cache(maxsize=64)
def _of_walls(formulas: Any, names: tuple[str, ...], letters: tuple[str, ...]) -> Vocabulary:
    """The vocabulary of an impact system, by its formulas."""
    inputs = {"impacts": ("v", f"v{AFTER}", "place"), "flights": ("place", "velocity")}
    places = dict.fromkeys(("impacts", "flights"), (*letters, "")[:2])
    return Vocabulary(inputs, formulas.symbols, names, formulas.numbers.phase_rate, places, (True, True))


@lru_cache(maxsize=64)
def _of_returns(coordinates: Coordinates, letters: tuple[str, ...], names: tuple[str, ...]) -> Vocabulary:
    """The vocabulary of a map without motions between its returns; words that are not one letter have the last place."""
    inputs = {"returns": (*coordinates.names, *(f"{name}{AFTER}" for name in coordinates))}
    symbols = tuple(sp.Symbol(f"_p_{name}", real=True) for name in names)
    return Vocabulary(inputs, symbols, names, sp.S.Zero, {"returns": (*letters, "")}, (True,) * (len(letters) + 1))


def _changes(one: Any, d: Any) -> bool:
    """Whether a transition is an impact: an event that changes a state."""
    kept = all(row.of(d.columns) == y for row, y in zip(one.reset, d.variables, strict=False))  # not those of derived states
    return bool(one.name) and (bool(one.curved) or not kept)


@dataclass(frozen=True, eq=False)
class Plan:
    """The formulas of some observables of a class of systems, those of impacts first, or those of returns."""

    vocabulary: Vocabulary
    observables: tuple[Observable, ...]
    columns: tuple[tuple[int, int], ...]  #: of each formula the observable, and 0, or 1 where it divides
    formulas: dict[str, tuple[sp.Expr, ...]]  #: of impacts and of flights, or of returns
    rows: dict[str, Bools]  #: which rows count, shape (R, K) of impacts or returns and (M, F) of flights
    largest: Bools  #: shape (K + F,)
    scales: Floats  #: shape (K + F,)
    steps: Bools  #: shape (K + F,), of which no derivatives are known: largest values and sums of what jumps along flights
    departed: bool = False  #: whether flights with modes count by the letter of the event at which they begin
    rough: bool = False  #: whether a sum over flights has a formula that one rule for each panel may not cover

    def address(self, of: str, slopes: bool) -> int:
        """The address of the compiled formulas, and their derivatives by inputs, phase and parameters; 0 without formulas."""
        return _address(self, of, slopes) if self.formulas[of] else 0

    def width(self, slopes: bool) -> int:
        """Places of a formula in a table: its value, or also its derivatives by the inputs, phase and parameters."""
        return 2 + max(map(len, self.vocabulary.inputs.values())) + len(self.vocabulary.parameters) if slopes else 1

    def memory(self, values: Sequence[float], panel: float, slopes: bool = False) -> Quantities:
        """Memory for the totals of one thread."""
        k, f = (self.rows[of].shape[1] for of in ("impacts", "flights"))
        return Quantities(
            impact=self.address("impacts", slopes),
            flight=self.address("flights", slopes),
            parameters=np.array([*values, 0.0]),
            at=self.rows["impacts"],
            over=self.rows["flights"],
            departed=self.departed,
            largest=self.largest,
            panel=panel,
            rough=self.rough,
            y=np.zeros(max(map(len, self.vocabulary.inputs.values()))),
            out=np.zeros((max(k, f), self.width(slopes))),
            total=np.zeros(k + f),
            peak=np.zeros(f),
            when=np.zeros(f),
            gap=np.zeros(f),
            size=np.zeros(f),
        )


@lru_cache(maxsize=256)
def _address(plan: Plan, of: str, slopes: bool) -> int:
    formulas, inputs, parameters = plan.formulas[of], plan.vocabulary.variables(of), plan.vocabulary.parameters
    by = (*inputs, PHI, *parameters) if slopes else ()
    entries = [entry for formula in formulas for entry in (formula, *(sp.diff(formula, x) for x in by))]
    places = [k * plan.width(slopes) + j for k in range(len(formulas)) for j in range(1 + len(by))]
    return rows_address(rows_source(entries, places, inputs, parameters))


def plan_of(system: System, observables: tuple[Observable, ...]) -> Plan:
    """The formulas of observables, read and in order; those of a class and its choices are remembered."""
    return plan_in(vocabulary_of(system), observables)


@lru_cache(maxsize=64)
def plan_in(vocabulary: Vocabulary, observables: tuple[Observable, ...]) -> Plan:
    """As `plan_of`, by a vocabulary."""
    columns, formulas, rows = [], {}, {}
    for of in vocabulary.inputs:
        own = [(k, part) for k, one in enumerate(observables) if one.of == of for part in range(len(one.formulas))]
        columns += own
        formulas[of] = tuple(vocabulary.read(observables[k].formulas[part], of) for k, part in own)
        counts = [vocabulary.rows(observables[k]) for k, _ in own]
        rows[of] = np.array(counts, bool).reshape(len(own), len(vocabulary.places[of])).T.copy()
    largest = np.array([observables[k].largest for k, _ in columns], bool)
    scales = np.array([1.0 if part else observables[k].scale for k, part in columns])
    kinds = [smoothness(one, vocabulary.variables(of)) if of == "flights" else SMOOTH for of in formulas for one in formulas[of]]
    steps, rough = largest | (np.array(kinds) == JUMPS), (np.array(kinds) != SMOOTH)[~largest].any()
    return Plan(vocabulary, observables, tuple(columns), formulas, rows, largest, scales, steps, rough=bool(rough))


def known_observables(system: System) -> dict[str, Observable]:
    """The observables that a system has by name: those of its class, and of an impact system those of its equation of motion.

    Of a map these are its coordinates and the whole turns a return of those that are angles, such as `phi_turns`.
    """
    known = System.require(system, "observables").observables
    own = {name: observable_of({"name": name, **keys}) for name, keys in known.items()}
    return {**{one.name: one for one in _common_observables(system)}, **own}


@singledispatch
def _common_observables(system: System) -> tuple[Observable, ...]:
    """The observables that all systems of a kind have: of a map its coordinates and the turns of angles."""
    names = {f"{x}_turns" if is_angle(x) else x: f"({x}{AFTER} - {x})/(2*pi)" if is_angle(x) else x for x in system.coordinates}
    return tuple(Observable(name=name, formula=text, of="returns") for name, text in names.items())


@_common_observables.register
def _(system: HybridSystem) -> tuple[Observable, ...]:
    return (COUNTED,)


@_common_observables.register
def _(system: ImpactSystem) -> tuple[Observable, ...]:
    vocabulary, of_motion = vocabulary_of(system), zip(("work", "damping"), powers(formulas_of(system)), strict=True)
    texts = [(name, vocabulary.text(power, "flights")) for name, power in of_motion]
    return *OF_IMPACTS, *(Observable(name=name, formula=text, of="flights") for name, text in texts)


def resolve_observables(system: System, observables: Sequence[ObservableLike]) -> tuple[Observable, ...]:
    """Observables of a system, given by name, by their keys, or as they are.

    Raises:
        NsmapsError: there is none, the system has none of a name, two have the same name, or a letter is unknown.
        ConditionError: a formula that cannot be read, or that has a name which the system does not have; with its column.
    """
    given = (observables,) if isinstance(observables, (str, Observable, Mapping)) else tuple(observables)
    known = known_observables(system) if any(isinstance(one, str) for one in given) else {}
    vocabulary = vocabulary_of(system)
    found = with_distinct_names(vocabulary.whole(_one(system, one, known)) for one in given)
    for one in found:
        vocabulary.rows(one)
        for formula in one.formulas:
            vocabulary.read(formula, str(one.of))
    return found


def _one(system: Any, one: ObservableLike, known: Mapping[str, Observable]) -> Observable:
    if isinstance(one, Observable):
        return one
    if not isinstance(one, str):
        return observable_of(one)
    if one not in known:
        raise NsmapsError(
            f"{one!r} is not an observable of {type(system).__name__}{near_match(one, known)}; "
            f"expected: {', '.join(known)}, or a `name` with a `formula`"
        )
    return known[one]
