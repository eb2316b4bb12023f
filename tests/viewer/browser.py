"""A real browser without a display: it notes what a page says and asks for, and takes pictures."""

from __future__ import annotations

import base64
import itertools
import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path
from typing import Any, Self

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
ARGUMENTS = (
    "--headless=new", "--no-sandbox", "--no-first-run", "--disable-sync", "--disable-quic",
    "--disable-background-networking", "--disable-component-update", "--mute-audio",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
    "--remote-debugging-port=0", "--window-size=1280,800", "--hide-scrollbars",
)  # fmt: skip
PATIENCE = 90.0


class Browser:
    """Chromium at one page, driven through its DevTools."""

    def __init__(self, profile: Path) -> None:
        from websockets.sync.client import connect

        assert CHROMIUM is not None
        command = [CHROMIUM, *ARGUMENTS, f"--user-data-dir={profile}", "about:blank"]
        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        port = self._port(profile / "DevToolsActivePort")
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json") as answer:
            pages = json.load(answer)
        page = next(each for each in pages if each["type"] == "page")
        self._socket = connect(page["webSocketDebuggerUrl"], max_size=2**27)
        self._count = itertools.count(1)
        self.errors: list[str] = []
        self.requests: list[str] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._ask(f"{domain}.enable")
        # Workers too: they wait until what they ask for is noted.
        self._ask(
            "Target.setAutoAttach", autoAttach=True, waitForDebuggerOnStart=True, flatten=True
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(timeout=PATIENCE)

    def open(self, url: str) -> None:
        """Go to a page."""
        self._ask("Page.navigate", url=url)

    def evaluate(self, script: str) -> Any:
        """The value of a script in the page."""
        answer = self._ask("Runtime.evaluate", expression=script, returnByValue=True)
        return answer["result"].get("value")

    def wait_until(self, script: str) -> None:
        """Wait until a script is true."""
        end = time.monotonic() + PATIENCE
        while not self.evaluate(script):
            assert time.monotonic() < end, f"never came: {script}; {self.errors}"
            time.sleep(0.1)

    def picture(self, path: Path) -> bytes:
        """Save the page as it is drawn."""
        data = self._ask("Page.captureScreenshot", format="png")["data"]
        path.write_bytes(base64.b64decode(data))
        return path.read_bytes()

    def press_end(self, element: str) -> None:
        """Give the key End to an element, named by a script."""
        self.evaluate(f"{element}.focus()")
        key = {"key": "End", "code": "End", "windowsVirtualKeyCode": 35}
        for kind in ("keyDown", "keyUp"):
            self._ask("Input.dispatchKeyEvent", type=kind, **key)

    def _ask(self, method: str, **params: Any) -> Any:
        number = next(self._count)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            message = json.loads(self._socket.recv(timeout=PATIENCE))
            if message.get("id") == number:
                assert "error" not in message, message
                return message["result"]
            self._note(message.get("method"), message.get("params", {}))

    def _tell(self, session: str, method: str) -> None:
        self._socket.send(
            json.dumps({"id": next(self._count), "sessionId": session, "method": method})
        )

    def _note(self, what: str | None, told: dict[str, Any]) -> None:
        if what == "Target.attachedToTarget":
            for method in ("Network.enable", "Runtime.enable", "Runtime.runIfWaitingForDebugger"):
                self._tell(told["sessionId"], method)
        elif what == "Runtime.exceptionThrown":
            self.errors.append(str(told["exceptionDetails"]))
        elif what == "Runtime.consoleAPICalled" and told["type"] == "error":
            self.errors.append(str(told["args"]))
        elif what == "Log.entryAdded" and told["entry"]["level"] == "error":
            self.errors.append(str(told["entry"]))
        elif what == "Network.requestWillBeSent":
            self.requests.append(told["request"]["url"])
        elif what == "Network.webSocketCreated":
            self.requests.append(told["url"])

    def _port(self, file: Path) -> int:
        end = time.monotonic() + PATIENCE
        while not (file.exists() and "\n" in file.read_text()):
            assert time.monotonic() < end, "the browser does not start"
            time.sleep(0.05)
        return int(file.read_text().splitlines()[0])
