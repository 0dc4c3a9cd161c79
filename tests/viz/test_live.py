import asyncio
import json
import socket
import subprocess
import sys
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from tests.viz.accessibility import violations
from tests.viz.films import film_of, need_browser
from tests.viz.surroundings import surround
from tests.viz.test_page import unpacked
from twolink.errors import PictureError
from twolink.viz.browser import Browser
from twolink.viz.live import Clock, LiveView


def test_the_clock_follows_the_wall_at_its_speed():
    clock = Clock(last=100, fps=60)
    clock.advance(0.5)
    assert clock.frame == 30
    clock.asked({"speed": 0.5})
    clock.advance(1.0)
    assert clock.frame == 60
    clock.asked({"play": False})
    clock.advance(1.0)
    assert clock.frame == 60
    clock.asked({"seek": 95})
    clock.asked({"play": True})
    clock.advance(1.0)
    assert clock.state == {"playing": False, "speed": 0.5, "frame": 100}
    # At its end a film begins anew.
    clock.asked({"play": True})
    assert clock.state == {"playing": True, "speed": 0.5, "frame": 0}


@pytest.mark.parametrize(
    "question",
    [None, 3, [], {"seek": "x"}, {"seek": None}, {"seek": True}, {"seek": float("nan")},
     {"speed": 0}, {"speed": -1}, {"speed": 1e9}, {"speed": float("inf")}, {"play": 1},
     {"run": "rm"}],
)  # fmt: skip
def test_the_clock_does_not_trust_a_page(question):
    clock = Clock(last=100, fps=60, frame=10.0)
    clock.asked(question)
    assert clock == Clock(last=100, fps=60, frame=10.0)


def test_seeking_ends_at_the_ends():
    clock = Clock(last=100, fps=60)
    clock.asked({"seek": 1e300})
    assert clock.frame == 100
    clock.asked({"seek": -5})
    assert clock.frame == 0


PAGES = []


@asynccontextmanager
async def served(**options):
    live = LiveView(film_of("drop", 1.0, fps=60), **options)
    await live.start()
    playing = asyncio.ensure_future(live.play())
    try:
        yield live
    finally:
        playing.cancel()
        await asyncio.gather(playing, return_exceptions=True)
        for page in PAGES:
            page.close()
        PAGES.clear()
        await live.close()


async def connected(live):
    """Return a page's connection; it is closed when the server ends."""
    page = await websocket_connect(live.url.replace("http", "ws") + "stream")
    PAGES.append(page)
    return page


async def refused(request):
    with pytest.raises(HTTPClientError) as caught:
        await AsyncHTTPClient(force_instance=True).fetch(request)
    return caught.value.code


def listening(inode_of_port):
    """The addresses at which this machine listens at a port, as the kernel has them."""
    found = []
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            local, state = line.split()[1], line.split()[3]
            address, port = local.split(":")
            if state == "0A" and int(port, 16) == inode_of_port:
                found.append(address)
    return found


@pytest.mark.slow
def test_the_server_listens_on_the_local_address_only():
    async def check():
        async with served() as live:
            return listening(live.port)

    # 127.0.0.1, its bytes from the last to the first.
    assert asyncio.run(check()) == ["0100007F"]


@pytest.mark.slow
def test_the_port_is_free_again_afterwards():
    async def check():
        async with served() as live:
            port = live.port
        return port

    port = asyncio.run(check())
    assert listening(port) == []
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", port))


@pytest.mark.slow
def test_a_port_that_is_taken_is_refused():
    async def check():
        async with served() as live:
            with pytest.raises(PictureError, match="must be an address of this machine"):
                await LiveView(live.film, port=live.port).start()

    asyncio.run(check())


@pytest.mark.slow
def test_the_server_serves_the_page_and_its_files():
    async def check():
        client = AsyncHTTPClient(force_instance=True)
        async with served() as live:
            return [
                await client.fetch(live.url + part)
                for part in ("", "player.js", "player.css", "viewer.js")
            ]

    page, *others = asyncio.run(check())
    assert b'class="twolink-player alone"' in page.body
    assert b"http" not in page.body
    assert all(len(other.body) > 1000 for other in others)
    assert others[2].headers["Content-Type"].startswith("text/javascript")


@pytest.mark.slow
def test_pages_from_elsewhere_are_not_answered():
    """A foreign name that points to this machine, and a socket opened by another's page."""

    async def check():
        async with served() as live:
            foreign = {"Host": "evil.example"}
            assert await refused(HTTPRequest(live.url, headers=foreign)) == 403
            stream = live.url.replace("http", "ws") + "stream"
            for headers in ({"Origin": "http://evil.example"}, foreign):
                with pytest.raises(HTTPClientError) as caught:
                    await websocket_connect(HTTPRequest(stream, headers=headers))
                assert caught.value.code == 403
            own = {"Host": f"localhost:{live.port}"}
            await AsyncHTTPClient(force_instance=True).fetch(HTTPRequest(live.url, headers=own))

    asyncio.run(check())


@pytest.mark.slow
def test_other_machines_need_the_key_in_the_address():
    """Listening to other machines: no page and no stream without the random word in the address."""

    async def check():
        client = AsyncHTTPClient(force_instance=True)
        async with served(host="0.0.0.0") as live:
            root = f"http://127.0.0.1:{live.port}/"
            key = live.url.removeprefix(f"http://0.0.0.0:{live.port}/")
            assert len(key) == 23
            for path in ("", "player.js", "x" * 22 + "/", key[:-2] + "/", key.upper()):
                assert await refused(HTTPRequest(root + path)) == 404
            stream = f"ws://127.0.0.1:{live.port}/"
            for path in ("stream", "x/stream"):
                with pytest.raises(HTTPClientError) as caught:
                    await websocket_connect(stream + path)
                assert caught.value.code == 404
            for part in ("", "player.js", "player.css", "viewer.js"):
                assert (await client.fetch(root + key + part)).code == 200
            page = await websocket_connect(stream + key + "stream")
            PAGES.append(page)
            assert await page.read_message()
            # A foreign name that points here, and a page from elsewhere.
            foreign = {"Host": "evil.example"}
            assert await refused(HTTPRequest(root + key, headers=foreign)) == 403
            for headers in ({"Origin": "http://evil.example"}, foreign):
                with pytest.raises(HTTPClientError) as caught:
                    await websocket_connect(HTTPRequest(stream + key + "stream", headers=headers))
                assert caught.value.code == 403
        client.close()
        while await page.read_message() is not None:
            # The page's socket is closed once its last message is read.
            pass

    asyncio.run(asyncio.wait_for(check(), 20))


def test_each_view_has_a_key_of_its_own():
    film = film_of("drop", 1.0)
    assert LiveView(film).url == LiveView(film).url == "http://127.0.0.1:0/"
    assert len({LiveView(film, host="0.0.0.0").url for _ in range(20)}) == 20


@pytest.mark.parametrize(
    ("host", "known"),
    [("192.0.2.1:80", True), ("[2001:db8::1]:80", True), (socket.gethostname(), True),
     ("localhost:1", True), ("evil.example", False), ("", False), ("1.evil.example:80", False)],
)  # fmt: skip
def test_only_known_hosts_are_answered(host, known):
    assert LiveView(film_of("drop", 1.0), host="0.0.0.0").knows(host) is known


@pytest.mark.slow
def test_two_pages_see_the_same_motion_and_both_may_steer():
    async def check():
        async with served() as live:
            pages = [await connected(live), await connected(live)]
            for page in pages:
                head, rest = unpacked(await page.read_message())
                assert head["about"]["title"] == live.film.about["title"]
                assert rest == b"".join(live.film.setup)
            times = [[], []]
            for _ in range(20):
                for page, seen in zip(pages, times, strict=True):
                    seen.append(unpacked(await page.read_message())[0]["words"]["t"])
            assert all(seen == sorted(seen) and seen[-1] > seen[0] for seen in times)
            await pages[1].write_message(json.dumps({"play": False}))
            await pages[1].write_message("not JSON")
            await pages[0].write_message(json.dumps({"seek": 30}))
            for page in pages:
                while True:
                    head, rest = unpacked(await page.read_message())
                    if head["state"] == {"playing": False, "speed": 1.0, "frame": 30}:
                        break
                assert head["words"]["t"] == pytest.approx(0.5)
                assert rest == b"".join(live.film.at(0.5).commands)

    asyncio.run(asyncio.wait_for(check(), 20))


@pytest.mark.slow
def test_the_last_frame_comes_even_to_a_page_that_is_slow():
    async def check():
        async with served() as live:
            page = await connected(live)
            # Long enough for the film to end while nothing is read.
            await asyncio.sleep(1.3)
            state = None
            while state is None or state["playing"]:
                state = unpacked(await page.read_message())[0].get("state")
            return state

    assert asyncio.run(asyncio.wait_for(check(), 20))["frame"] == 60


@pytest.mark.slow
def test_the_clock_stands_still_without_a_client():
    async def check():
        async with served() as live:
            await asyncio.sleep(0.2)
            return live.clock.frame

    assert asyncio.run(check()) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("preferred", "moves"), [("no-preference", True), ("reduce", False)])
def test_a_page_stands_still_if_reduced_motion_is_preferred(preferred, moves):
    """The page is accessible, too."""
    need_browser()
    command = [sys.executable, "-u", "-m", "twolink", "view", "small_swings", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            address = next(
                word for line in program.stdout for word in line.split() if "://" in word
            )
            with Browser() as browser:
                page = browser.page(640, 480)
                surround(page, prefers_reduced_motion=preferred)
                page.open(address)
                playing = "document.querySelector('.twolink-player').dataset.playing"
                page.wait_until(f"{playing} === '{str(moves).lower()}'")
                shown = "document.querySelector('.twolink-player').dataset.time"
                before = page.value(shown)
                page.value("new Promise((done) => setTimeout(done, 500))")
                assert (page.value(shown) != before) == moves
                assert violations(page) == []
        finally:
            program.terminate()
