"""Functions without the parts that a system does not need: what follows from the numbers of its table is decided beforehand.

Conditions on constants, loops without a round, variables with one value, and calls of functions that only return a constant.
"""

import ast
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from copy import deepcopy
from typing import Any

from nsmaps.exports.engine.evaluation import LEAVING, Evaluation, NotConstantError, numeral
from nsmaps.exports.engine.kinds import Array, Kind, Known
from nsmaps.exports.engine.pruning import Pruning, Result, assignment, calls


class Folding(Evaluation, ast.NodeTransformer):
    """One function, of which arguments of these kinds are known; `called` answers what a call returns if that is a constant."""

    def __init__(self, tree: ast.FunctionDef, known: dict[str, Any], given: dict[str, Kind], called: Callable[..., Any]) -> None:
        super().__init__(known, given, called)
        self.tree, self.aliases = tree, dict[str, ast.expr]()
        before = ""
        while before != (now := ast.dump(tree)):
            before = now
            stored = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]
            self.count = Counter([*stored, *(each.arg for each in tree.args.args)])
            fixed = {name: kind.value for name, kind in given.items() if isinstance(kind, Known) and self.count[name] == 1}
            self.constants |= fixed
            tree.body = self.block(tree.body)
            self.read = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
            tree.body = Pruning(self.read).block(tree.body)

    @property
    def result(self) -> Any:
        """The constant that the function returns if it does nothing else, None without a value. Raises NotConstantError."""
        match [each for each in self.tree.body if not isinstance(each, ast.Expr) or not isinstance(each.value, ast.Constant)]:
            case [] | [ast.Return(value=None)]:
                return None
            case [ast.Return(value=ast.expr() as value)]:
                return self.value(value)
        raise NotConstantError

    def block(self, statements: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Statements in order, up to one that leaves the block."""
        found, before = list[ast.stmt](), dict(self.facts)
        for statement in statements:
            got: Result = self.visit(statement)
            found += got if isinstance(got, list) else [got] if got else []
            if not found:
                continue
            if isinstance(found[-1], LEAVING):
                break
            if isinstance(got, ast.If) and got.body and isinstance(got.body[-1], LEAVING):
                self.learn(got.test, False)
        self.facts = before
        return found

    def visit(self, node: Any) -> Any:
        """A node with what is known put in: truth values, whole numbers, and names of constants and of arrays."""
        node = super().visit(node)
        if not isinstance(node, ast.expr) or isinstance(node, ast.Constant | ast.Tuple):
            return node
        if isinstance(node, ast.Name):
            if isinstance(node.ctx, ast.Store):
                return node
            if node.id in self.aliases:
                return deepcopy(self.aliases[node.id])
            known = node.id in self.constants and not numeral(self.constants[node.id])
            return ast.Constant(self.constants[node.id]) if known else node
        if isinstance(node, ast.BinOp) and not all(isinstance(each, ast.Constant) for each in (node.left, node.right)):
            return node
        try:
            value = self.value(node)
        except NotConstantError:
            return node
        whole = isinstance(value, bool | int) or (isinstance(node, ast.Call) and isinstance(value, float))
        return ast.Constant(value) if whole and not isinstance(getattr(node, "ctx", None), ast.Store) else node

    def visit_Expr(self, node: ast.Expr) -> Result:
        """Nothing, of a call that does nothing."""
        value = self.visit(node.value)
        try:
            self.value(value)
        except NotConstantError:
            return ast.Expr(value)
        return node if isinstance(node.value, ast.Constant) else None  # a docstring is one

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        """One comparison, or those of a chain or with members of a tuple."""
        left, parts, alone = node.left, list[ast.expr](), len(node.ops) == 1
        for sign, right in zip(node.ops, node.comparators, strict=True):
            if isinstance(sign, ast.In) and isinstance(right, ast.Tuple):
                either = [ast.Compare(left, [ast.Eq()], [each]) for each in right.elts]
                parts.append(ast.BoolOp(ast.Or(), list(either)))
            elif isinstance(sign, ast.NotIn) and isinstance(right, ast.Tuple):
                parts.append(ast.BoolOp(ast.And(), [ast.Compare(left, [ast.NotEq()], [each]) for each in right.elts]))
            else:
                parts.append(ast.Compare(left, [sign], [right]))
            left = right
        if alone and isinstance(parts[0], ast.Compare):
            return self.generic_visit(node)  # type: ignore[return-value]
        return self.visit(parts[0] if alone else ast.BoolOp(ast.And(), parts))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        """Without operands that are known; those behind a call that may change something stay."""
        decisive, found = isinstance(node.op, ast.Or), list[ast.expr]()
        for each in map(self.visit, node.values):
            if not isinstance(each, ast.Constant):
                found.append(each)
            elif each.value == decisive:
                if not any(map(calls, found)):
                    return ast.Constant(decisive)
                found.append(each)
                break
        return ast.BoolOp(node.op, found) if len(found) > 1 else found[0] if found else ast.Constant(not decisive)

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        """The branch that is taken, if that is known."""
        test = self.visit(node.test)
        if isinstance(test, ast.Constant):
            return self.visit(node.body if test.value else node.orelse)
        parts = self.visit(node.body), self.visit(node.orelse)
        same = ast.dump(parts[0]) == ast.dump(parts[1]) and not calls(test)
        return parts[0] if same else ast.IfExp(test, *parts)

    def visit_If(self, node: ast.If) -> Result:
        """The branch that is taken, if that is known."""
        test = self.visit(node.test)
        if isinstance(test, ast.Constant):
            return self.block(node.body if test.value else node.orelse)
        return ast.If(test, self.block(node.body), self.block(node.orelse))

    def visit_While(self, node: ast.While) -> Result:
        """Nothing, if the condition never holds."""
        test = self.visit(node.test)
        if isinstance(test, ast.Constant) and not test.value:
            return None
        return ast.While(test, self.block(node.body), [])

    def visit_For(self, node: ast.For) -> Result:
        """Nothing, if there is no round."""
        assert isinstance(node.iter, ast.Call)
        bounds = [self.visit(each) for each in node.iter.args]
        try:
            if not range(*map(self.value, bounds)):
                return None
        except NotConstantError:
            pass
        return ast.For(node.target, ast.Call(node.iter.func, bounds, []), self.block(node.body), [])

    def visit_Assign(self, node: ast.Assign) -> Result:
        """What is assigned to variables that are not known now; all entries of an array one by one."""
        (target,), value = map(self.visit, node.targets), self.visit(node.value)
        if isinstance(target, ast.Subscript) and isinstance(target.slice, ast.Slice):
            at = ast.Subscript(target.value, ast.Name("entry", ast.Load()), ast.Store())
            rounds = ast.Call(ast.Name("range", ast.Load()), [ast.Constant(self.length(target.value, 0))], [])
            return ast.For(ast.Name("entry", ast.Store()), rounds, [ast.Assign([at], value)], [])
        if isinstance(target, ast.Subscript) and getattr(self.kind(target.value), "fixed", False):
            return None  # what is never read
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        values: Sequence[ast.expr] | None = [value] if len(targets) == 1 else getattr(value, "elts", None)
        if values is None or len(values) != len(targets):
            try:
                values = [ast.Constant(each) for each in self.value(value)]
            except NotConstantError:
                return ast.Assign([target], value)
        pairs = [(one, other) for one, other in zip(targets, values, strict=True) if not self.learnt(one, other)]
        return [assignment(pairs)] if pairs else None

    def learnt(self, target: ast.expr, value: ast.expr) -> bool:
        """Whether a target is a variable with one value, which is kept in mind: a constant, or an array of a record."""
        if not isinstance(target, ast.Name) or self.count[target.id] != 1:
            return False
        try:
            constant = self.value(value)
            if isinstance(constant, tuple):
                return False
            self.constants[target.id] = constant
            return not numeral(constant)
        except NotConstantError:
            if not isinstance(value, ast.Attribute) or not isinstance(self.kind(value), Array):
                return False
            self.aliases[target.id] = value
        return True
