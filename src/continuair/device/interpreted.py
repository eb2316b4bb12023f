"""Device code run by Python: the same source, on numbers of one run or arrays over runs.

Compiling a kernel takes seconds, and a few evaluations of it take microseconds. `interpreted`
translates a device function and all that it calls into Python, so that a vehicle's first few
evaluations need no compiler. As in packs (device/packs.py), runs differ by values, not by branches.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from functools import cache
from operator import add, mul, neg, sub, truediv
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import warp as wp


class Vector:
    """A vector of Warp: components, each a number or an array over runs."""

    __slots__ = ("components",)
    __array_ufunc__ = None
    """NumPy leaves products with its numbers to this class."""

    def __init__(self, components: list[Any]) -> None:
        self.components = components

    def copy(self) -> Any:
        return type(self)(self.components[:])

    def __getitem__(self, index: int) -> Any:
        return self.components[index]

    def __setitem__(self, index: int, value: Any) -> None:
        self.components[index] = value

    def __add__(self, other: Any) -> Any:
        return type(self)(list(map(add, self.components, other.components)))

    def __sub__(self, other: Any) -> Any:
        return type(self)(list(map(sub, self.components, other.components)))

    def __neg__(self) -> Any:
        return type(self)(list(map(neg, self.components)))

    def __mul__(self, factor: Any) -> Any:
        return type(self)([x * factor for x in self.components])

    def __rmul__(self, factor: Any) -> Any:
        return type(self)([factor * x for x in self.components])

    def __truediv__(self, divisor: Any) -> Any:
        return type(self)([x / divisor for x in self.components])


class Quaternion(Vector):
    """A quaternion of Warp, x y z w."""

    __slots__ = ()

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, Quaternion):
            return super().__mul__(other)
        ax, ay, az, aw = self.components
        bx, by, bz, bw = other.components
        return Quaternion(
            [
                aw * bx + ax * bw + ay * bz - az * by,
                aw * by + ay * bw + az * bx - ax * bz,
                aw * bz + az * bw + ax * by - ay * bx,
                aw * bw - ax * bx - ay * by - az * bz,
            ]
        )


class Matrix(Vector):
    """A matrix of Warp, its entries row by row."""

    __slots__ = ("width",)

    def __init__(self, components: list[Any], width: int) -> None:
        self.components, self.width = components, width

    def copy(self) -> Matrix:
        return Matrix(self.components[:], self.width)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            return self.components[index[0] * self.width + index[1]]
        return Vector(self.components[index * self.width : (index + 1) * self.width])

    def __setitem__(self, index: Any, value: Any) -> None:
        if isinstance(index, tuple):
            self.components[index[0] * self.width + index[1]] = value
        else:
            self.components[index * self.width : (index + 1) * self.width] = value.components

    def __add__(self, other: Any) -> Matrix:
        return Matrix(list(map(add, self.components, other.components)), self.width)

    def __sub__(self, other: Any) -> Matrix:
        return Matrix(list(map(sub, self.components, other.components)), self.width)

    def __neg__(self) -> Matrix:
        return Matrix(list(map(neg, self.components)), self.width)

    def __truediv__(self, divisor: Any) -> Matrix:
        return Matrix([x / divisor for x in self.components], self.width)

    def __rmul__(self, factor: Any) -> Matrix:
        return Matrix([factor * x for x in self.components], self.width)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Matrix):
            columns = [other.components[j :: other.width] for j in range(other.width)]
            found = [_dot(row, column) for row in self.rows() for column in columns]
            return Matrix(found, other.width)
        if isinstance(other, Vector):
            return Vector([_dot(row, other.components) for row in self.rows()])
        return Matrix([x * other for x in self.components], self.width)

    def rows(self) -> Iterator[list[Any]]:
        """Yield the rows, as lists."""
        for start in range(0, len(self.components), self.width):
            yield self.components[start : start + self.width]


class Struct:
    """A struct of Warp: attributes."""

    def copy(self) -> Any:
        out = type(self).__new__(type(self))
        for name, value in vars(self).items():
            setattr(out, name, _copied(value))
        return out


class Rows:
    """An array of structs or vectors, of which each run has its own, or all the same."""

    def __init__(self, shape: tuple[int, ...], row: Callable[[Any], Any]) -> None:
        self.shape, self._row = shape, row

    def __getitem__(self, index: Any) -> Any:
        return self._row(index)


def _dot(a: list[Any], b: list[Any]) -> Any:
    out = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        out = out + x * y
    return out


def _copied(value: Any) -> Any:
    """Return a copy of what can be changed in place; Warp assigns values."""
    return value.copy() if isinstance(value, (Vector, Struct)) else value


def _cross(a: Vector, b: Vector) -> Vector:
    ax, ay, az = a.components
    bx, by, bz = b.components
    return Vector([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _quat_rotate(q: Quaternion, v: Vector) -> Vector:
    x, y, z, w = q.components
    along = Vector([x, y, z])
    turned = _cross(along, v)
    return v * (2.0 * w * w - 1.0) + turned * (2.0 * w) + along * (2.0 * _of_dot(along, v))


def _quat_inverse(q: Quaternion) -> Quaternion:
    x, y, z, w = q.components
    return Quaternion([-x, -y, -z, w])


def _of_dot(a: Vector, b: Vector) -> Any:
    return _dot(a.components, b.components)


def _norm(a: Vector) -> Any:
    return np.sqrt(_of_dot(a, a))


def _normalize(a: Vector) -> Any:
    size = _norm(a)
    return a * np.where(size > 0.0, 1.0 / size, 0.0)[()]


def _outer(a: Vector, b: Vector) -> Matrix:
    return Matrix([x * y for x in a.components for y in b.components], len(b.components))


def _transpose(m: Matrix) -> Matrix:
    columns = [m.components[j :: m.width] for j in range(m.width)]
    return Matrix([x for column in columns for x in column], len(m.components) // m.width)


def _least(a: Any, b: Any) -> Any:
    return min(a, b) if isinstance(a, int) and isinstance(b, int) else np.minimum(a, b)


def _most(a: Any, b: Any) -> Any:
    return max(a, b) if isinstance(a, int) and isinstance(b, int) else np.maximum(a, b)


def _where(condition: Any, x: Any, y: Any) -> Any:
    if np.ndim(condition) == 0:
        return x if condition else y
    return np.where(condition, x, y)


def _whole(x: Any) -> Any:
    return x.astype(np.int64) if np.ndim(x) else int(x)


_BUILTINS: dict[str, Any] = {
    "abs": np.abs,
    "acos": np.arccos,
    "asin": np.arcsin,
    "atan": np.arctan,
    "atan2": np.arctan2,
    "ceil": np.ceil,
    "clamp": np.clip,
    "cos": np.cos,
    "cross": _cross,
    "cw_mul": lambda a, b: Vector(list(map(mul, a.components, b.components))),
    "cw_div": lambda a, b: Vector(list(map(truediv, a.components, b.components))),
    "dot": _of_dot,
    "exp": np.exp,
    "floor": np.floor,
    "int32": _whole,
    "length": _norm,
    "length_sq": lambda a: _of_dot(a, a),
    "log": np.log,
    "max": _most,
    "min": _least,
    "normalize": _normalize,
    "outer": _outer,
    "pow": np.power,
    "quat_inverse": _quat_inverse,
    "quat_rotate": _quat_rotate,
    "quat_rotate_inv": lambda q, v: _quat_rotate(_quat_inverse(q), v),
    "sign": np.sign,
    "sin": np.sin,
    "sqrt": np.sqrt,
    "static": lambda value: value,
    "tan": np.tan,
    "tanh": np.tanh,
    "transpose": _transpose,
    "where": _where,
}


class _Warp:
    """The module `warp`, as translated functions see it."""

    def __getattr__(self, name: str) -> Any:
        if name in _BUILTINS:
            return _BUILTINS[name]
        return _translated(getattr(wp, name))


class _Namespace:
    """An object whose attributes are translated when they are read."""

    def __init__(self, source: Any) -> None:
        self._source = source

    def __getattr__(self, name: str) -> Any:
        value = _translated(getattr(self._source, name))
        setattr(self, name, value)
        return value


_WARP = _Warp()
_NATIVE = {
    # 2^k for a whole k.
    "two_to": lambda k: np.ldexp(1.0, _whole(k)),
}


class NotInterpreted(Exception):
    """Device code uses what has no translation."""


def _translated(value: Any) -> Any:
    """Return what stands for a value of device code in Python."""
    if value is wp:
        return _WARP
    if isinstance(value, wp.Function):
        return _function(value)
    if isinstance(value, wp._src.codegen.Struct):
        return _struct(value)
    if isinstance(value, type):
        return _type(value)
    if isinstance(value, (wp.float64, wp.float32)):
        return np.float64(value.value)
    if isinstance(value, SimpleNamespace) or (is_dataclass(value) and not callable(value)):
        return _Namespace(value)
    if isinstance(value, (ModuleType, bool, int, float, str, tuple, type(None))) or callable(value):
        return value
    raise NotInterpreted(f"{type(value).__name__}")


def _type(kind: type) -> Any:
    if kind in (wp.float64, wp.float32):
        return _number
    if kind is wp.int32:
        return _whole
    shape = getattr(kind, "_shape_", None)
    if shape is None:
        return kind
    if wp.types.type_is_quaternion(kind):
        return _maker(Quaternion, shape[0])
    if len(shape) == 1:
        return _maker(Vector, shape[0])
    return _maker(lambda entries: Matrix(entries, shape[1]), shape[0] * shape[1])


def _number(x: Any) -> Any:
    return x if isinstance(x, np.ndarray) else np.float64(x)


def _maker(kind: Callable[[list[Any]], Any], size: int) -> Callable[..., Any]:
    zero = np.float64(0.0)

    def make(*entries: Any) -> Any:
        if not entries:
            return kind([zero] * size)
        if len(entries) == size:
            return kind(list(entries))
        if len(entries) == 1:
            one = entries[0]
            return kind(one.components[:] if isinstance(one, Vector) else [one] * size)
        raise NotInterpreted("a vector of vectors")

    return make


@cache
def _struct(struct: Any) -> Callable[[], Struct]:
    """Return the maker of empty structs."""
    kind = type(struct.key, (Struct,), {})
    makers = {name: _empty(variable.type) for name, variable in struct.vars.items()}

    def make() -> Struct:
        out = kind()
        for name, maker in makers.items():
            setattr(out, name, maker())
        return out

    return make


def struct_from(struct: Any, row: Any) -> Struct:
    """Return a struct with the numbers of a row of a structured array, or of several rows."""
    out = _struct(struct)()
    for name in row.dtype.names:
        value, held = row[name], getattr(out, name)
        if isinstance(held, Vector):
            entries = len(held.components)
            held.components = list(value.reshape(*row.shape, entries).T)
        else:
            setattr(out, name, value)
    return out


def vector_rows(table: np.ndarray) -> Rows:
    """Return a table (rows, terms, functions) as an array of vectors."""
    return Rows(table.shape[:2], lambda index: Vector(list(table[index].T)))


def _empty(kind: Any) -> Callable[[], Any]:
    """Return the maker of a field that nothing was assigned to."""
    if isinstance(kind, wp._src.codegen.Struct):
        return _struct(kind)
    if getattr(kind, "_shape_", None) is not None:
        return _type(kind)
    zero = np.float64(0.0) if kind in (wp.float64, wp.float32) else 0
    return lambda: zero


@cache
def interpreted(function: Any) -> Callable[..., Any]:
    """Return a device function, or a kernel, as a function of Python.

    A kernel's has the index of its thread in front of its arguments: a number, or an array of the
    runs that are computed at once. Raises NotInterpreted for code that has no translation.
    """
    if isinstance(function, wp.Kernel):
        return _compiled(function.func, thread=True)
    return _function(function)


@cache
def _function(function: Any) -> Callable[..., Any]:
    name = function.func.__name__ if function.func else function.key
    if function.native_snippet is not None:
        if name not in _NATIVE:
            raise NotInterpreted(name)
        return _NATIVE[name]
    if function.func is None:
        raise NotInterpreted(name)
    return _compiled(function.func, thread=False)


def _compiled(function: Any, thread: bool) -> Callable[..., Any]:
    """Return a function of Python from the source of a device function."""
    code = _code(function.__code__, thread)
    cells = (cell.cell_contents for cell in function.__closure__ or ())
    enclosed = dict(zip(function.__code__.co_freevars, cells, strict=True))
    names = function.__globals__ | enclosed
    scope = {"__builtins__": _PYTHON, **_OPERATORS}
    scope |= {name: _translated(names[name]) for name in code.read if name in names}
    exec(code.binary, scope)
    found: Callable[..., Any] = scope[function.__name__]
    return found


def _quotient(a: Any, b: Any) -> Any:
    """Whole numbers divide to whole numbers, towards zero."""
    if _is_whole(a) and _is_whole(b):
        return int(a / b) if np.ndim(a) == np.ndim(b) == 0 else np.trunc(a / b).astype(int)
    return a / b


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) or getattr(getattr(value, "dtype", None), "kind", "") == "i"


_PYTHON = {"range": range, "len": len, "int": _whole, "float": _number, "bool": bool}
_OPERATORS = {"_copied": _copied, "_quotient": _quotient, "_remainder": np.fmod}


@cache
def _code(source: Any, thread: bool) -> SimpleNamespace:
    tree = ast.parse(textwrap.dedent(inspect.getsource(source)))
    definition = next(node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))
    found = _Assigning(definition).of(thread)
    module = ast.fix_missing_locations(ast.Module([found], []))
    read = {node.id for node in ast.walk(module) if isinstance(node, ast.Name)}
    return SimpleNamespace(binary=compile(module, source.co_filename, "exec"), read=read)


class _Assigning(ast.NodeTransformer):
    """Give assignments of Python the meaning that they have on a device: values are copied."""

    def __init__(self, definition: ast.FunctionDef) -> None:
        self._definition = definition
        self._changed = set()
        for node in ast.walk(definition):
            stored = getattr(node, "ctx", None)
            if isinstance(node, (ast.Attribute, ast.Subscript)) and isinstance(stored, ast.Store):
                self._changed.add(_root(node))
        self._parameters = {each.arg for each in definition.args.args}

    def of(self, thread: bool) -> ast.FunctionDef:
        """Return the function, its parameters copied where it changes them."""
        definition = self._definition
        definition.decorator_list = []
        definition.returns = None
        for each in definition.args.args:
            each.annotation = None
        own = self._parameters & self._changed
        body = [self.visit(line) for line in definition.body]
        copies = [
            ast.Assign([ast.Name(name, ast.Store())], _copy(ast.Name(name, ast.Load())))
            for name in sorted(own)
        ]
        definition.body = [*copies, *body]
        if thread:
            definition.args.args.insert(0, ast.arg("_thread"))
        return definition

    def visit_Assign(self, node: ast.Assign) -> Any:
        self.generic_visit(node)
        (target,) = node.targets
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = zip(target.elts, node.value.elts, strict=True)
            node.value.elts = [self._value(where, value) for where, value in pairs]
        else:
            node.value = self._value(target, node.value)
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> Any:
        before = ast.parse(ast.unparse(node.target), mode="eval").body
        value = ast.BinOp(before, node.op, node.value)
        return ast.Assign([node.target], self.visit(value))

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        self.generic_visit(node)
        name = {ast.Div: "_quotient", ast.Mod: "_remainder"}.get(type(node.op))
        return _call(name, node.left, node.right) if name else node

    def visit_Return(self, node: ast.Return) -> Any:
        self.generic_visit(node)
        value = node.value
        given = isinstance(value, ast.Name) and value.id in self._parameters - self._changed
        if isinstance(value, ast.Attribute) or given:
            node.value = _copy(value)
        return node

    def visit_Call(self, node: ast.Call) -> Any:
        self.generic_visit(node)
        if isinstance(node.func, ast.Attribute) and node.func.attr == "tid":
            return ast.Name("_thread", ast.Load())
        return node

    def _value(self, target: ast.expr, value: ast.expr) -> ast.expr:
        if not isinstance(value, (ast.Name, ast.Attribute, ast.Subscript)):
            return value
        held = not isinstance(target, ast.Name) or target.id in self._changed
        return _copy(value) if held or _root(value) in self._changed else value


def _root(node: ast.AST) -> str:
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def _copy(value: Any) -> ast.Call:
    return _call("_copied", value)


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])
