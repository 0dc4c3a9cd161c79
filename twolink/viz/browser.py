"""A headless Chromium or Chrome, driven over a pipe by the DevTools protocol.

A pipe opens no network port, and the browser ends when its pipe closes, even if this process is
killed.

Playwright 1.65.2 on the same Chromium could replace this module, and is not used because of its
size. `benchmarks/browsers.py` compares both. On a busy machine with two cores, the 91 pictures of a
film (1280 x 720, drawn at twice the size) are the same bytes and take the same time: 1.7 to 1.9 s
each by this module, 1.7 s by Playwright. The first one takes 7 to 9 s here and 11 to 12 s there.
Neither opens a port. After SIGKILL, Playwright's own process, a Node.js program, removes its files;
here the browser ends, and its folder of 2.5 MB remains until the next recording. Against this stand
171 MB of an installed package, a second runtime and a third process.
"""

from __future__ import annotations

import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any

from twolink.errors import BrowserError, PictureError
from twolink.files import scratch_folder

BROWSER = "TWOLINK_BROWSER"
"""The environment variable with the path of the browser's program."""

_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
)

_FLAGS = (
    "--headless=new",
    "--remote-debugging-pipe",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--disable-extensions",
    "--disable-default-apps",
    "--disable-breakpad",
    "--disable-crash-reporter",
    "--metrics-recording-only",
    "--mute-audio",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
    "--font-render-hinting=none",
    # Otherwise a hidden page is drawn only once per second.
    "--disable-renderer-backgrounding",
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
)

# The browser uses these file descriptors; a small wrapper program assigns them.
_READS, _WRITES = 3, 4
_BETWEEN = (
    "import os, sys\n"
    "reads, writes = int(sys.argv[1]), int(sys.argv[2])\n"
    "reads, writes = os.dup(reads), os.dup(writes)\n"
    "while min(reads, writes) < 5:\n"
    "    reads, writes = os.dup(reads), os.dup(writes)\n"
    f"os.dup2(reads, {_READS})\n"
    f"os.dup2(writes, {_WRITES})\n"
    "os.execv(sys.argv[3], sys.argv[3:])\n"
)

_PATIENCE = 30.0
_LONGEST = 55
_LEAVE_TAKING = 5.0


def find_browser() -> str | None:
    """Return the path of a Chromium or Chrome, or None if there is none."""
    named = os.environ.get(BROWSER)
    for name in (named,) if named else _NAMES:
        found = shutil.which(name)
        if found is not None:
            return found
    return None


def browser_program() -> str:
    """Return the path of a Chromium or Chrome. Raises `PictureError` if there is none."""
    if os.name != "posix":
        raise PictureError(
            f"recording needs Linux or macOS; got {sys.platform}; use a .html file, "
            "which needs no browser"
        )
    program = find_browser()
    if program is None:
        named = os.environ.get(BROWSER)
        where = f" ({BROWSER} is '{named}')" if named else ""
        raise PictureError(
            f"no Chromium or Chrome was found{where}; use a .html file, which needs none, or "
            "install one (Debian, Ubuntu: apt install chromium)"
        )
    return program


class Browser:
    """A headless browser with pages, used as a context manager that ends its processes.

    `patience` (s) is the time limit of an answer. Raises `PictureError` if there is no browser,
    and `BrowserError` if it hangs or crashes; it is then killed with all its processes.
    """

    def __init__(self, *, patience: float = _PATIENCE) -> None:
        """Set the time limit of an answer (s)."""
        self.patience = patience
        self.process: subprocess.Popen[bytes] | None = None
        self._numbers = count(1)
        self._answers: dict[int, dict[str, Any]] = {}
        self._received = bytearray()
        self.events: list[dict[str, Any]] = []

    def __enter__(self) -> Browser:
        """Start the browser."""
        program = browser_program()
        self._scratch = scratch_folder("web", _short_folder())
        self._folder = str(self._scratch.__enter__())
        try:
            self._start(program)
            self.call("Browser.getVersion")
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the browser, by its own command unless there was an exception."""
        if kind is None:
            with suppress(BrowserError):
                self._send("Browser.close", {}, None)
                assert self.process is not None
                with suppress(subprocess.TimeoutExpired):
                    self.process.wait(_LEAVE_TAKING)
        self.close()

    def _start(self, program: str) -> None:
        theirs_in, self._to_browser = os.pipe()
        self._from_browser, theirs_out = os.pipe()
        # The browser's sandbox does not work for root.
        root = ("--no-sandbox",) if os.geteuid() == 0 else ()
        flags = (*_FLAGS, *root, f"--user-data-dir={self._folder}/profile", "about:blank")
        between = (sys.executable, "-I", "-S", "-c", _BETWEEN, str(theirs_in), str(theirs_out))
        try:
            with Path(self._folder, "stderr").open("wb") as stderr:
                self.process = subprocess.Popen(
                    (*between, program, *flags),
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=stderr,
                    pass_fds=(theirs_in, theirs_out),
                    # A separate process group, to be killed as a whole, and one folder for all its
                    # files.
                    start_new_session=True,
                    env={**os.environ, "TMPDIR": self._folder},
                )
        finally:
            os.close(theirs_in)
            os.close(theirs_out)
        os.set_blocking(self._from_browser, False)
        os.set_blocking(self._to_browser, False)

    def close(self) -> None:
        """Kill all remaining processes of the browser and remove its folder."""
        if self.process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
            for end in (self._to_browser, self._from_browser):
                with suppress(OSError):
                    os.close(end)
            self.process = None
        self._scratch.__exit__(None, None, None)

    def page(self, width: int, height: int, scale: float = 1) -> Page:
        """Return a new page of a size in its pixels, each so many of the device's pixels wide."""
        target = self.call("Target.createTarget", {"url": "about:blank"})["targetId"]
        attached = self.call("Target.attachToTarget", {"targetId": target, "flatten": True})
        page = Page(self, str(attached["sessionId"]))
        size = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": False}
        page.call("Emulation.setDeviceMetricsOverride", size)
        for domain in ("Page", "Runtime", "Log", "Network"):
            page.call(f"{domain}.enable")
        return page

    def call(self, method: str, parameters: Any = None, session: str | None = None) -> Any:
        """Return the answer to a command of the DevTools protocol."""
        return self.answer(self._send(method, parameters or {}, session))

    def _send(self, method: str, parameters: dict[str, Any], session: str | None) -> int:
        """Send a command, and return the number of its answer."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = session
        waiting = memoryview(json.dumps(message).encode() + b"\0")
        end = time.monotonic() + self.patience
        while waiting:
            try:
                waiting = waiting[os.write(self._to_browser, waiting) :]
            except BlockingIOError:
                # The browser may be blocked until its output is read.
                self._read(end, method, writing=True)
            except OSError as error:
                raise self._died(method) from error
        return number

    def answer(self, number: int) -> Any:
        """Wait for the answer to a command with the given number."""
        end = time.monotonic() + self.patience
        while number not in self._answers:
            self._read(end, "an answer")
        answer = self._answers.pop(number)
        if "error" in answer:
            raise BrowserError(f"the browser refused a command ({answer['error']['message']})")
        return answer["result"]

    def wait_for_events(self, seconds: float) -> None:
        """Collect events of the browser for a time (s)."""
        end = time.monotonic() + seconds
        with suppress(TimeoutError):
            while True:
                self._read_once(end)

    def _read(self, end: float, waiting_for: str, *, writing: bool = False) -> None:
        try:
            self._read_once(end, writing=writing)
        except TimeoutError as error:
            raise BrowserError(
                f"the browser gave no sign for {self.patience:g} s (waiting for {waiting_for}); "
                "it was ended"
            ) from error

    def _read_once(self, end: float, *, writing: bool = False) -> None:
        """Read available data until a deadline, or raise `TimeoutError`."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._from_browser, selectors.EVENT_READ)
            if writing:
                selector.register(self._to_browser, selectors.EVENT_WRITE)
            ready = selector.select(max(0.0, end - time.monotonic()))
        if not ready:
            raise TimeoutError
        if not any(key.fd == self._from_browser for key, _ in ready):
            return
        try:
            part = os.read(self._from_browser, 1 << 20)
        except BlockingIOError:
            return
        if not part:
            raise self._died("an answer")
        before = len(self._received)
        self._received += part
        # Only new data can contain the end of a message.
        while (stop := self._received.find(b"\0", before)) >= 0:
            self._take(json.loads(bytes(self._received[:stop])))
            del self._received[: stop + 1]
            before = 0

    def _take(self, message: dict[str, Any]) -> None:
        if "id" in message:
            self._answers[message["id"]] = message
        else:
            self.events.append(message)

    def _died(self, waiting_for: str) -> BrowserError:
        """Return the error that the browser ended, with the last line of its log."""
        assert self.process is not None
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(1.0)
        log = Path(self._folder, "stderr")
        lines = log.read_text(errors="replace").split("\n") if log.exists() else []
        last = next((" ".join(line.split()) for line in reversed(lines) if line.strip()), "")
        code = self.process.returncode
        return BrowserError(
            f"the browser ended with code {code} while {waiting_for} was waited for"
            + (f" ({last[:300]})" if last else "")
        )


def _short_folder() -> str | None:
    """Return the parent of the browser's folder, or None for the default.

    The browser opens a socket in it, whose path is limited to about a hundred characters.
    """
    usual = tempfile.gettempdir()
    return "/tmp" if len(usual) > _LONGEST and os.access("/tmp", os.W_OK) else None


class Page:
    """A page of a browser."""

    def __init__(self, browser: Browser, session: str) -> None:
        """Store the browser and the identifier of the page."""
        self.browser = browser
        self.session = session

    def call(self, method: str, parameters: Any = None) -> Any:
        """Return the answer to a command on this page."""
        return self.browser.call(method, parameters, self.session)

    def open(self, url: str) -> None:
        """Open an address and wait until its players are ready."""
        failed = self.call("Page.navigate", {"url": url}).get("errorText")
        if failed:
            raise BrowserError(f"the browser cannot open {url} ({failed})")
        self.wait_until("document.querySelector('.twolink-player[data-ready]') !== null")

    def wait_until(self, condition: str) -> None:
        """Wait until a JavaScript condition holds. Raises `BrowserError` at the time limit."""
        end = time.monotonic() + self.browser.patience
        while not self.value(condition):
            if time.monotonic() > end:
                said = "; ".join(self.complaints()) or "no messages"
                raise BrowserError(f"the page is not ready in {self.browser.patience:g} s ({said})")
            time.sleep(0.02)

    def value(self, expression: str) -> Any:
        """Return the value of an expression in JavaScript."""
        return self.result(self.ask(expression))

    def ask(self, expression: str) -> int:
        """Request the value of an expression, and return the number of the request."""
        parameters = {"expression": expression, "returnByValue": True, "awaitPromise": True}
        return self.browser._send("Runtime.evaluate", parameters, self.session)

    def result(self, number: int) -> Any:
        """Return the requested value."""
        answer = self.browser.answer(number)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            said = details.get("exception", {}).get("description") or details.get("text", "")
            raise BrowserError(f"the page failed ({' '.join(str(said).split())[:300]})")
        return answer["result"].get("value")

    def events(self, method: str) -> list[dict[str, Any]]:
        """Return the browser's events of a given name for this page."""
        return [
            event["params"]
            for event in self.browser.events
            if event["method"] == method and event.get("sessionId") == self.session
        ]

    def complaints(self) -> list[str]:
        """Return the errors that the page has logged or thrown."""
        thrown = [
            str(event["exceptionDetails"].get("exception", {}).get("description", "error"))
            for event in self.events("Runtime.exceptionThrown")
        ]
        written = [
            " ".join(str(part.get("value", part.get("description", ""))) for part in event["args"])
            for event in self.events("Runtime.consoleAPICalled")
            if event["type"] in ("error", "assert")
        ]
        logged = [
            str(event["entry"]["text"])
            for event in self.events("Log.entryAdded")
            if event["entry"]["level"] == "error"
        ]
        return [*thrown, *written, *logged]
