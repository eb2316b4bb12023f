"""Count the arithmetic of a step of the roll-out kernels: run their own source on counting numbers.

Stands in for the module `warp` in a process of its own, so that the functions in
src/continuair/kernels, unchanged, run as plain Python: those of single runs, on a vehicle with one
section. Every number knows which operation on which
numbers it came from: operations on literals alone are the compiler's and not counted, and a second
operation on the same operands is counted as written but not as distinct, and neither is one that
nothing kept in memory follows from: what remains once common subexpressions are merged and dead
code is gone. Prints JSON: python benchmarks/counting.py MODEL
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from bisect import bisect_left
from collections import Counter
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

STEP = 1e-4
"""Of the flight that is counted [s]."""

FLOPS = ("add", "mul", "div", "sqrt")
"""Counted as one floating-point operation each; sign changes and comparisons as none."""


class Tally:
    """Operations as written, the distinct among them, and loads.

    loads: of each number, how many operations there were before each of its loads. kept: what is
    written to memory, chosen from or decides on a branch.
    """

    def __init__(self) -> None:
        self.written: Counter[str] = Counter()
        self.distinct: Counter[str] = Counter()
        self.loads: dict[int, list[int]] = {}
        self.kept: set[int] = set()
        self.known: dict[Any, int] = {}

    def note(self, operation: str, operands: tuple[int, ...]) -> int:
        self.written[operation] += 1
        key = (operation, *operands)
        if key not in self.known:
            self.distinct[operation] += 1
            self.known[key] = len(self.known) + 1
        return self.known[key]

    def keep(self, *values: Any) -> None:
        self.kept |= {abs(value.identity) for value in values if isinstance(value, Number)}

    def load(self, value: Number) -> None:
        self.loads.setdefault(value.identity, []).append(len(self.known))

    def needed(self) -> tuple[Counter[str], int]:
        """Distinct operations, and loads, that something kept follows from."""
        made_by = {made: key for key, made in self.known.items() if isinstance(key, tuple)}
        found, used, waiting = set[int](), set[tuple[int, int]](), list(self.kept)
        while waiting:
            one = waiting.pop()
            if one in found or one not in made_by:
                continue
            found.add(one)
            for each in made_by[one][1:]:
                if isinstance(each, int):
                    waiting.append(abs(each))
                    # The last load before it is the one that it takes.
                    used.add((abs(each), bisect_left(self.loads.get(abs(each), []), one)))
        operations = Counter(made_by[one][0] for one in found)
        return operations, sum(which > 0 for _, which in used)


TALLY = Tally()


class Number:
    """A float with an identity; 0 is that of literals."""

    __slots__ = ("value", "identity")

    def __init__(self, value: Any, identity: int = 0) -> None:
        if isinstance(value, Number):  # a cast to the same precision
            value, identity = value.value, value.identity
        self.value, self.identity = float(value), identity

    def _combine(self, kind: str, value: float, *others: Number, sort: bool = False) -> Number:
        operands = (self, *others)
        if not any(number.identity for number in operands):
            return Number(value)
        # Literals have no identity of their own; their value stands for it.
        keys = [n.identity or f"literal {n.value}" for n in operands]
        if sort:
            keys.sort(key=str)
        return Number(value, TALLY.note(kind, tuple(keys)))  # type: ignore[arg-type]

    def __add__(self, other: Number) -> Number:
        return self._combine("add", self.value + other.value, other, sort=True)

    def __sub__(self, other: Number) -> Number:
        return self + -other

    def __neg__(self) -> Number:
        # The sign is part of the identity, and costs nothing in a sum.
        return Number(-self.value, -self.identity)

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, Number):
            return NotImplemented
        sign = (-1 if self.identity < 0 else 1) * (-1 if other.identity < 0 else 1)
        a, b = (-n if n.identity < 0 else n for n in (self, other))
        out = a._combine("mul", a.value * b.value, b, sort=True)
        return out if sign > 0 else -out

    def __truediv__(self, other: Number) -> Number:
        return self._combine("div", self.value / other.value, other)

    def __int__(self) -> int:
        return int(self.value)

    def __lt__(self, other: Number) -> bool:
        return self._compared(self.value < other.value, other)

    def __gt__(self, other: Number) -> bool:
        return self._compared(self.value > other.value, other)

    def __ge__(self, other: Number) -> bool:
        return self._compared(self.value >= other.value, other)

    def __eq__(self, other: object) -> bool:
        assert isinstance(other, Number)
        return self._compared(self.value == other.value, other)

    __hash__ = None  # type: ignore[assignment]

    def _compared(self, result: bool, other: Number) -> bool:
        TALLY.written["compare"] += 1
        TALLY.keep(self, other)
        return result


def function_of(kind: str, function: Any) -> Any:
    return lambda x: x._combine(kind, function(x.value))


NATIVE = {"two_to": function_of("shift", lambda k: 2.0**k)}
"""What the kernels write in C++, by name."""


class Vector:
    """A vector, quaternion or matrix of numbers, by value as in Warp."""

    shape: tuple[int, ...]

    def __init__(self, *entries: Any) -> None:
        size = math.prod(self.shape)
        self.entries = list(entries) or [Number(0.0) for _ in range(size)]
        assert len(self.entries) == size

    def _at(self, index: Any) -> int:
        return index[0] * self.shape[1] + index[1] if isinstance(index, tuple) else index

    def __getitem__(self, index: Any) -> Number:
        return self.entries[self._at(index)]

    def __setitem__(self, index: Any, value: Number) -> None:
        self.entries[self._at(index)] = value

    def __add__(self, other: Vector) -> Vector:
        return type(self)(*(a + b for a, b in zip(self.entries, other.entries, strict=True)))

    def __sub__(self, other: Vector) -> Vector:
        return type(self)(*(a - b for a, b in zip(self.entries, other.entries, strict=True)))

    def __neg__(self) -> Vector:
        return type(self)(*(-a for a in self.entries))

    def __mul__(self, other: Any) -> Vector:
        if isinstance(other, Number):
            return type(self)(*(a * other for a in self.entries))
        return times(self, other)

    def __rmul__(self, scale: Number) -> Vector:
        return self * scale

    def __truediv__(self, other: Number) -> Vector:
        return type(self)(*(a / other for a in self.entries))


class Quaternion(Vector):
    """x, y, z, w."""

    shape = (4,)


def vector(length: int, _: type) -> type[Vector]:
    return type(f"Vector{length}", (Vector,), {"shape": (length,)})


def matrix(shape: tuple[int, int], _: type) -> type[Vector]:
    return type("Matrix", (Vector,), {"shape": shape})


def times(a: Vector, b: Vector) -> Vector:
    """Matrix times vector, or the product of quaternions."""
    if isinstance(a, Quaternion):
        (x, y, z, w), (p, q, r, s) = a.entries, b.entries
        return Quaternion(
            w * p + x * s + y * r - q * z,
            w * q + y * s + z * p - r * x,
            w * r + z * s + x * q - p * y,
            w * s - x * p - y * q - z * r,
        )
    width = a.shape[1]
    rows = [a.entries[i : i + width] for i in range(0, len(a.entries), width)]
    return type(b)(*(total([m * x for m, x in zip(row, b.entries, strict=True)]) for row in rows))


def total(numbers: list[Number]) -> Number:
    out = numbers[0]
    for number in numbers[1:]:
        out = out + number
    return out


def dot(a: Vector, b: Vector) -> Number:
    return total([x * y for x, y in zip(a.entries, b.entries, strict=True)])


def cross(a: Vector, b: Vector) -> Vector:
    (x, y, z), (p, q, r) = a.entries, b.entries
    return type(a)(y * r - z * q, z * p - x * r, x * q - y * p)


def outer(a: Vector, b: Vector) -> Vector:
    return MATRIX(*(x * y for x in a.entries for y in b.entries))


def inverse(m: Vector) -> Vector:
    # Only before the first step, whose operations nobody counts.
    found = np.linalg.inv(np.reshape([x.value for x in m.entries], m.shape))
    return MATRIX(*(number(x) for x in found.ravel()))


def quat_rotate(q: Vector, v: Vector, sign: int = 1) -> Vector:
    """As in Warp's quat.h."""
    x, y, z, w = q.entries
    one, two = Number(1.0), Number(2.0)
    c = two * w * w - one
    d = two * (x * v[0] + y * v[1] + z * v[2])
    turned = [
        (y * v[2] - z * v[1]) * w * two,
        (z * v[0] - x * v[2]) * w * two,
        (x * v[1] - y * v[0]) * w * two,
    ]
    out = []
    for i, part in enumerate(turned):
        moved = v[i] * c + q[i] * d
        out.append(moved + part if sign > 0 else moved - part)
    return type(v)(*out)


MATRIX = matrix((3, 3), Number)


def number(value: Any) -> Number:
    """A number that is no literal."""
    TALLY.known[object()] = identity = len(TALLY.known) + 1
    return Number(value, identity)


class Struct:
    """A Warp struct; one is a copy of another's fields if it is made with it."""

    fields: dict[str, Any]

    def __init__(self, other: Struct | None = None) -> None:
        for name, of in self.fields.items():
            empty = of(0.0) if of is Number else of()
            setattr(self, name, empty if other is None else by_value(getattr(other, name)))


def by_value(value: Any) -> Any:
    """A value that can be changed without the one it came from."""
    if isinstance(value, Vector):
        return type(value)(*value.entries)
    return type(value)(value) if isinstance(value, Struct) else value


def struct(kind: type) -> type:
    """Fields of a Warp struct: zero by default, and a NumPy type for packing."""
    fields = dict(kind.__annotations__)

    def numpy_dtype() -> dict[str, list[str]]:
        shapes = [() if of is Number else of.shape for of in fields.values()]
        return {"names": list(fields), "formats": [f"{shape}<f8" for shape in shapes]}

    parts = {"fields": fields, "numpy_dtype": staticmethod(numpy_dtype)}
    return type(kind.__name__, (Struct,), parts)


def function(body: Any) -> Any:
    """A Warp function takes its arguments by value."""

    def called(*arguments: Any) -> Any:
        return body(*map(by_value, arguments))

    return called


class Array:
    """Device memory: what is read from it counts as loaded, every number anew."""

    def __init__(self, values: np.ndarray, of: Any = Number) -> None:
        self.values, self.of = values, of
        self.shape = values.shape
        self.identities: dict[Any, Any] = {}

    def __getitem__(self, index: Any) -> Any:
        if self.of is int:
            return int(self.values[index])
        if index not in self.identities:
            self.identities[index] = self._made(self.values[index])
        found = self.identities[index]
        # Structs are of whole flights; nothing loads them in a step.
        for each in found.entries if isinstance(found, Vector) else [found]:
            if isinstance(each, Number):
                TALLY.load(each)
        return found

    def _made(self, value: Any) -> Any:
        if self.of is Number:
            return number(value)
        if not hasattr(self.of, "fields"):
            return self.of(*map(number, np.ravel(value)))
        out = self.of()
        for name, of in self.of.fields.items():
            entries = [number(x) for x in np.ravel(value[name])]
            setattr(out, name, entries[0] if of is Number else of(*entries))
        return out

    def __setitem__(self, index: Any, value: Any) -> None:
        TALLY.keep(value)
        self.values[index] = value.value if isinstance(value, Number) else value


def stand_in() -> ModuleType:
    """The part of Warp's interface that the kernels use."""

    def of_length(v: Vector) -> Number:
        return function_of("sqrt", math.sqrt)(dot(v, v))

    def pick(better: Any) -> Any:
        def choose(a: Any, b: Any) -> Any:
            if isinstance(a, Number):
                TALLY.written["compare"] += 1
                TALLY.keep(a, b)
                return a if better(a.value, b.value) == a.value else b
            return better(a, b)

        return choose

    def where(chosen: bool, a: Any, b: Any) -> Any:
        TALLY.keep(a, b)
        return a if chosen else b

    module = ModuleType("warp")
    module.__dict__.update(
        float64=Number,
        int32=int,
        bool=bool,
        types=SimpleNamespace(vector=vector, matrix=matrix, quaternion=lambda _: Quaternion),
        struct=struct,
        func=function,
        func_native=lambda _: lambda declared: NATIVE[declared.__name__],
        Function=object,
        Kernel=object,
        kernel=lambda **_: lambda body: body,
        static=lambda value: value,
        tid=lambda: 0,
        nan=math.nan,
        inf=math.inf,
        dot=dot,
        cross=cross,
        outer=outer,
        inverse=inverse,
        length_sq=lambda v: dot(v, v),
        length=of_length,
        quat_rotate=quat_rotate,
        quat_rotate_inv=lambda q, v: quat_rotate(q, v, -1),
        sqrt=function_of("sqrt", math.sqrt),
        floor=function_of("floor", math.floor),
        abs=function_of("abs", abs),
        where=where,
        min=pick(min),
        max=pick(max),
        **{name: lambda **_: object for name in ("array", "array2d", "array3d")},
    )
    return module


def known_kernels() -> dict[str, tuple[int, int]]:
    """(counted, known) operations of arithmetic that can be counted by hand."""
    three = vector(3, Number)

    def fresh(kind: Any) -> Any:
        return kind(*(number(i + 1.0) for i in range(math.prod(kind.shape))))

    def counted(body: Any) -> int:
        before = sum(TALLY.distinct[name] for name in FLOPS)
        body()
        return sum(TALLY.distinct[name] for name in FLOPS) - before

    def horner() -> None:
        x, out = number(0.5), number(1.0)
        for _ in range(16):
            out = out * x + number(1.0)

    a, b, row = fresh(three), fresh(three), Array(np.arange(1.0, 4.0))
    _, read = row[0] * row[1], row[1] + row[2]
    TALLY.keep(read)
    operations, loads = TALLY.needed()
    return {
        "a sum, and a product that nobody reads": (operations.total(), 1),
        "numbers loaded for that sum": (loads, 2),
        "matrix times vector (9 products, 6 sums)": (
            counted(lambda: fresh(MATRIX) * fresh(three)),
            15,
        ),
        "cross product (6 products, 3 differences)": (counted(lambda: cross(a, b)), 9),
        "the same once more (nothing new)": (counted(lambda: cross(a, b)), 0),
        "Horner's rule, 16 terms": (counted(horner), 32),
        "quaternion product (16 products, 12 sums)": (
            counted(lambda: fresh(Quaternion) * fresh(Quaternion)),
            28,
        ),
    }


def fly(model: str, steps: int) -> tuple[Tally, np.ndarray]:
    """Take steps of the benchmark's free flight from a fresh tally; return it and the state."""
    global TALLY
    TALLY = Tally()
    import continuair as ca
    from continuair.device.arguments import arguments
    from continuair.device.numbers import Numbers
    from continuair.engine.pack import tree_of
    from continuair.kernels.dynamics import dynamics_code
    from continuair.kernels.logs import state_logger
    from continuair.kernels.rollout import rollout_kernel
    from continuair.kernels.sensing.pilot import no_pilot
    from continuair.vehicle.coordinates import branches_of, state_from_paper
    from continuair.vehicle.layout import GENERAL

    numbers, vehicle = Numbers("float64"), ca.load_vehicle("paper")
    of = numbers, tree_of(vehicle)
    layout, begins, pilot = of[1].layout, arguments(numbers.precision), no_pilot(*of)
    q, qd = np.array([[0, 0, 5, 0, 0, 0, 0.1, 0]]), np.array([[0, 0, 0, 0.1, 0.1, 0.1, 0, 0]])
    states = Array(state_from_paper(q, qd, layout)[:, None])
    inputs = np.zeros((1, 1, layout.inputs))
    inputs[0, 0, layout.of_input["force"]] = 0.0, 0.0, 9.81 * vehicle.mass
    after = np.full(steps, -1)
    after[-1] = 1
    log, lengths = np.zeros((1, 2, layout.log)), np.full(steps, STEP)
    ends = [*(Array(np.zeros(1, int), int) for _ in range(2)), Array(np.zeros((1, 1)), int)]
    rollout_kernel(*of, dynamics_code(*of, model), pilot, state_logger(*of))(
        packed(vehicle, *of),
        filled(begins.Start, states=states, frozen=states, angle=Array(branches_of(q, layout))),
        filled(begins.Drive, inputs=Array(inputs), groups=GENERAL, gravity=number(9.81)),
        filled(begins.Steps, starts=Array(STEP * np.arange(steps)), lengths=Array(lengths),
               sample_after=Array(after, int)),
        pilot.Loop(),
        Array(log, int),
        *ends,
    )  # fmt: skip
    return TALLY, log[0, 1]


def packed(vehicle: Any, numbers: Any, tree: Any) -> Any:
    """The kernel's struct of a vehicle and its polynomials."""
    from continuair.device.types import device_types
    from continuair.engine.pack import pack_plants, pack_table
    from continuair.kernels.flight import flight_code

    types, structs = device_types(numbers, tree), flight_code(numbers, tree)
    plants, table = pack_plants(vehicle, types.Plant), pack_table(vehicle, 1)
    return filled(
        structs.Vehicles,
        plants=Array(plants, types.Plant),
        coefficients=Array(table, types.Row),
    )


def filled(kind: Any, **fields: Any) -> Any:
    """A struct with those fields."""
    made = kind()
    for name, value in fields.items():
        setattr(made, name, value)
    return made


BEFORE, STEPS = 32, 4
"""Steps that are flown before those that are counted, and of these."""


def counted(model: str) -> dict[str, Any]:
    """What `per_step` finds, from a process of its own, for one that has imported Warp."""
    return dict(json.loads(subprocess.check_output([sys.executable, __file__, model])))


def per_step(model: str) -> dict[str, Any]:
    """Operations of one step: the mean of four, late in a flight."""
    (few, _), (more, _) = fly(model, BEFORE), fly(model, BEFORE + STEPS)
    _, state = fly(model, 3)
    (fewer, little), (most, much) = few.needed(), more.needed()
    written = mean(few.written, more.written, STEPS)
    distinct = mean(fewer, most, STEPS)
    return {
        "model": model,
        "written": written,
        "distinct": distinct,
        "flops": sum(distinct.get(name, 0) for name in FLOPS),
        "flops_written": sum(written.get(name, 0) for name in FLOPS),
        "loads": (much - little) / STEPS,
        "state_after_3_steps": state.tolist(),
    }


def mean(few: Counter[str], more: Counter[str], steps: int) -> dict[str, float]:
    """Of each kind of operation, per step."""
    return {name: (more[name] - few[name]) / steps for name in sorted(more)}


if __name__ == "__main__":
    sys.modules["warp"] = stand_in()
    known = known_kernels()
    assert all(found == right for found, right in known.values()), known
    print(json.dumps({"known": known, **per_step(sys.argv[1])}))
