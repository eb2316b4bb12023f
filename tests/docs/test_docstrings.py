"""The examples in public docstrings say what comes out."""

import doctest

import numpy as np
import pytest

import continuair as ca

PUBLIC = {
    **{f"ca.{name}": getattr(ca, name) for name in ca.__all__},
    **{f"ca.equations.{name}": getattr(ca.equations, name) for name in ca.equations.__all__},
    **{f"ca.paths.{name}": value for name, value in vars(ca.paths).items() if callable(value)},
}
EXAMPLES = [
    example
    for name, value in PUBLIC.items()
    if getattr(value, "__module__", "").startswith("continuair")
    for example in doctest.DocTestFinder().find(value, name, globs={"ca": ca, "np": np})
    if example.examples
]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_an_example_prints_what_stands_below_it(example: doctest.DocTest) -> None:
    told: list[str] = []
    assert not doctest.DocTestRunner().run(example, out=told.append).failed, "".join(told)


def test_there_are_examples() -> None:
    assert {example.name for example in EXAMPLES} >= {"ca.load_vehicle", "ca.Vehicle.replace"}
