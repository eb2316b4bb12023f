"""What an interface needs and is not installed is told in a sentence."""

import sys
from pathlib import Path

import pytest

import continuair as ca
from continuair import InputError
from tests.interfaces.flights import flight


def test_casadi_that_is_missing_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(InputError, match=r"pip install 'continuair\[mpc\]'"):
        ca.to_casadi(ca.load_vehicle("paper"))


def test_mcap_that_is_missing_is_named_with_its_extra(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(InputError, match=r"pip install 'continuair\[mcap\]'"):
        ca.to_mcap(flight("paper"), tmp_path / "flight.mcap")
    assert not list(tmp_path.iterdir())
