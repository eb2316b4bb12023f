"""What an interface needs and is not installed is told in a sentence."""

import sys

import pytest

import continuair as ca
from continuair import InputError


def test_casadi_that_is_missing_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(InputError, match=r"pip install 'continuair\[mpc\]'"):
        ca.to_casadi(ca.load_vehicle("paper"))
