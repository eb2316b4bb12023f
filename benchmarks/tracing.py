"""The rate of the coupled model as straight-line C, traced from the kernels' own source.

Runs the source on the numbers of benchmarks/counting.py, whose record of distinct operations is a
program: one line of C each. Prints JSON with the lines, and the expressions of the 17 rates, in
terms of y[17] (state), c[...] (moment polynomials, term by term) and p[...] (vehicle, push and
gravity).
"""

from __future__ import annotations

import json
import sys
from typing import Any

import counting
import numpy as np

SIGNS = {"add": "+", "mul": "*", "div": "/"}


def trace(model: str) -> dict[str, Any]:
    from continuair.engine.moments import TERMS

    from continuair.device.numbers import Numbers
    from continuair.device.types import MOMENTS, device_types
    from continuair.engine.pack import tree_of
    from continuair.kernels.dynamics import dynamics_code
    from continuair.kernels.flight import flight_code
    from continuair.vehicle.layout import COMMAND
    from continuair.vehicle.vehicle import load_vehicle

    of, functions = (Numbers("float64"), tree_of(load_vehicle("paper"))), len(MOMENTS)
    code, flight = device_types(*of), flight_code(*of).Flight()
    rate_of = dynamics_code(*of, model).rate_of
    names: dict[int, str] = {}

    def leaf(name: str, value: float = 0.5) -> counting.Number:
        made = counting.number(value)
        names[made.identity] = name
        return made

    y = code.State(*(leaf(f"y[{i}]") for i in range(17)))
    rows = [
        code.Row(*(leaf(f"c[{functions * i + j}]", 0.1 + j) for j in range(functions)))
        for i in range(TERMS)
    ]
    plant, order = code.Plant(), []
    for name, of in code.Plant.fields.items():
        entries = []
        for k in range(1 if of is counting.Number else len(of().entries)):
            entries.append(leaf(f"p[{len(order)}]", 1.0 + k))
            order.append((name, k))
        setattr(plant, name, entries[0] if of is counting.Number else of(*entries))
    first = len(order)
    push = code.Push(*(leaf(f"p[{first + i}]") for i in range(8)))
    gravity = leaf(f"p[{first + 8}]", 9.81)

    class Rows:
        shape = (1, TERMS)

        def __getitem__(self, index: tuple[int, int]) -> Any:
            return rows[index[1]]

    # A command needs no inputs; the frozen state belongs to the independent model.
    flight.plant, flight.coefficients, flight.gravity = plant, Rows(), gravity
    flight.groups = COMMAND
    rate = rate_of(y, code.Along(), flight, 0, push)
    known = counting.TALLY.known
    lines = []
    for key, identity in known.items():
        if isinstance(key, tuple) and key[0] in SIGNS:
            a, b = (_written(operand, names) for operand in key[1:])
            lines.append(f"V t{identity} = {a} {SIGNS[key[0]]} {b};")
    rates = [_written(n.identity or f"literal {n.value}", names) for n in rate.entries]
    return {"lines": lines, "rates": rates, "plant": order}


def _written(operand: Any, names: dict[int, str]) -> str:
    if isinstance(operand, str):
        return f"({operand.removeprefix('literal ')})"
    text = names.get(abs(operand), f"t{abs(operand)}")
    return text if operand > 0 else f"(-{text})"


if __name__ == "__main__":
    sys.modules["warp"] = counting.stand_in()
    np.seterr(all="raise")
    print(json.dumps(trace(sys.argv[1])))
