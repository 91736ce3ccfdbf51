"""What is left of a function when nothing reads a variable, or a block is empty, is removed."""

import ast
from collections.abc import Iterable, Sequence

Result = ast.stmt | list[ast.stmt] | None  #: of a statement


class Pruning(ast.NodeTransformer):
    """Statements without variables that are never read, and blocks that are empty."""

    def __init__(self, read: set[str]) -> None:
        self.read = read

    def block(self, statements: Iterable[ast.stmt]) -> list[ast.stmt]:
        """Statements in order."""
        return [kept for statement in statements if (kept := self.visit(statement)) is not None]

    def unread(self, target: ast.expr) -> bool:
        """Whether nothing comes of what is assigned to a target."""
        return isinstance(target, ast.Name) and target.id not in self.read

    def visit_AugAssign(self, node: ast.AugAssign) -> Result:
        return None if self.unread(node.target) and not calls(node.value) else node

    def visit_Assign(self, node: ast.Assign) -> Result:
        (target,), value = node.targets, node.value
        if not isinstance(target, ast.Tuple):
            return node if not self.unread(target) else ast.Expr(value) if calls(value) else None
        targets = [ast.Name("_", ast.Store()) if self.unread(each) else each for each in target.elts]
        if isinstance(value, ast.Tuple):
            pairs = list(zip(targets, value.elts, strict=True))
            pairs = [(one, other) for one, other in pairs if not self.unread(one) or calls(other)]
            return assignment(pairs) if pairs else None
        unread = all(map(self.unread, targets))
        return ast.Expr(value) if unread else ast.Assign([ast.Tuple(targets, ast.Store())], value)

    def visit_If(self, node: ast.If) -> Result:
        body, orelse, test = self.block(node.body), self.block(node.orelse), node.test
        if not body and not orelse:
            return ast.Expr(test) if calls(test) else None
        return ast.If(test, body, orelse) if body else ast.If(ast.UnaryOp(ast.Not(), test), orelse, [])

    def visit_For(self, node: ast.For) -> Result:
        body = self.block(node.body)
        return ast.For(node.target, node.iter, body, []) if body else None


def assignment(pairs: Sequence[tuple[ast.expr, ast.expr]]) -> ast.stmt:
    """One statement that assigns values to targets, all at once."""
    if len(pairs) == 1:
        return ast.Assign([pairs[0][0]], pairs[0][1])
    targets, values = ([*each] for each in zip(*pairs, strict=True))
    return ast.Assign([ast.Tuple(targets, ast.Store())], ast.Tuple(values, ast.Load()))


def indices(node: ast.expr) -> list[ast.expr]:
    """The indices of a subscript."""
    return node.elts if isinstance(node, ast.Tuple) else [node]


def calls(node: ast.expr) -> bool:
    """Whether an expression has a call."""
    return any(isinstance(each, ast.Call) for each in ast.walk(node))
