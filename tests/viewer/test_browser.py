"""In a real browser a flight moves, nothing is fetched from elsewhere, and nothing is amiss."""

from __future__ import annotations

import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest

import continuair as ca
from continuair.viewer.export import write_page
from continuair.viewer.player import Player
from continuair.viewer.scene import scene
from tests.viewer.browser import CHROMIUM, PATIENCE, Browser
from tests.viewer.flights import swing, watching

pytest.importorskip("viser")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium"),
]

_TIME = "document.querySelector('[role=slider]').getAttribute('aria-valuenow')"


def settled(browser: Browser, at: Path) -> bytes:
    """A picture of a page that has come to rest."""
    end, before = time.monotonic() + PATIENCE, b""
    while (now := browser.picture(at)) != before:
        assert time.monotonic() < end, "the picture does not come to rest"
        before = now
        time.sleep(2.0)
    return now


def test_the_slider_moves_the_arm(tmp_path: Path) -> None:
    shown = ca.view(watching(duration=2.0), port=0)
    assert isinstance(shown.player, Player)
    shown.player.playing = False
    shown.player.seek(0.0)
    try:
        with Browser(tmp_path / "profile") as browser:
            browser.open(shown.url)
            browser.wait_until("document.querySelector('canvas') !== null")
            browser.wait_until("document.querySelector('[role=slider]') !== null")
            first = settled(browser, tmp_path / "first.png")
            # As a user's arrow keys do, which the slider tells the server of.
            browser.press_end(_TIME.partition(".getAttribute")[0])
            browser.wait_until(f"{_TIME} === '2'")
            second = settled(browser, tmp_path / "second.png")
            assert first != second
            assert shown.player.shown == len(shown.scene.times) - 1
            assert browser.errors == []
            place = urlsplit(shown.url).netloc
            assert all(is_local(request, place) for request in browser.requests), browser.requests
            assert any(request.startswith("ws:") for request in browser.requests)
    finally:
        shown.stop()


def test_a_page_plays_without_a_server(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    write_page(scene(swing(duration=2.0)), page, "swing")
    with Browser(tmp_path / "profile") as browser:
        browser.open(page.as_uri())
        browser.wait_until("document.querySelector('canvas') !== null")
        first = browser.picture(tmp_path / "first.png")
        end = time.monotonic() + PATIENCE
        while browser.picture(tmp_path / "later.png") == first:
            assert time.monotonic() < end
        assert browser.errors == []
        assert all(is_local(request, "") for request in browser.requests), browser.requests


def is_local(request: str, place: str) -> bool:
    """Tell whether a request stays in the browser, or goes to our server."""
    parts = urlsplit(request)
    return parts.scheme in ("data", "blob", "file") or (parts.netloc == place != "")
