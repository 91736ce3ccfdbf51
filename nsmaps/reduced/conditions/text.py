"""Formulas and conditions of sympy as text, in the grammar of conditions: the inverse of reading them in symbols."""

from collections.abc import Iterator, Sequence
from typing import Any

import sympy as sp
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanAtom, BooleanFunction

from nsmaps.errors import ConditionError
from nsmaps.exact.flows.laws import REMAINDERS, SLOPES, replace_functions
from nsmaps.files.expressions import CAPITAL, FUNCTIONS

WIDE = 32  #: terms of a sum or factors of a product without parentheses, which nest no deeper than a text may
NAMES = {getattr(sp, name.title() if name in CAPITAL else name): name for name in FUNCTIONS if name != "sqrt"}


def text_of(expression: Any, names: Sequence[str]) -> str:
    """A formula or a condition in real symbols of named coordinates as text, which `fold_term` and `fold` read back.

    Floats have all their digits. Steps and remainders are written with floor and sign, derivatives of steps as zero.

    Raises:
        ConditionError: it has a function that the grammar lacks, a symbol that is not a coordinate, or no real value.

    >>> x = sp.Symbol("x", real=True)
    >>> text_of(sp.sqrt(x / 3) - 0.1 * sp.Max(x, 1), ("x",)), text_of((x > 0) & ~sp.Eq(x, 1), ("x",))
    ('sqrt(3)*sqrt(x)/3 - 0.1*max(1, x)', '(x != 1) and (x > 0)')
    """
    return _Writer(frozenset(map(str, names))).written(replace_functions(sp.sympify(expression), {**REMAINDERS, **SLOPES}))


class _Writer:
    """Sympy's expressions as text, over some names."""

    def __init__(self, names: frozenset[str]) -> None:
        self.names = names

    def written(self, each: Any) -> str:
        """A formula or a condition as text, without parentheses about it."""
        if isinstance(each, Relational):
            return f"{self.written(each.lhs)} {each.rel_op} {self.written(each.rhs)}"
        if isinstance(each, BooleanAtom):
            return "0 == 0" if each else "0 == 1"
        if isinstance(each, sp.And | sp.Or):
            return (" and " if isinstance(each, sp.And) else " or ").join(sorted(f"({self.written(part)})" for part in each.args))
        if isinstance(each, sp.Not):
            return f"not ({self.written(each.args[0])})"
        if isinstance(each, BooleanFunction) and each.to_nnf() != each:
            return self.written(each.to_nnf())
        return self.term(each)

    def term(self, each: Any) -> str:
        """A formula as text, without parentheses about it."""
        match each:
            case sp.Symbol(name=name) if name in self.names:
                return str(name)
            case sp.Integer():
                return str(each)
            case sp.Rational(p=p, q=q):
                return f"{p}/{q}"
            case sp.Float() | sp.NumberSymbol():
                return self.number(each)
            case sp.Add():
                return self.sum(each)
            case sp.Mul():
                return self.product(each)
            case sp.Pow(base=base, exp=power) if power == sp.Rational(1, 2):
                return f"sqrt({self.term(base)})"
            case sp.Pow(base=base, exp=power) if power.is_Number and power < 0:
                return f"1/{self.factor(sp.Pow(base, -power))}"
            case sp.Pow(base=base, exp=power):
                return f"{self.atom(base)}**{self.atom(power)}"
            case _ if type(each) in NAMES:
                return f"{NAMES[type(each)]}({', '.join(map(self.term, sorted(each.args, key=str)))})"
        return self.refuse(each)

    def number(self, each: Any) -> str:
        """A number in all digits of its float; pi and e by their names, unless these are coordinates."""
        name = {sp.pi: "pi", sp.E: "e"}.get(each, "")
        value = repr(float(each))
        return name if name and name not in self.names else value if "inf" not in value else self.refuse(each)

    def sum(self, each: Any) -> str:
        """A sum, in sympy's order of terms."""
        terms = each.as_ordered_terms()
        if len(terms) > WIDE:
            return " + ".join(f"({self.sum(sp.Add(*part, evaluate=False))})" for part in _parts(terms))
        text = self.term(terms[0])
        for term in terms[1:]:
            minus = term.as_coeff_Mul()[0] < 0
            text += f" {'-' if minus else '+'} {self.term(-term if minus else term)}"
        return text

    def product(self, each: Any) -> str:
        """A product as a quotient of the factors with positive powers and the others."""
        sign = "-" if each.as_coeff_Mul()[0] < 0 else ""
        above, below = list[str](), list[str]()
        for factor in (-each if sign else each).as_ordered_factors():
            if isinstance(factor, sp.Rational) and factor.q != 1:
                above += [str(factor.p)] * (factor.p != 1)
                below.append(str(factor.q))
            elif isinstance(factor, sp.Pow) and factor.exp.is_Number and factor.exp < 0:
                below.append(self.factor(sp.Pow(factor.base, -factor.exp)))
            else:
                above.append(self.factor(factor))
        quotient = f"/{_product(below)}" if len(below) < 2 else f"/({_product(below)})"
        return f"{sign}{_product(above) or '1'}{quotient if below else ''}"

    def factor(self, each: Any) -> str:
        """A factor of a product, in parentheses unless it is an atom, a power or a call."""
        text = self.term(each)
        return f"({text})" if each.is_Add or each.is_Mul or text.startswith(("-", "1/")) or _is_fraction(each) else text

    def atom(self, each: Any) -> str:
        """A base or an exponent, in parentheses unless it is a name, a call or a number that is not negative."""
        return f"({self.term(each)})" if isinstance(each, sp.Pow) and each.exp != sp.Rational(1, 2) else self.factor(each)

    def refuse(self, each: Any) -> str:
        """Raise the ConditionError about what the grammar lacks."""
        if isinstance(each, sp.Symbol):
            raise ConditionError(f"the name {each} is not a coordinate; expected: {', '.join(sorted(self.names))}")
        if isinstance(each, sp.Piecewise):
            raise ConditionError(f"{each} chooses by conditions; expected: its cases as pieces of a map")
        if isinstance(each, sp.Function | sp.Derivative | sp.Subs):
            known = f"a formula of + - * / **, {', '.join(FUNCTIONS)}"
            raise ConditionError(f"{each} has the function {each.func}, which conditions and formulas do not; expected: {known}")
        raise ConditionError(f"{each} is not a formula of finite real numbers; expected: a formula of numbers and coordinates")


def _product(factors: list[str]) -> str:
    if len(factors) > WIDE:
        return "*".join(f"({_product(part)})" for part in _parts(factors))
    return "*".join(factors)


def _parts(terms: list[Any]) -> Iterator[list[Any]]:
    """As many parts, of nearly the same length, as may stand beside each other."""
    size = max(2, -(-len(terms) // WIDE))
    return (terms[k : k + size] for k in range(0, len(terms), size))


def _is_fraction(each: Any) -> bool:
    return isinstance(each, sp.Rational) and each.q != 1
