"""Polynomials as printed: plain monomials with decimal coefficients, which may be polynomials of a parameter."""

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag

from nsmaps.coordinates import Coordinates
from nsmaps.errors import FitError, check_known, near_match
from nsmaps.reduced.conditions.condition import Number
from nsmaps.reduced.conditions.region import Box
from nsmaps.reduced.fit.polymap import PolyMap

if TYPE_CHECKING:
    from nsmaps.exact.systems.parameters import System

HIGHEST = 40  #: power of a coordinate, as of fits
FACTOR = re.compile(r"\s*([^\W\d]\w*)\s*(?:\*\*\s*(\d{1,2})\s*)?")


def _kind(value: object) -> str:
    return "[powers]" if isinstance(value, list | tuple) else "[decimal]"


def _monomial(text: str) -> str:
    _powers(text)
    return text


Monomial = Annotated[str, AfterValidator(_monomial)]  #: as `phi**2*v`, or `1`
Coefficient = Annotated[
    Annotated[float, Tag("[decimal]")] | Annotated[tuple[float, ...], Field(max_length=100), Tag("[powers]")],
    Discriminator(_kind),
]  #: a number, or a polynomial of the parameter, its coefficients from power 0 on


class TabulatedMap(BaseModel):
    """A map of printed coefficients, converted exactly to one that is evaluated without cancellation.

    Decimals are read as the rational numbers that they print, and so is the parameter's value: they are collapsed and
    transformed to Chebyshev products of `over` in rational arithmetic, each rounded once.

    >>> line = TabulatedMap(parameter="d", images={"v": {"1": (1, -2), "v": 3}}, over={"v": (0, 1)})
    >>> line.at(("v",), 0.35)([[0.5]])
    array([[1.8]])
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    images: dict[str, dict[Monomial, Coefficient]] = Field(
        description="{output: {monomial: coefficient}}, as `phi**2*v`; a list is a polynomial in the parameter, constant first"
    )
    over: dict[str, tuple[Number, Number]] = Field(description="where the map is meant")
    parameter: str | None = Field(None, description="the system's parameter in which the coefficients are polynomials")
    absolute: tuple[str, ...] = Field((), description="take the absolute value of these images")

    def at(self, coordinates: Sequence[str], value: float | None = None) -> PolyMap:
        """The map at one value of its parameter. FitError for names that are not coordinates or an output that is missing."""
        names = Coordinates(coordinates)
        for name in (*self.images, *self.absolute):
            if name not in names:
                raise FitError(f"the image of {name!r}{near_match(name, names)}; expected: {', '.join(names)}")
        if missing := [name for name in names if name not in self.images]:
            raise FitError(f"the image of {missing[0]!r} is missing; expected: those of all of {', '.join(names)}")
        point = None if value is None else _decimal(value)
        monomials = {name: self._collapsed(self.images[name], names, point) for name in names}
        return PolyMap.of_monomials(names, monomials, Box(coordinates=names, bounds=self.over).array, self.absolute)

    def of(self, system: "System") -> PolyMap:
        """The map at a system's own value of its parameter. FitError if the system has no such parameter."""
        if self.parameter is None:
            return self.at(system.coordinates)
        if self.parameter not in system.parameters:
            known = ", ".join(system.parameters)
            raise FitError(f"parameter: no parameter {self.parameter!r} of the system; expected: {known}")
        return self.at(system.coordinates, system.parameters[self.parameter])

    def _collapsed(
        self, terms: Mapping[str, Coefficient], names: Sequence[str], value: Fraction | None
    ) -> dict[tuple[int, ...], Fraction]:
        """The coefficients at a value of the parameter, by their exponents."""
        found: dict[tuple[int, ...], Fraction] = {}
        for text, coefficient in terms.items():
            powers = _powers(text)
            for name in powers:
                check_known(f"the monomial {text!r}: no coordinate", name, names, FitError)
            key = tuple(powers.get(str(name), 0) for name in names)
            if key in found:
                raise FitError(f"the monomial {text!r} is given twice; expected: one coefficient of each")
            found[key] = _at(coefficient, value)
        return found


def _at(coefficient: Coefficient, value: Fraction | None) -> Fraction:
    if isinstance(coefficient, float):
        return _decimal(coefficient)
    if value is None:
        raise FitError("a coefficient is a polynomial of a parameter that has no value; expected: 'parameter' with its name")
    return sum((_decimal(c) * value**power for power, c in enumerate(coefficient)), Fraction(0))


def _decimal(value: float) -> Fraction:
    """The decimal number as which a float was written, exactly."""
    return Fraction(repr(value))


def _powers(text: str) -> dict[str, int]:
    """The powers of a monomial in text, by name: none for "1", and {"phi": 2, "v": 1} for "phi**2*v"."""
    found: dict[str, int] = {}
    for factor in [] if text.strip() == "1" else re.split(r"(?<!\*)\*(?!\*)", text):
        match = FACTOR.fullmatch(factor)
        if not match or match[1] in found:
            raise FitError(f"the monomial {text!r} cannot be read; expected: '1', 'v', 'phi**2*v' and the like, each name once")
        if int(match[2] or 1) > HIGHEST:
            raise FitError(f"the monomial {text!r} has the power {match[2]}; expected: at most {HIGHEST}")
        found[match[1]] = int(match[2] or 1)
    return found
