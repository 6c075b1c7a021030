"""Expressions of laws, written in the grammar of another language."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pymoo_hdte.checks import InvalidInput

_PRECEDENCE: dict[type[ast.operator], tuple[int, str]] = {
    ast.Add: (1, "+"),
    ast.Sub: (1, "-"),
    ast.Mult: (2, "*"),
    ast.Div: (2, "/"),
}
_POWER, _ATOM = 3, 4
_COMPARISONS: dict[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
}
FUNCTIONS = ("abs", "asinh", "cos", "exp", "log", "max", "min", "sign", "sin", "sqrt", "tanh")


@dataclass(frozen=True)
class Dialect:
    """How a language writes what is not alike in all of them.

    Attributes
    ----------
    functions : mapping of str to str
        Names of `FUNCTIONS` that differ.
    power : str
        Operator.
    choice : callable
        Returns the text of a condition, and of the values if it holds and if not.
    both, either : callable
        Return two conditions, joined.
    """

    functions: Mapping[str, str]
    power: str
    choice: Callable[[str, str, str], str]
    both: Callable[[str, str], str]
    either: Callable[[str, str], str]


PYTHON = Dialect(
    {
        **{name: f"np.{name}" for name in FUNCTIONS},
        "asinh": "np.arcsinh",
        "max": "np.maximum",
        "min": "np.minimum",
    },
    " ** ",
    lambda condition, yes, no: f"np.where({condition}, {yes}, {no})",
    lambda one, other: f"np.logical_and({one}, {other})",
    lambda one, other: f"np.logical_or({one}, {other})",
)
MODELICA = Dialect(
    {"asinh": "Modelica.Math.asinh"},
    "^",
    lambda condition, yes, no: f"(if {condition} then {yes} else {no})",
    lambda one, other: f"({one}) and ({other})",
    lambda one, other: f"({one}) or ({other})",
)


def written(expression: str, dialect: Dialect, names: Mapping[str, str]) -> str:
    """Return an expression of `Formula` in a dialect.

    Parameters
    ----------
    expression : str
    dialect : Dialect
    names : mapping of str to str
        What each name of the expression is called there.

    Raises
    ------
    InvalidInput
        For anything that is not in the grammar of `Formula`, or an unknown name.
    """

    def refused(node: ast.AST) -> InvalidInput:
        return InvalidInput("formula", ast.unparse(node)[:100], "an expression as Formula tells")

    def text(node: ast.AST, least: int = 0) -> str:
        """Return the text of a node, in brackets where it binds more loosely than ``least``."""
        binds, found = parts(node)
        return f"({found})" if binds < least else found

    def parts(node: ast.AST) -> tuple[int, str]:
        match node:
            case ast.BinOp(left, ast.Pow(), right):
                return _POWER, f"{text(left, _ATOM)}{dialect.power}{text(right, _ATOM)}"
            case ast.BinOp(left, operator, right) if type(operator) in _PRECEDENCE:
                binds, sign = _PRECEDENCE[type(operator)]
                return binds, f"{text(left, binds)} {sign} {text(right, binds + 1)}"
            case ast.UnaryOp(ast.USub(), operand):
                return 1, f"-{text(operand, 2)}"
            case ast.Call(ast.Name(name), arguments, []) if name in FUNCTIONS:
                inside = ", ".join(text(one) for one in arguments)
                return _ATOM, f"{dialect.functions.get(name, name)}({inside})"
            case ast.IfExp(condition, yes, no):
                return _ATOM, dialect.choice(text(condition), text(yes), text(no))
            case ast.Compare(left, [operator], [right]) if type(operator) in _COMPARISONS:
                return 0, f"{text(left, 1)} {_COMPARISONS[type(operator)]} {text(right, 1)}"
            case ast.BoolOp(operator, [one, other]):
                joined = dialect.both if isinstance(operator, ast.And) else dialect.either
                return 0, joined(text(one), text(other))
            case ast.Name(name) if name in names:
                return _ATOM, names[name]
            case ast.Constant(int() | float() as value) if not isinstance(value, bool):
                return _ATOM, repr(value)
        raise refused(node)

    try:
        tree = ast.parse(expression.strip(), mode="eval").body
    except SyntaxError as error:
        raise InvalidInput("formula", expression[:100], f"an expression: {error.msg}") from None
    return text(tree)
