"""If-conversion: scalar functions over several particles at once, with selections in place of branches.

A function such as the stress update is written for one particle, with `if` and early `return`. For arguments that are
strict lanes its syntax tree is converted. A branch whose condition depends on no lane, such as the choice of a
material model, stays a branch. Where the condition is a mask, both sides are computed and each lane selects its own
result; a side that contains calls is skipped if it concerns no lane. Each lane computes what a single number would,
in the same order: the bits are the same.

A function without such a form, for example an iteration or a search in a table, is called once per lane.
"""

from __future__ import annotations

import ast
import copy
import inspect
import textwrap
from collections.abc import Iterable
from typing import Any

from .lazy_import import CompiledFunction, PythonFunction
from .vector import lane_masks

# Helpers, by their names in converted functions.
_SELECTIONS = "select", "mask_and", "mask_or", "mask_not", "any_true", "all_true"
_HELPERS = {f"_{name}": getattr(lane_masks, name) for name in _SELECTIONS}
# Cheap functions, which are computed for lanes that do not need them, too.
_CHEAP = {"min", "max", "abs"}
# Functions of single numbers only.
_SINGLE = {"int", "number_at"}
# Largest number of statements that are duplicated after a branch that returns on some of its paths.
_SHORT = 3


class UnsuitableError(Exception):
    """Raised for a function that cannot be converted."""


def convert(function: PythonFunction, wide: Iterable[int]) -> PythonFunction:
    """Return `function` for lanes in the arguments with indices `wide`, or raise `UnsuitableError`."""
    tree = convert_tree(function, wide)
    namespace = dict(function.__globals__) | _HELPERS
    exec(compile(ast.Module([tree], []), inspect.getfile(function), "exec"), namespace)  # noqa: S102 text of ours
    result: PythonFunction = namespace[tree.name]
    result.__module__ = function.__module__
    return result


def convert_tree(function: PythonFunction, wide: Iterable[int]) -> ast.FunctionDef:
    """Return the syntax tree that `convert` compiles; `ast.unparse` shows it."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise UnsuitableError
    names = [argument.arg for argument in tree.args.args]
    body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
    tree.body = _Converter({names[k] for k in wide}, set(names)).block(body)
    tree.name, tree.decorator_list = f"{function.__name__}_in_lanes", []
    return ast.fix_missing_locations(tree)


_EACH = """
def each_{name}({names}):
    arguments = ({names},)
    made = empty_lanes(function(*extract_lane(arguments, 0)))
    for k in range(LANES):
        made = insert_lane(made, k, function(*extract_lane(arguments, k)))
    return made
"""


def apply_per_lane(function: CompiledFunction) -> PythonFunction:
    """Return a function that calls a compiled `function` for each lane of its arguments in turn."""
    name, names = function.py_func.__name__, ", ".join(inspect.signature(function.py_func).parameters)
    namespace = vars(lane_masks) | {"function": function}
    exec(_EACH.format(name=name, names=names), namespace)  # noqa: S102
    return namespace[f"each_{name}"]


def _names(target: ast.AST) -> list[str]:
    """Return the names that an assignment to `target` binds."""
    return [node.id for node in ast.walk(target) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)]


def _bound(statements: Iterable[ast.stmt]) -> list[str]:
    """Return the names that are bound in statements, in order, each once."""
    return list(dict.fromkeys(name for statement in statements for name in _names(statement)))


def _returns(statements: list[ast.stmt]) -> bool:
    """Whether a path through the statements returns."""
    return any(isinstance(node, ast.Return) for statement in statements for node in ast.walk(statement))


def _ends(statements: list[ast.stmt]) -> bool:
    """Whether every path through the statements returns."""
    last = statements[-1] if statements else None
    if isinstance(last, ast.If):
        return _ends(last.body) and _ends(last.orelse)
    return isinstance(last, ast.Return)


def _load(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _call(helper: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(_load(helper), list(arguments), [])


def _assign(name: str, value: ast.expr) -> ast.stmt:
    return ast.Assign([ast.Name(name, ast.Store())], value)


def _all(values: list[ast.expr]) -> ast.expr:
    return values[0] if len(values) == 1 else ast.BoolOp(ast.And(), values)


class _Expression(ast.NodeTransformer):
    """Rewrite an expression in which the names `wide` are lanes."""

    def __init__(self, wide: set[str]) -> None:
        self.wide = wide

    def is_wide(self, node: ast.AST) -> bool:
        return any(isinstance(part, ast.Name) and part.id in self.wide for part in ast.walk(node))

    def visit(self, node: ast.AST) -> Any:
        return super().visit(node) if self.is_wide(node) else node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        result, *terms = [self.visit(value) for value in node.values]
        for term in terms:
            result = _call("_mask_and" if isinstance(node.op, ast.And) else "_mask_or", result, term)
        return result

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        node = ast.UnaryOp(node.op, self.visit(node.operand))
        return _call("_mask_not", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        values = [self.visit(value) for value in (node.left, *node.comparators)]
        pairs = zip(node.ops, values, values[1:], strict=False)
        result: ast.expr
        result, *terms = [ast.Compare(a, [sign], [copy.deepcopy(b)]) for sign, a, b in pairs]
        for term in terms:
            result = _call("_mask_and", result, term)
        return result

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        test, body, orelse = (self.visit(part) for part in (node.test, node.body, node.orelse))
        return _call("_select", test, body, orelse) if self.is_wide(node.test) else ast.IfExp(test, body, orelse)

    def visit_Call(self, node: ast.Call) -> ast.expr:
        if isinstance(node.func, ast.Name) and node.func.id in _SINGLE:
            raise UnsuitableError
        return ast.Call(node.func, [self.visit(argument) for argument in node.args], node.keywords)


class _Converter:
    """Rewrite statements in order; `wide` are the names that hold lanes at present, `known` those with a value."""

    def __init__(self, wide: set[str], known: set[str]) -> None:
        self.wide, self.known, self.count = wide, known, 0

    def new(self, word: str) -> str:
        """Return an unused name."""
        self.count += 1
        return f"{word}_{self.count}_"

    def expression(self, node: ast.expr) -> ast.expr:
        result: ast.expr = _Expression(self.wide).visit(copy.deepcopy(node))
        return result

    def is_wide(self, node: ast.AST) -> bool:
        return _Expression(self.wide).is_wide(node)

    def block(self, statements: list[ast.stmt], result: str = "", where: str = "") -> list[ast.stmt]:
        """Return the statements for lanes.

        `result` is the name of the variable for the returned value, empty if they may return it themselves. `where`
        is the name of the mask of the lanes that they apply to, empty for all lanes.
        """
        body: list[ast.stmt] = []
        for index, statement in enumerate(statements):
            if isinstance(statement, ast.If) and _returns([statement]):
                return body + self.return_branch(statement, statements[index + 1 :], result, where)
            if isinstance(statement, ast.Return):
                value = self.expression(statement.value)  # type: ignore[arg-type]
                return [*body, _assign(result, value) if result else ast.Return(value)]
            body += self.statement(statement, where)
        return body

    def statement(self, node: ast.stmt, where: str) -> list[ast.stmt]:
        match node:
            case ast.Assign(targets=targets, value=value):
                assignment = ast.Assign(copy.deepcopy(targets), self.expression(value))
                return [self.assignment(assignment, self.is_wide(value), where)]
            case ast.AugAssign(target=target, op=op, value=value):
                wide = self.is_wide(value) or self.is_wide(target)
                operand = copy.deepcopy(target)
                operand.ctx = ast.Load()
                update = ast.Assign([copy.deepcopy(target)], ast.BinOp(operand, op, self.expression(value)))
                return [self.assignment(update, wide, where)]
            case ast.If():
                return self.branch(node, where)
            case ast.For(iter=several, target=target, body=body, orelse=[]):
                names = set(_names(target))
                self.known |= names
                self.wide = self.wide | names if self.is_wide(several) else self.wide - names
                for _ in range(2):  # a name that one iteration makes wide is wide in the next
                    loop_body = self.block(body, where=where)
                return [ast.For(target, self.expression(several), loop_body, [])]
            case ast.Expr(value=value) if not where:
                return [ast.Expr(self.expression(value))]
        raise UnsuitableError

    def assignment(self, statement: ast.Assign, wide: bool, where: str) -> ast.stmt:
        """Record the names that an assignment binds; one to an item of rows applies to the lanes `where` only."""
        for target in statement.targets:
            if isinstance(target, ast.Subscript) and where:
                value = copy.deepcopy(target)
                value.ctx = ast.Load()
                statement = ast.Assign([target], _call("_select", _load(where), statement.value, value))
            names = set(_names(target))
            self.known |= names
            self.wide = self.wide | names if wide else self.wide - names
        return statement

    def branch(self, statement: ast.If, where: str) -> list[ast.stmt]:
        """Return a branch that does not return."""
        test, wide = self.expression(statement.test), set(self.wide)
        if not self.is_wide(statement.test):
            body = self.block(statement.body, where=where)
            body_names, self.wide = self.wide, set(wide)
            orelse = self.block(statement.orelse, where=where)
            self.wide |= body_names
            return [ast.If(test, body, orelse)]
        scalar_part, lane_part = self.parts(statement.test)
        if scalar_part and not statement.orelse:  # the condition that is common to all lanes comes first
            return self.branch(ast.If(scalar_part, [ast.If(lane_part, statement.body, [])], []), where)
        return self.wide_branch(statement, test, where)

    def wide_branch(self, statement: ast.If, test: ast.expr, where: str) -> list[ast.stmt]:
        """Return a branch that does not return and whose condition is a mask."""
        wide, known, mask = set(self.wide), set(self.known), self.new("where")
        statements: list[ast.stmt] = [_assign(mask, test)]
        nested = self.nested_mask(mask, where, statements)
        else_names = _bound(statement.orelse)
        changed = [name for name in _bound([*statement.body, *statement.orelse]) if name in known]
        new_names = [name for name in _bound(statement.body) if name in else_names and name not in known]
        copies = {name: self.new(name) for name in changed}
        saved = [_assign(new, _load(name)) for name, new in copies.items()]
        body = saved + self.block(statement.body, where=nested)
        if not statement.orelse:
            body += [self.merge(mask, name, _load(name), _load(copies[name])) for name in changed]
            costly = any(self.is_costly(part) for part in statement.body)
            statements += [ast.If(_call("_any_true", _load(mask)), body, [])] if costly else body
        else:
            results = {name: self.new(name) for name in changed + new_names}
            statements += body + [_assign(new, _load(name)) for name, new in results.items()]
            statements += [_assign(name, _load(new)) for name, new in copies.items()]
            self.wide, self.known = set(wide), set(known)
            inverse = self.new("where")
            statements.append(_assign(inverse, _call("_mask_not", _load(mask))))
            nested = self.nested_mask(inverse, where, statements)
            statements += self.block(statement.orelse, where=nested)
            statements += [self.merge(mask, name, _load(new), _load(name)) for name, new in results.items()]
        self.wide, self.known = wide | set(changed + new_names), known | set(changed + new_names)
        return statements

    def parts(self, test: ast.expr) -> tuple[ast.expr | None, ast.expr]:
        """Split a conjunction into its part that does not depend on lanes, if any, and the rest."""
        if not isinstance(test, ast.BoolOp) or isinstance(test.op, ast.Or):
            return None, test
        scalars = [value for value in test.values if not self.is_wide(value)]
        lanes = [value for value in test.values if self.is_wide(value)]
        return (_all(scalars) if scalars else None), _all(lanes)

    def nested_mask(self, mask: str, where: str, statements: list[ast.stmt]) -> str:
        """Return the name of the mask `where` and `mask`."""
        if not where:
            return mask
        name = self.new("where")
        statements.append(_assign(name, _call("_mask_and", _load(where), _load(mask))))
        return name

    @staticmethod
    def merge(mask: str, name: str, a: ast.expr, b: ast.expr) -> ast.stmt:
        return _assign(name, _call("_select", _load(mask), a, b))

    @staticmethod
    def is_costly(statement: ast.stmt) -> bool:
        """Whether a statement should be skipped if no lane needs it."""
        for node in ast.walk(statement):
            if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and node.func.id in _CHEAP):
                return True
        return False

    def return_branch(self, statement: ast.If, rest: list[ast.stmt], result: str, where: str) -> list[ast.stmt]:
        """Return a branch that returns on some path, and the statements that follow it."""
        sides = [statement.body, statement.orelse]
        if sum(not _ends(side) for side in sides) > 1 and len(rest) > _SHORT:
            raise UnsuitableError
        body, orelse = (side if _ends(side) else [*side, *rest] for side in sides)
        test, wide, known = self.expression(statement.test), set(self.wide), set(self.known)
        if not self.is_wide(statement.test):
            if_body = self.block(body, result, where)
            self.wide, self.known = set(wide), set(known)
            return [ast.If(test, if_body, self.block(orelse, result, where))]
        mask, inverse = self.new("where"), self.new("where")
        statements: list[ast.stmt] = [_assign(mask, test), _assign(inverse, _call("_mask_not", _load(mask)))]
        if_side, else_side = (body, self.new("result"), mask), (orelse, self.new("result"), inverse)
        # The side that is always computed comes first; the other one is skipped if it concerns no lane.
        is_late = any(map(self.is_costly, body)) and not any(map(self.is_costly, orelse))
        (first, name, mask_1), (second, name_2, mask_2) = (else_side, if_side) if is_late else (if_side, else_side)
        copies = {variable: self.new(variable) for variable in _bound(first) if variable in known}
        statements += [_assign(new, _load(variable)) for variable, new in copies.items()]
        nested = self.nested_mask(mask_1, where, statements)
        statements += self.block(first, name, nested)
        statements += [_assign(variable, _load(new)) for variable, new in copies.items()]
        self.wide, self.known = set(wide), set(known)
        if not (result or is_late):
            statements.append(ast.If(_call("_all_true", _load(mask)), [ast.Return(_load(name))], []))
        nested = self.nested_mask(mask_2, where, statements)
        second_body = self.block(second, name_2, nested)
        second_body.append(_assign(name, _call("_select", _load(mask_2), _load(name_2), _load(name))))
        statements += [ast.If(_call("_any_true", _load(mask_2)), second_body, [])] if is_late else second_body
        return [*statements, _assign(result, _load(name)) if result else ast.Return(_load(name))]
