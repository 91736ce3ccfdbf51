"""The errors nsmaps raises: a call that is wrong is an error, a point that fails is data (`Outcome`).

Every message states the quantity, its value, the reason, and what is expected.
"""

from collections.abc import Iterable


class NsmapsError(ValueError):
    """Base of every error of nsmaps; also a ValueError, so that validators and callers may treat it as one."""


class StudyError(NsmapsError):
    """A study file that cannot be run: states file, line, column, what is expected and a near match."""


class UnknownSystemError(NsmapsError):
    """No system, region, fit or family has this name: lists those that are installed."""


class SystemDefinitionError(NsmapsError):
    """A class that cannot be used: a system whose formulas give no return map, a region, fit or family that lacks a method."""


class ParameterError(NsmapsError):
    """A parameter that a system does not have, or a value that it does not accept: states which, and what is expected."""


class StateError(NsmapsError):
    """States of the wrong shape or kind were passed to a map."""


class MissingMethodError(NsmapsError, AttributeError):
    """A method of impact systems, of a system with modes: states what has its numbers."""


class ConditionError(NsmapsError):
    """A condition or number in a study's text that cannot be read safely."""

    column: int | None = None  #: where in the text, from zero; None where the fault is of no one place


class FitError(NsmapsError):
    """Data that cannot bear the polynomial asked for."""


class DataError(NsmapsError):
    """Measured data that cannot be used: states which record, what is wrong with it, and what to do."""


class ProofError(NsmapsError):
    """A bound that was asked for cannot be derived."""


class CheckError(NsmapsError):
    """A class that is not what it should be, by `nsmaps.testing`: says what is wrong, the values, and what is expected."""


def check_class(value: object, classes: type | tuple[type, ...], reason: str) -> None:
    """Raise NsmapsError unless a value is of one of some classes; the reason says why another one does not serve."""
    if not isinstance(value, classes):
        names = " or ".join(each.__name__ for each in (classes if isinstance(classes, tuple) else (classes,)))
        raise NsmapsError(f"a {type(value).__name__}: {reason}; expected: {names}")


def check_choice(name: str, value: object, choices: Iterable[object]) -> None:
    """Raise NsmapsError unless the value of an argument is one of its choices."""
    listed = [repr(each) for each in choices]
    if repr(value) not in listed:
        raise NsmapsError(f"{name} is {value!r}; expected: {', '.join(listed[:-1])} or {listed[-1]}")


def check_known(what: str, name: object, known: Iterable[str], kind: type[NsmapsError] = NsmapsError) -> None:
    """Raise an error unless a name is one of those known, such as: no coordinate 'Phi', did you mean 'phi'?; expected: v, phi."""
    listed = [str(each) for each in known]
    if name not in listed:
        raise kind(f"{what} {name!r}{near_match(str(name), listed)}; expected: {', '.join(listed) or 'none'}")


def near_match(word: str, known: Iterable[str]) -> str:
    """`, did you mean 'x'?` for the closest of the known words, whatever their case, or nothing.

    >>> near_match("vi_piar", ["vi_pair", "bouncing_ball"])
    ", did you mean 'vi_pair'?"
    """
    from difflib import get_close_matches

    folded = {name.casefold(): name for name in known}
    close = get_close_matches(word.casefold(), folded, n=1, cutoff=0.6)
    return f", did you mean {folded[close[0]]!r}?" if close else ""
