"""A live view: a server that streams a film's frames to pages, and receives their commands.

meshcat's own server listens on every address, without authentication, and outlives its caller.
This one serves meshcat's viewer from its package, listens on a given host, by default on this
machine alone, answers only pages that it served itself, and ends with the loop that it runs in.
If it listens to other machines, its address has a random key.
"""

from __future__ import annotations

import asyncio
import html
import ipaddress
import json
import math
import re
import secrets
import socket
from dataclasses import dataclass
from typing import Any, TypeGuard
from urllib.parse import urlsplit

import tornado.httpserver
import tornado.web
import tornado.websocket

from twolink.errors import PictureError
from twolink.viz.film import Film
from twolink.viz.page import frame_message, licences, part, setup_message, still, viewer_script

LOOPBACK = "127.0.0.1"
_OWN = ("127.0.0.1", "localhost", "::1")

# Frames a second that are sent at most.
_RATE = 60.0

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>body {{ margin: 0; }}</style>
<link rel="stylesheet" href="player.css">
<script src="viewer.js"></script>
<script src="player.js"></script>
</head>
<body><main><div class="twolink-player alone" data-theme="{theme}">{still}</div></main></body>
</html>
"""


@dataclass
class Clock:
    """Where a film is: at a frame (not always a whole one), playing or not, at a speed."""

    last: int
    fps: float
    frame: float = 0.0
    playing: bool = True
    speed: float = 1.0

    def advance(self, seconds: float) -> None:
        """Advance by a wall-clock time (s); the film stops at its last frame."""
        if self.playing:
            self.frame = min(self.last, self.frame + seconds * self.fps * self.speed)
            self.playing = self.frame < self.last

    def asked(self, question: Any) -> None:
        """Obey a page's command: {"play": bool}, {"seek": frame} or {"speed": factor}.

        Anything else is ignored: a page is not trusted.
        """
        if not isinstance(question, dict):
            return
        play, seek, speed = (question.get(name) for name in ("play", "seek", "speed"))
        if isinstance(play, bool):
            if play and self.frame >= self.last:
                self.frame = 0.0
            self.playing = play
        if _is_number(seek):
            self.frame = float(min(max(seek, 0), self.last))
        if _is_number(speed) and 0.01 <= speed <= 100:
            self.speed = float(speed)

    @property
    def state(self) -> dict[str, Any]:
        """The state of the clock, as pages receive it."""
        return {"playing": self.playing, "speed": self.speed, "frame": round(self.frame, 3)}


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


class LiveView:
    """A film on a server; `await start()`, then `await play()` until it is cancelled, `close()`.

    `host` is where it listens; `port` 0 is any that is free. With `follows` pages have the
    colours of their readers' scheme.
    """

    def __init__(
        self, film: Film, *, host: str = LOOPBACK, port: int = 0, follows: bool = False
    ) -> None:
        """Store the film and the address to listen on."""
        self.film = film
        self.host = host
        self.port = port
        self.clock = Clock(len(film.times) - 1, film.fps)
        self.pages: set[_Stream] = set()
        # Only this machine reaches loopback; other addresses contain a random key.
        self._key = "" if host in _OWN else secrets.token_urlsafe(16)
        self._setup = setup_message(film, follows)
        self._server: tornado.httpserver.HTTPServer | None = None
        self._changed = asyncio.Event()

    @property
    def url(self) -> str:
        """The address of the page."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{self.port}{self._root}"

    @property
    def _root(self) -> str:
        """The path that all addresses of the view begin with."""
        return f"/{self._key}/" if self._key else "/"

    async def start(self) -> None:
        """Listen; raises `PictureError` where that is not possible."""
        served = {
            "": ("text/html", self._page()),
            "viewer.js": ("text/javascript", f"/*\n{licences()}\n*/\n{viewer_script()}"),
            "player.js": ("text/javascript", part("player.js")),
            "player.css": ("text/css", part("player.css")),
        }
        root = r"/(?:([\w-]+)/)?"
        parts: list[Any] = [
            (root + re.escape(name), _Part, {"view": self, "kind": kind, "text": text})
            for name, (kind, text) in served.items()
        ]
        # No log of requests: it would fill a pipe that is not read.
        app = tornado.web.Application(
            [*parts, (root + "stream", _Stream, {"view": self})],
            log_function=lambda handler: None,
            websocket_max_message_size=1 << 16,
        )
        try:
            family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
            listener = socket.create_server((self.host, self.port), family=family)
        except OSError as error:
            raise PictureError(
                "--host and --port must be an address of this machine and a free port; got "
                f"{self.host} and {self.port} ({error.strerror or error})"
            ) from error
        listener.setblocking(False)
        self.port = int(listener.getsockname()[1])
        self._server = tornado.httpserver.HTTPServer(app)
        self._server.add_socket(listener)

    async def play(self) -> None:
        """Stream frames in real time, for ever."""
        loop = asyncio.get_running_loop()
        before = loop.time()
        while True:
            now = loop.time()
            # The film advances only while a page is connected.
            if self.pages:
                self.clock.advance(now - before)
                self.show()
            before = now
            if self.pages and self.clock.playing:
                await asyncio.sleep(max(0.0, now + 1 / _RATE - loop.time()))
            else:
                self._changed.clear()
                await self._changed.wait()
                before = loop.time()

    async def close(self) -> None:
        """Stop listening, and close every connection."""
        if self._server is not None:
            self._server.stop()
            for page in list(self.pages):
                page.close()
            await self._server.close_all_connections()

    def show(self) -> None:
        """Send the present frame to all pages that can take one."""
        message = self._message()
        for page in list(self.pages):
            page.show(message)

    def welcome(self, page: _Stream) -> None:
        """Add a page that has just connected, and send it the film and the present frame."""
        self.pages.add(page)
        page.send(self._setup)
        page.send(self._message())
        self._changed.set()

    def receive(self, text: str | bytes) -> None:
        """Obey a page's command."""
        try:
            question = json.loads(text)
        except ValueError:
            return
        self.clock.asked(question)
        self.show()
        self._changed.set()

    def knows(self, host: str) -> bool:
        """Return whether a request for a host may be answered.

        A page from elsewhere could have its name point to this machine: only the machine's own
        names are answered to and, where others may look on, addresses in numbers.
        """
        name = urlsplit(f"//{host}").hostname or ""
        if self.host in _OWN:
            return name in _OWN
        own = {*_OWN, self.host.lower(), socket.gethostname().lower()}
        return name in own or _is_address(name)

    def admits(self, key: str | None) -> bool:
        """Return whether a request with this word in its path may be answered."""
        return secrets.compare_digest((key or "").encode(), self._key.encode())

    def _message(self) -> bytes:
        clock, film = self.clock, self.film
        # A run known at its samples alone has no frames between them.
        sampled = any(run.is_sampled for run in film.runs)
        frame = float(int(clock.frame)) if sampled else clock.frame
        time = film.start + frame * film.speed / film.fps
        return frame_message(film.at(min(time, film.start + film.duration)), clock.state)

    def _page(self) -> str:
        title = html.escape(str(self.film.about["title"]))
        return _PAGE.format(title=title, theme=self.film.theme.name, still=still(self.film))


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class _Guarded(tornado.web.RequestHandler):
    """The common part of both handlers: the view, and its check of host and key."""

    view: LiveView

    def prepare(self) -> None:
        """Refuse requests for another host, and those without the key."""
        if not self.view.knows(self.request.host or ""):
            raise tornado.web.HTTPError(403)
        if not self.view.admits(self.path_args[0] if self.path_args else None):
            raise tornado.web.HTTPError(404)


class _Part(_Guarded):
    """One of the files that a page is made of."""

    def initialize(self, view: LiveView, kind: str, text: str) -> None:
        self.view, self.kind, self.text = view, kind, text

    def get(self, key: str | None = None) -> None:
        self.set_header("Content-Type", f"{self.kind}; charset=utf-8")
        self.set_header("Cache-Control", "no-store")
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Content-Security-Policy", "frame-ancestors 'none'")
        self.finish(self.text)


class _Stream(_Guarded, tornado.websocket.WebSocketHandler):
    """A page's connection. Tornado lets only those in whose origin is this server."""

    def initialize(self, view: LiveView) -> None:
        self.view = view
        self._busy = False
        self._next: bytes | None = None

    def open(self, *args: str | None, **kwargs: str) -> None:
        self.set_nodelay(True)
        self.view.welcome(self)

    def on_message(self, message: str | bytes) -> None:
        self.view.receive(message)

    def on_close(self) -> None:
        self.view.pages.discard(self)

    def send(self, message: bytes) -> None:
        """Send a message that must not be lost."""
        _spawn(self._sent(message))

    def show(self, message: bytes) -> None:
        """Send a frame once the last one is sent; of waiting frames only the newest is sent."""
        self._next = message
        if not self._busy:
            self._busy = True
            _spawn(self._all_sent())

    async def _all_sent(self) -> None:
        while self._next is not None:
            message, self._next = self._next, None
            await self._sent(message)
        self._busy = False

    async def _sent(self, message: bytes) -> None:
        try:
            await self.write_message(message, binary=True)
        except tornado.websocket.WebSocketClosedError:
            self.view.pages.discard(self)


_TASKS: set[asyncio.Task[None]] = set()


def _spawn(work: Any) -> None:
    """Run a coroutine as a task; a reference is kept until it is done."""
    task = asyncio.ensure_future(work)
    _TASKS.add(task)
    task.add_done_callback(_TASKS.discard)
