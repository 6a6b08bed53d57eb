"""Headless Chromium controlled over a pipe: pointer and keyboard input, light and dark themes, printing.

One browser process serves many pages.
"""

import fcntl
import json
import os
import select
import shutil
from pathlib import Path

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--no-first-run",
    "--disable-quic",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--mute-audio",
)
PATIENCE = 60  # Time without a message [s] after which the browser counts as hung.


def find_chromium() -> str | None:
    """Return the path of the installed Chromium or Chrome, or None."""
    return next(
        (
            path
            for path in map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))
            if path
        ),
        None,
    )


class Chromium:
    """Browser with one page; `faults` collects the errors of the page's scripts."""

    def __init__(self, home: Path):
        self.home = home
        self.number = 0
        self.faults = []
        self.events = []
        self.buffer = b""
        (take, self.out), (self.into, give) = os.pipe(), os.pipe()
        # The browser reads commands from descriptor 3 and writes to descriptor 4.
        ends = [fcntl.fcntl(one, fcntl.F_DUPFD, 10) for one in (take, give)]
        null = os.open(os.devnull, os.O_RDWR)
        places = [
            (os.POSIX_SPAWN_DUP2, *pair)
            for pair in ((null, 1), (null, 2), (ends[0], 3), (ends[1], 4))
        ]
        words = [
            find_chromium(),
            *FLAGS,
            f"--user-data-dir={home / 'user'}",
            "--remote-debugging-pipe",
            "about:blank",
        ]
        self.process = os.posix_spawn(words[0], words, os.environ, file_actions=places)
        for one in (take, give, null, *ends):
            os.close(one)
        self.session = None
        self.target = next(
            one for one in self.call("Target.getTargets")["targetInfos"] if one["type"] == "page"
        )
        self.target = self.target["targetId"]
        self._attach()

    def _attach(self) -> None:
        """Attach a new session to the current page."""
        self.session = None
        self.session = self.call("Target.attachToTarget", targetId=self.target, flatten=True)[
            "sessionId"
        ]
        for part in ("Page", "Runtime"):
            self.call(f"{part}.enable")

    def _receive(self) -> dict:
        """Return the next message of the browser, and record script errors and events."""
        while b"\0" not in self.buffer:
            if not select.select([self.into], [], [], PATIENCE)[0]:
                raise TimeoutError(f"the browser has said nothing for {PATIENCE} s")
            if not (received := os.read(self.into, 1 << 20)):
                raise EOFError("the browser has ended")
            self.buffer += received
        text, _, self.buffer = self.buffer.partition(b"\0")
        message = json.loads(text)
        if message.get("method") == "Runtime.exceptionThrown":
            details = message["params"]["exceptionDetails"]
            self.faults.append(details.get("exception", {}).get("description") or details["text"])
        if (
            message.get("method") == "Runtime.consoleAPICalled"
            and message["params"]["type"] == "error"
        ):
            self.faults.append(
                " ".join(str(part.get("value", "")) for part in message["params"]["args"])
            )
        if "method" in message:
            self.events.append(message["method"])
        return message

    def call(self, method: str, **params) -> dict:
        """Send a command of the DevTools protocol and return its result."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": params}
        message |= {"sessionId": self.session} if self.session else {}
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while (reply := self._receive()).get("id") != self.number:
            pass
        assert "error" not in reply, reply
        return reply["result"]

    def call_and_wait(self, event: str, method: str, **params) -> None:
        """Send a command and wait for an event, which may arrive before the result."""
        self.events.clear()
        self.call(method, **params)
        while event not in self.events:
            self._receive()

    def visit(self, path: Path) -> "Chromium":
        """Load a page from a folder that also contains its scripts and styles, in a window as narrow as a phone."""
        self._open_new_tab()
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=390,
            height=900,
            deviceScaleFactor=1,
            mobile=False,
        )
        self.faults = []
        self.call_and_wait("Page.loadEventFired", "Page.navigate", url=path.as_uri())
        return self

    def _open_new_tab(self) -> None:
        """Replace the page by a new one, because the virtual clock of the old page may have stopped."""
        old = self.target
        self.session = None
        self.target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.call("Target.closeTarget", targetId=old)
        self._attach()

    def wait_for_charts(self) -> None:
        """Wait until every chart of the page is drawn."""
        self.evaluate("""new Promise((done) => {
            const stands = () => [...document.querySelectorAll('.chart')].every((one) => one.querySelector('.main-svg'));
            const look = () => stands() ? requestAnimationFrame(() => requestAnimationFrame(done)) : setTimeout(look, 9);
            look(); setTimeout(done, 8000); })""")

    def broken_words(self) -> list:
        """Return the words outside code that a line break divides."""
        return self.evaluate("""(() => {
            const words = [];
            const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
            while (walk.nextNode()) {
                const node = walk.currentNode;
                if (node.parentElement.closest('pre, code, script, style, math')) continue;
                for (const found of node.data.matchAll(/[A-Za-z]{4,}/g)) {
                    const range = document.createRange();
                    range.setStart(node, found.index);
                    range.setEnd(node, found.index + found[0].length);
                    const lines = new Set([...range.getClientRects()].filter((box) => box.width).map((box) => box.top));
                    if (lines.size > 1) words.push(found[0]);
                }
            }
            return words;
        })()""")

    def evaluate(self, text: str):
        """Return the value of a JavaScript expression in the page; a promise is awaited."""
        reply = self.call(
            "Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in reply, reply["exceptionDetails"]
        return reply["result"].get("value")

    def close(self) -> None:
        """End the browser."""
        try:
            self.session = None
            self.call("Browser.close")
        except (EOFError, OSError):  # The browser may close the pipe before it answers.
            pass
        os.close(self.out), os.close(self.into)
        os.waitpid(self.process, 0)
