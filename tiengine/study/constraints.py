"""Constraints of a plan: comparisons of factors, read as Python expressions and never executed as such."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

from tiengine.parameters.errors import InputError, nearest

__all__ = ["Constraint"]

LONGEST = 500  # characters

BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {"abs": abs, "min": min, "max": max}


class Constraint:
    """Expression that is true for the points of a study.

    Attributes:
        text: The expression, for example ``"speed * friction < 120 or slab == 'CRTS_III'"``.
    """

    def __init__(self, text: str, names: Mapping[str, Any]) -> None:
        """Read an expression.

        Args:
            text: The expression.
            names: Known names of factors and their keys.

        Raises:
            InputError: It is no expression, or names no factor.
        """
        self.text = text
        try:
            if len(text) > LONGEST:
                raise ValueError(f"longer than {LONGEST} characters")
            self._tree = ast.parse(text, mode="eval").body
        except (ValueError, SyntaxError, RecursionError, MemoryError) as error:
            raise self._bad(f"is no expression ({getattr(error, 'msg', error)})") from None
        self._check(self._tree, names)

    def holds(self, values: Mapping[str, Any]) -> bool:
        """Whether a point fulfils it.

        Args:
            values: Values of all factors by name and by key.

        Raises:
            InputError: The values cannot be compared.
        """
        try:
            return bool(self._value(self._tree, values))
        except (TypeError, ZeroDivisionError, ValueError) as error:
            raise self._bad(f"cannot be evaluated ({error})") from None

    def _bad(self, why: str) -> InputError:
        return InputError(f"constraint {self.text[:80]!r}: {why}")

    def _check(self, node: ast.expr, names: Mapping[str, Any]) -> None:
        """Refuse what is neither a factor, a number, a text, an operation nor a comparison."""
        if (name := _dotted(node)) is not None:
            if name not in names:
                raise self._bad(f"{name!r} is no factor{nearest(name, list(names))}")
            return
        match node:
            case ast.Constant(value=bool() | int() | float() | str()):
                return
            case ast.BoolOp(values=parts):
                pass
            case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=part):
                parts = [part]
            case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
                parts = [left, right]
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in COMPARISONS for op in ops):
                parts = [left, *others]
            case ast.Call(func=ast.Name(id=name), args=parts, keywords=[]) if name in FUNCTIONS and parts:
                pass
            case _:
                raise self._bad("must be a comparison of factors by + - * / < <= > >= == != and or not abs min max")
        for part in parts:
            self._check(part, names)

    def _value(self, node: ast.expr, values: Mapping[str, Any]) -> Any:
        """Value of a part of the expression."""
        if (name := _dotted(node)) is not None:
            return values[name]
        match node:
            case ast.Constant(value=value):
                return value
            case ast.BoolOp(op=op, values=parts):
                choose = all if isinstance(op, ast.And) else any
                return choose(self._value(part, values) for part in parts)
            case ast.UnaryOp(op=op, operand=part):
                value = self._value(part, values)
                return not value if isinstance(op, ast.Not) else -value
            case ast.BinOp(left=left, op=op, right=right):
                return BINARY[type(op)](self._value(left, values), self._value(right, values))
            case ast.Compare(left=left, ops=ops, comparators=others):
                terms = [self._value(part, values) for part in (left, *others)]
                pairs = zip(ops, terms, terms[1:], strict=False)
                return all(COMPARISONS[type(op)](a, b) for op, a, b in pairs)
            case ast.Call(func=ast.Name(id=name), args=parts):
                return FUNCTIONS[name](*(self._value(part, values) for part in parts))
        raise self._bad("cannot be evaluated")


def _dotted(node: ast.expr) -> str | None:
    """Name or dotted key that a node spells; None for other nodes."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=inner, attr=last):
            head = _dotted(inner)
            return None if head is None else f"{head}.{last}"
    return None
