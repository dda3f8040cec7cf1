"""The studio while it is made: on 127.0.0.1, takes and steps as they come, then the page."""

from __future__ import annotations

import json
import threading
from collections.abc import Sequence
from html import escape
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Final
from urllib.parse import parse_qs

from identification.diagnosis.studio.page import asset, policy

HERE: Final = "127.0.0.1"
WAIT: Final = 10.0
"""Seconds after which a quiet stream says that it is still there."""


class LiveStudio:
    """Serve a take and the steps of a diagnosis to browsers of this machine, then its page.

    Only requests that name this address are answered: a foreign page cannot read along under a
    name of its own. Call it with a text and a fraction, as any progress.

    Parameters
    ----------
    port : int
        0 takes a free one.
    """

    def __init__(self, port: int = 0) -> None:
        self._told: list[tuple[str, Any]] = []
        self._page = ""
        self._offers: tuple[str, ...] = ()
        self._chosen: int | None = None
        self._ended = False
        self._stop = threading.Event()
        self._news = threading.Condition()
        self._server = ThreadingHTTPServer((HERE, port), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)

    @property
    def address(self) -> str:
        """Where a browser finds it."""
        return f"http://{HERE}:{self._server.server_port}/"

    @property
    def stopped(self) -> bool:
        """Whether somebody has asked to stop with what is known."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask to stop."""
        self._stop.set()

    def go_on(self) -> None:
        """Forget that somebody has asked to stop: something else begins."""
        self._stop.clear()

    def __enter__(self) -> LiveStudio:
        """Begin to serve."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the streams and the server."""
        with self._news:
            self._ended = True
            self._news.notify_all()
        self._server.shutdown()
        self._server.server_close()

    def __call__(self, text: str, fraction: float) -> None:
        """Tell a step."""
        self._tell("step", (text, fraction))

    def take(self, part: dict[str, Any]) -> None:
        """Tell a part of a running take: `name` with its unit, `t`, `y` and the `model`'s."""
        self._tell("take", part)

    def _tell(self, kind: str, value: Any) -> None:
        with self._news:
            self._told.append((kind, value))
            self._news.notify_all()

    def finish(self, page: str, offers: Sequence[str] = ()) -> None:
        """Serve the finished page from now on, with takes that `offers` describe."""
        with self._news:
            self._page, self._offers, self._chosen = page, tuple(offers), None
            self._news.notify_all()

    def wait(self) -> int | None:
        """Serve until somebody asks for one of the takes, or the user interrupts; returns which."""
        with self._news:
            self._news.wait_for(lambda: self._chosen is not None or self._ended)
            return self._chosen

    def choose(self, number: int) -> bool:
        """Ask for an offered take; the page waits again. Whether it was offered, and not yet."""
        with self._news:
            if self._chosen is not None or not 0 <= number < len(self._offers):
                return False
            self._chosen, self._page, self._told = number, "", []
            self.go_on()
            self._news.notify_all()
            return True

    def shown(self) -> str:
        """Return the page as it stands."""
        script = asset("plot.js") + asset("live.js")
        waiting = asset("live.html").replace("POLICY", policy(script, "connect-src 'self'; "))
        page = self._page or waiting.replace("SCRIPT", script)
        if not (self._page and self._offers):
            return page
        page = page.replace("form-action 'none'", "form-action 'self'")
        return page.replace("</body>", _takes(self._offers) + "</body>")

    def after(self, told: int) -> tuple[list[tuple[str, Any]], bool, bool]:
        """Return what is new after `told`, whether the page is made, and the end."""
        with self._news:
            self._news.wait_for(lambda: self._told[told:] or self._page or self._ended, WAIT)
            return self._told[told:], bool(self._page), self._ended


def _takes(offers: Sequence[str]) -> str:
    """Return a form that asks for one of the takes; a script is not needed, a tick is."""
    buttons = "".join(
        f'<p><button name="take" value="{k}">record on the station</button> {escape(words)}</p>'
        for k, words in enumerate(offers)
    )
    return (
        '<section class="paper"><h2>Record it now</h2><form method="post" action="/record">'
        '<p><label><input type="checkbox" name="moves" value="yes" required> the actuator may '
        f"move, inside the station's envelope</label></p>{buttons}</form></section>"
    )


def _handler(studio: LiveStudio) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def _own(self) -> bool:
            """Whether the request names this address, and no other page sent it."""
            here = studio.address.rstrip("/")
            return (
                self.headers.get("Host") == here.removeprefix("http://")
                and self.headers.get("Origin", here) == here
            )

        def do_POST(self) -> None:
            if not self._own():
                self.send_error(403)
            elif self.path == "/stop":
                studio.stop()
                self._send("text/plain", "stopping")
            elif self.path == "/record" and studio.choose(self._asked()):
                self.send_response(303)
                self.send_header("Location", "/")
                self.send_header("Content-Length", "0")
                self.end_headers()
            else:
                self.send_error(404)

        def _asked(self) -> int:
            """Return the number of the take that a ticked form asks for, else -1."""
            size = self.headers.get("Content-Length", "")
            if not size.isdecimal() or int(size) > len("moves=yes&take=") + 3:
                return -1
            said = parse_qs(self.rfile.read(int(size)).decode("ascii", "replace"))
            (take, *_), ticked = said.get("take", [""]), said.get("moves") == ["yes"]
            return int(take) if ticked and take.isdecimal() else -1

        def do_GET(self) -> None:
            if not self._own():
                self.send_error(403)
            elif self.path == "/":
                self._send("text/html; charset=utf-8", studio.shown())
            elif self.path == "/events":
                self._send("text/event-stream", "")
                self._stream()
            else:
                self.send_error(404)

        def _send(self, kind: str, text: str) -> None:
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(text.encode())

        def _stream(self) -> None:
            told, made, ended = 0, False, False
            try:
                while not (made or ended):
                    fresh, made, ended = studio.after(told)
                    told += len(fresh)
                    lines = [f"event: {k}\ndata: {json.dumps(v)}\n\n" for k, v in fresh]
                    lines += ["event: made\ndata: 1\n\n"] if made else [":\n\n"]
                    lines += ["event: ended\ndata: 1\n\n"] if ended and not made else []
                    self.wfile.write("".join(lines).encode())
                    self.wfile.flush()
            except OSError:  # the browser has gone
                return

        def log_message(self, format: str, *args: Any) -> None:
            """Say nothing: the terminal belongs to the diagnosis."""

    return Handler
