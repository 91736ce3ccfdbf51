"""The abstract base of every return map: exact systems, user-defined maps, fitted maps, and iterates of these."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from nsmaps.arrays import ArrayLike, Floats, finite_rows
from nsmaps.coordinates import as_states
from nsmaps.errors import NsmapsError, StateError, check_class
from nsmaps.exact.outcome import Outcome
from nsmaps.exact.returns import Itineraries, Returns

NO_CLOSED_FORM = "is not a system with impacts, or a map by formulas"
Method = Callable[..., Returns]


class ReturnMap(ABC):
    """A map with coordinates and first returns of batches of states.

    A class outside of nsmaps inherits from `nsmaps.System`, whose fields are its parameters. Its `first_return` is called with
    finite states alone, of shape (N, n), and what it gives is checked: those that are NaN or infinite are `invalid` without it.
    """

    __slots__ = ()
    wanted: ClassVar[str] = "an object of a class that inherits from nsmaps.System, with `coordinates` and `first_return`"

    if TYPE_CHECKING:  # a field of some subclasses, a constant or a property of others

        @property
        def coordinates(self) -> Sequence[str]:
            """The n coordinates: `Coordinates`, or names of which an `Angle` lives on the circle."""

    @abstractmethod
    def first_return(self, states: ArrayLike, derivative: bool = False) -> Returns:
        """First returns of states of shape (N, n), see `Returns.of_map`; N may be 0."""

    def orbits(self, states: ArrayLike, n_returns: int, derivative: bool = False) -> Returns:
        """The first returns of each of M states: `n_returns` M rows, the first return of every state first.

        After an orbit's end its images are NaN, its words empty, and the outcome that ended it is repeated.
        """
        start = as_states(states, self.coordinates)
        parts = [*single_returns(self, start, n_returns, derivative=derivative)]
        return Returns.concatenate(parts or [self.first_return(start[:0], derivative)])

    @property
    def has_orbits(self) -> bool:
        """True if many returns are computed in one call, and not one `first_return` after another."""
        return type(self).orbits is not ReturnMap.orbits

    def extents(self, states: ArrayLike) -> Floats | None:
        """How far each coordinate moves on motions through states (N, n), shape (n,); None where that is not known."""
        return None

    def on_section(self, states: ArrayLike) -> Floats:
        """States (N, n) on the section nearest to these; the same where the coordinates are all free."""
        return as_states(states, self.coordinates)

    def obstacle(self) -> str:
        """Why it is not in closed form, the end of a sentence about its class; no text if it is."""
        return NO_CLOSED_FORM

    @property
    def is_affine(self) -> bool:
        """True if it is known to be affine in pieces, with affine borders, in coordinates without angles."""
        return False

    def inverse(self) -> "ReturnMap | None":
        """The inverse, by which images lead back to states; None where it is not known."""
        return None

    def itineraries(self, states: ArrayLike) -> Itineraries:
        """What distinguishes the smooth pieces of the map: the words, where it is not known how far states are from an edge."""
        found = self.first_return(states)
        far = np.where(found.valid, np.inf, np.nan)
        return Itineraries(found.walls, found.codes, np.zeros(len(found), np.int32), far, far, found.outcome)

    @classmethod
    def require(cls, given: object, what: str) -> Self:
        """The map or system that is given, of a kind for which `what` is there.

        Raises:
            NsmapsError: it is of another kind; says what is expected, and why.
        """
        if isinstance(given, cls):
            return given
        name = f"the class {given.__name__}" if isinstance(given, type) else f"a {type(given).__name__}"
        expected = "an object of it, with its parameters" if isinstance(given, type) and issubclass(given, cls) else cls.wanted
        raise NsmapsError(f"{what} of {name}; expected: {expected}")

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Check what a class outside of nsmaps returns."""
        super().__init_subclass__(**kwargs)
        own = vars(cls).get("first_return")
        if own is not None and is_foreign(cls):
            cls.first_return = _check_returns(own)  # type: ignore[method-assign]


def is_foreign(cls: type) -> bool:
    """True for a class outside of nsmaps."""
    package, _, _ = cls.__module__.partition(".")
    return package != "nsmaps"


class ExactMap(ReturnMap):
    """A return map whose parameters and edges are known, as of exact systems."""

    __slots__ = ()

    @property
    @abstractmethod
    def parameters(self) -> Mapping[str, float]:
        """The values of the parameters by name."""

    @abstractmethod
    def parameter_names(self) -> Sequence[str]:
        """The names of the parameters, in their order."""

    @abstractmethod
    def phase_rate(self) -> float:
        """Radians of phase per unit of time."""

    @abstractmethod
    def rests(self, states: ArrayLike) -> Floats:
        """How long a body rests before its release, in radians of phase, shape (N,); NaN of returns without rest."""

    @abstractmethod
    def sensitivity(self, states: ArrayLike, rates: Mapping[str, float]) -> Floats:
        """The derivative of first returns by the parameters, which change at these rates, shape (N, n)."""


def letters_of(return_map: ReturnMap) -> tuple[str, ...]:
    """The letters of which words of a map consist; none of a map without words."""
    return tuple(return_map.first_return(np.empty((0, len(return_map.coordinates)))).walls)


def repeat_outcomes(returns: Returns, before: Returns | None) -> Returns:
    """Returns of M states, in which the outcome of the M previous returns is repeated where these ended."""
    if before is None:
        return returns
    ended = np.isnan(returns.start[: len(before)]).any(axis=1)
    if not ended.any():
        return returns
    outcome = np.where(ended, before.outcome, returns.outcome.reshape(-1, len(before)))
    return replace(returns, outcome=outcome.ravel().astype(np.int8))


def single_returns(return_map: ReturnMap, states: Floats, n: int, **how: Any) -> Iterator[Returns]:
    """The first n returns of M states, shape (M, dim), by one call for each of the n."""
    before: Returns | None = None
    for _ in range(n):
        before = repeat_outcomes(return_map.first_return(states, **how), before)
        states = before.image
        yield before


def _check_returns(own: Method) -> Method:
    """A `first_return` that is called with finite states, and whose result is checked."""

    @wraps(own)
    def first_return(self: ReturnMap, states: ArrayLike, derivative: bool = False, **how: Any) -> Returns:
        start = as_states(states, self.coordinates)
        finite = finite_rows(start)
        how |= {"derivative": True} if derivative else {}
        found = own(self, start if finite.all() else start[finite], **how)
        check_class(found, Returns, f"`first_return` of a {type(self).__name__} gives what `Returns.of_map` makes")
        shape = int(finite.sum()), len(self.coordinates)
        if found.image.shape != shape:
            raise StateError(f"`first_return` of a {type(self).__name__} gives images {found.image.shape}; expected: {shape}")
        found = _without_overflow(found)
        return found if finite.all() else _among(found, start, finite)

    return first_return


def _without_overflow(found: Returns) -> Returns:
    """Returns, of which those whose image is not finite have escaped."""
    lost = ~finite_rows(found.image)
    if lost.any():
        lost &= found.outcome == Outcome.returned
    if not lost.any():
        return found
    image, outcome = np.where(lost[:, None], np.nan, found.image), np.where(lost, Outcome.escaped, found.outcome)
    return replace(found, image=image, outcome=outcome.astype(np.int8))


def _among(found: Returns, start: Floats, finite: np.ndarray) -> Returns:
    """Returns of the finite ones among states; the others have no image."""
    blank = dict.fromkeys(("image", "time", "derivative"), np.nan)
    blank |= {"turns": 0, "codes": 0, "outcome": Outcome.invalid, "number": 1}
    rows: dict[str, Any] = {"start": start}
    for name, value in blank.items():
        known = getattr(found, name)
        if known is not None:
            rows[name] = np.full((len(start), *known.shape[1:]), value, known.dtype)
            rows[name][finite] = known
    return replace(found, **rows, margin=None)
