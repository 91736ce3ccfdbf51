"""A map given by formulas as a certificate states it."""

from typing import Any

import sympy as sp

from nsmaps.errors import ConditionError, ProofError
from nsmaps.exact.piecewise.formulas import Choices, formulas_of
from nsmaps.exact.systems.piecewise import PiecewiseMap
from nsmaps.reduced.conditions.text import text_of

RADIUS = 2.0**-50  #: of a parameter relative to it: it holds the decimal, the double and a double computed in a few steps


def stated_map(return_map: PiecewiseMap) -> dict[str, Any]:
    """The formulas of a map, and its parameters, each a decimal and a radius; whole numbers are exact.

    Raises:
        ProofError: a formula has a function that the verification does not know.
    """
    formulas, names = formulas_of(Choices.of(return_map)), [str(name) for name in return_map.coordinates]
    parameters = {f"{name}_" if name in names else name: value for name, value in return_map.parameters.items()}
    symbols = dict(zip(formulas.symbols, (sp.Symbol(name, real=True) for name in parameters), strict=True))
    symbols |= dict(zip(formulas.variables, (sp.Symbol(name, real=True) for name in names), strict=True))
    known = [*names, *parameters]
    try:
        pieces = [
            {
                "letter": letter,
                "condition": text_of(condition.subs(symbols), known),
                "image": {name: text_of(image.subs(symbols), known) for name, image in zip(names, images, strict=True)},
            }
            for letter, condition, images in zip(formulas.letters, formulas.conditions, formulas.images, strict=True)
        ]
    except ConditionError as error:
        raise ProofError(f"no proofs are made of {type(return_map).__name__}: {error}") from error
    numbers = {
        name: [repr(value), "0" if float(value).is_integer() else repr(abs(value) * RADIUS)] for name, value in parameters.items()
    }
    return {"coordinates": names, "angles": return_map.coordinates.angles.tolist(), "parameters": numbers, "pieces": pieces}
