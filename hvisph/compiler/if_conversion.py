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
    made = convert_tree(function, wide)
    namespace = dict(function.__globals__) | _HELPERS
    exec(compile(ast.Module([made], []), inspect.getfile(function), "exec"), namespace)  # noqa: S102 text of ours
    result: PythonFunction = namespace[made.name]
    result.__module__ = function.__module__
    return result


def convert_tree(function: PythonFunction, wide: Iterable[int]) -> ast.FunctionDef:
    """Return the syntax tree that `convert` compiles; `ast.unparse` shows it."""
    made = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    if not isinstance(made, ast.FunctionDef):
        raise UnsuitableError
    names = [argument.arg for argument in made.args.args]
    body = made.body[1:] if ast.get_docstring(made) is not None else made.body
    made.body = _Converter({names[k] for k in wide}, set(names)).block(body)
    made.name, made.decorator_list = f"{function.__name__}_in_lanes", []
    return ast.fix_missing_locations(made)


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
    return list(dict.fromkeys(name for one in statements for name in _names(one)))


def _returns(statements: list[ast.stmt]) -> bool:
    """Whether a path through the statements returns."""
    return any(isinstance(node, ast.Return) for one in statements for node in ast.walk(one))


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
        made, *others = [self.visit(value) for value in node.values]
        for other in others:
            made = _call("_mask_and" if isinstance(node.op, ast.And) else "_mask_or", made, other)
        return made

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        node = ast.UnaryOp(node.op, self.visit(node.operand))
        return _call("_mask_not", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        values = [self.visit(value) for value in (node.left, *node.comparators)]
        pairs = zip(node.ops, values, values[1:], strict=False)
        made: ast.expr
        made, *others = [ast.Compare(a, [sign], [copy.deepcopy(b)]) for sign, a, b in pairs]
        for other in others:
            made = _call("_mask_and", made, other)
        return made

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
        made: ast.expr = _Expression(self.wide).visit(copy.deepcopy(node))
        return made

    def is_wide(self, node: ast.AST) -> bool:
        return _Expression(self.wide).is_wide(node)

    def block(self, statements: list[ast.stmt], result: str = "", where: str = "") -> list[ast.stmt]:
        """Return the statements for lanes.

        `result` is the name of the variable for the returned value, empty if they may return it themselves. `where`
        is the name of the mask of the lanes that they apply to, empty for all lanes.
        """
        made: list[ast.stmt] = []
        for place, one in enumerate(statements):
            if isinstance(one, ast.If) and _returns([one]):
                return made + self.return_branch(one, statements[place + 1 :], result, where)
            if isinstance(one, ast.Return):
                value = self.expression(one.value)  # type: ignore[arg-type]
                return [*made, _assign(result, value) if result else ast.Return(value)]
            made += self.statement(one, where)
        return made

    def statement(self, one: ast.stmt, where: str) -> list[ast.stmt]:
        match one:
            case ast.Assign(targets=targets, value=value):
                made = ast.Assign(copy.deepcopy(targets), self.expression(value))
                return [self.assignment(made, self.is_wide(value), where)]
            case ast.AugAssign(target=target, op=op, value=value):
                wide = self.is_wide(value) or self.is_wide(target)
                read = copy.deepcopy(target)
                read.ctx = ast.Load()
                new = ast.Assign([copy.deepcopy(target)], ast.BinOp(read, op, self.expression(value)))
                return [self.assignment(new, wide, where)]
            case ast.If():
                return self.branch(one, where)
            case ast.For(iter=several, target=target, body=body, orelse=[]):
                names = set(_names(target))
                self.known |= names
                self.wide = self.wide | names if self.is_wide(several) else self.wide - names
                for _ in range(2):  # a name that one iteration makes wide is wide in the next
                    turn = self.block(body, where=where)
                return [ast.For(target, self.expression(several), turn, [])]
            case ast.Expr(value=value) if not where:
                return [ast.Expr(self.expression(value))]
        raise UnsuitableError

    def assignment(self, one: ast.Assign, wide: bool, where: str) -> ast.stmt:
        """Record the names that an assignment binds; one to an item of rows applies to the lanes `where` only."""
        for target in one.targets:
            if isinstance(target, ast.Subscript) and where:
                before = copy.deepcopy(target)
                before.ctx = ast.Load()
                one = ast.Assign([target], _call("_select", _load(where), one.value, before))
            names = set(_names(target))
            self.known |= names
            self.wide = self.wide | names if wide else self.wide - names
        return one

    def branch(self, one: ast.If, where: str) -> list[ast.stmt]:
        """Return a branch that does not return."""
        test, wide = self.expression(one.test), set(self.wide)
        if not self.is_wide(one.test):
            body = self.block(one.body, where=where)
            of_body, self.wide = self.wide, set(wide)
            orelse = self.block(one.orelse, where=where)
            self.wide |= of_body
            return [ast.If(test, body, orelse)]
        alike, unlike = self.parts(one.test)
        if alike and not one.orelse:  # the condition that is common to all lanes comes first
            return self.branch(ast.If(alike, [ast.If(unlike, one.body, [])], []), where)
        return self.wide_branch(one, test, where)

    def wide_branch(self, one: ast.If, test: ast.expr, where: str) -> list[ast.stmt]:
        """Return a branch that does not return and whose condition is a mask."""
        wide, known, held = set(self.wide), set(self.known), self.new("where")
        made: list[ast.stmt] = [_assign(held, test)]
        inner = self.nested_mask(held, where, made)
        of_else = _bound(one.orelse)
        changed = [name for name in _bound([*one.body, *one.orelse]) if name in known]
        fresh = [name for name in _bound(one.body) if name in of_else and name not in known]
        before = {name: self.new(name) for name in changed}
        first = [_assign(new, _load(name)) for name, new in before.items()]
        body = first + self.block(one.body, where=inner)
        if not one.orelse:
            body += [self.merge(held, name, _load(name), _load(before[name])) for name in changed]
            costly = any(self.is_costly(part) for part in one.body)
            made += [ast.If(_call("_any_true", _load(held)), body, [])] if costly else body
        else:
            of_body = {name: self.new(name) for name in changed + fresh}
            made += body + [_assign(new, _load(name)) for name, new in of_body.items()]
            made += [_assign(name, _load(new)) for name, new in before.items()]
            self.wide, self.known = set(wide), set(known)
            outside = self.new("where")
            made.append(_assign(outside, _call("_mask_not", _load(held))))
            inner = self.nested_mask(outside, where, made)
            made += self.block(one.orelse, where=inner)
            made += [self.merge(held, name, _load(new), _load(name)) for name, new in of_body.items()]
        self.wide, self.known = wide | set(changed + fresh), known | set(changed + fresh)
        return made

    def parts(self, test: ast.expr) -> tuple[ast.expr | None, ast.expr]:
        """Split a conjunction into its part that does not depend on lanes, if any, and the rest."""
        if not isinstance(test, ast.BoolOp) or isinstance(test.op, ast.Or):
            return None, test
        alike = [value for value in test.values if not self.is_wide(value)]
        unlike = [value for value in test.values if self.is_wide(value)]
        return (_all(alike) if alike else None), _all(unlike)

    def nested_mask(self, held: str, where: str, made: list[ast.stmt]) -> str:
        """Return the name of the mask `where` and `held`."""
        if not where:
            return held
        inner = self.new("where")
        made.append(_assign(inner, _call("_mask_and", _load(where), _load(held))))
        return inner

    @staticmethod
    def merge(held: str, name: str, a: ast.expr, b: ast.expr) -> ast.stmt:
        return _assign(name, _call("_select", _load(held), a, b))

    @staticmethod
    def is_costly(one: ast.stmt) -> bool:
        """Whether a statement should be skipped if no lane needs it."""
        for node in ast.walk(one):
            if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and node.func.id in _CHEAP):
                return True
        return False

    def return_branch(self, one: ast.If, rest: list[ast.stmt], result: str, where: str) -> list[ast.stmt]:
        """Return a branch that returns on some path, and the statements that follow it."""
        sides = [one.body, one.orelse]
        if sum(not _ends(side) for side in sides) > 1 and len(rest) > _SHORT:
            raise UnsuitableError
        body, orelse = (side if _ends(side) else [*side, *rest] for side in sides)
        test, wide, known = self.expression(one.test), set(self.wide), set(self.known)
        if not self.is_wide(one.test):
            here = self.block(body, result, where)
            self.wide, self.known = set(wide), set(known)
            return [ast.If(test, here, self.block(orelse, result, where))]
        held, outside = self.new("where"), self.new("where")
        made: list[ast.stmt] = [_assign(held, test), _assign(outside, _call("_mask_not", _load(held)))]
        taken, other = (body, self.new("result"), held), (orelse, self.new("result"), outside)
        # The side that is always computed comes first; the other one is skipped if it concerns no lane.
        late = any(map(self.is_costly, body)) and not any(map(self.is_costly, orelse))
        (first, name, these), (second, last, those) = (other, taken) if late else (taken, other)
        kept = {bound: self.new(bound) for bound in _bound(first) if bound in known}
        made += [_assign(new, _load(bound)) for bound, new in kept.items()]
        inner = self.nested_mask(these, where, made)
        made += self.block(first, name, inner)
        made += [_assign(bound, _load(new)) for bound, new in kept.items()]
        self.wide, self.known = set(wide), set(known)
        if not (result or late):
            made.append(ast.If(_call("_all_true", _load(held)), [ast.Return(_load(name))], []))
        inner = self.nested_mask(those, where, made)
        after = self.block(second, last, inner)
        after.append(_assign(name, _call("_select", _load(those), _load(last), _load(name))))
        made += [ast.If(_call("_any_true", _load(those)), after, [])] if late else after
        return [*made, _assign(result, _load(name)) if result else ast.Return(_load(name))]
