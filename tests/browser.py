"""A headless Chromium, driven through its DevTools protocol: opens pages, clicks, reads, takes pictures.

Only what the tests of the live page need; the machine must have Chromium (Debian: apt install chromium).
"""

import base64
import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import cv2
import numpy as np
from websockets.sync.client import connect

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome") if (path := shutil.which(name))), None
)
FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--mute-audio"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--remote-debugging-port=0"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-extensions"),
)
# A test that is killed leaves no browser behind.
DIES_WITH_US = ("setpriv", "--pdeathsig", "KILL") if shutil.which("setpriv") else ()


class Browser:
    """One page in a browser of its own."""

    def __init__(self, profile: Path, width: int = 1280, height: int = 720, flags: tuple[str, ...] = ()) -> None:
        self._process = subprocess.Popen(
            [
                *(*DIES_WITH_US, CHROMIUM, *FLAGS, *flags),
                *(f"--user-data-dir={profile}", f"--window-size={width},{height}", "about:blank"),
            ],
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        self._number, self._session = 0, ""
        try:
            self._socket = connect(self._address(profile), max_size=None, ping_interval=None)
            (target,) = (t for t in self._send("Target.getTargets")["targetInfos"] if t["type"] == "page")
            self._show(target["targetId"], width, height)
        except BaseException:
            self._kill()
            raise

    def renew(self, width: int, height: int) -> None:
        """Another empty page instead of this one: it knows nothing of what was opened before."""
        before = self._target
        context = self._send("Target.createBrowserContext")["browserContextId"]
        made = self._send("Target.createTarget", url="about:blank", browserContextId=context)
        self._show(made["targetId"], width, height)
        self._send("Target.closeTarget", targetId=before)

    def _show(self, target: str, width: int, height: int) -> None:
        self._target = target
        self.errors: list[str] = []
        self.requests: list[str] = []
        self._session = self._send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network"):
            self.send(f"{domain}.enable")
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def _address(self, profile: Path) -> str:
        """Of its DevTools, which it writes into its profile."""
        file = profile / "DevToolsActivePort"
        for _ in range(300):
            if file.exists() and len(lines := file.read_text().split()) == 2:
                return f"ws://127.0.0.1:{lines[0]}{lines[1]}"
            time.sleep(0.05)
        raise TimeoutError("Chromium does not start")

    def _send(self, method: str, session: str | None = None, **params):
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if session is not None:
            message["sessionId"] = session
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(timeout=60.0))
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]
            self._note(answer)

    def _note(self, event) -> None:
        if event.get("sessionId") != self._session:  # of the browser, or of a page before
            return
        if event.get("method") == "Runtime.exceptionThrown":
            self.errors.append(event["params"]["exceptionDetails"]["exception"].get("description", "?"))
        if event.get("method") == "Network.requestWillBeSent":
            self.requests.append(event["params"]["request"]["url"])

    def send(self, method: str, **params):
        return self._send(method, self._session, **params)

    def open(self, url: str) -> None:
        self.send("Page.navigate", url=url)

    def evaluate(self, script: str):
        """The value of an expression in the page."""
        answer = self.send("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, script: str, timeout_s: float = 60.0):
        """Returns the value of an expression as soon as it is true."""
        end_s = time.monotonic() + timeout_s
        while True:
            value = self.evaluate(script)
            if value:
                return value
            assert time.monotonic() < end_s, f"not within {timeout_s:g} s: {script}"
            time.sleep(0.2)

    def click(self, x: float, y: float) -> None:
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            count = 0 if kind == "mouseMoved" else 1
            self.send("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=count)

    def click_button(self, text: str) -> None:
        """The button with this text, when nothing covers it; found and clicked in one step, since pages move."""
        self.wait(
            f"(() => {{ const b = [...document.querySelectorAll('button')].find(b => b.innerText.trim() === {text!r});"
            " if (!b || b.disabled) return false; b.scrollIntoView({block: 'center'});"
            " const r = b.getBoundingClientRect();"
            " const on_top = document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2);"
            " if (!b.contains(on_top)) return false; b.click(); return true; })()"
        )

    def picture(self) -> np.ndarray:
        """What the window shows, RGB."""
        data = base64.b64decode(self.send("Page.captureScreenshot", format="png")["data"])
        return cv2.cvtColor(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)

    def close(self) -> None:
        try:
            self._socket.close()
        finally:
            self._kill()

    def _kill(self) -> None:
        """Ends it with all its helpers, however it is."""
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait(10.0)
        self._process.stderr.close()
