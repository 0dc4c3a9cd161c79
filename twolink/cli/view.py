"""The command `twolink view`."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING, Annotated

import typer

from twolink.cli.limits import Force
from twolink.cli.showing import (
    Ghosts,
    Motion,
    Nearby,
    OwnGeometry,
    Speed,
    Surroundings,
    film_of,
)
from twolink.cli.terminal import flush, refuse, say, warn
from twolink.cli.trajectories import print_notes

if TYPE_CHECKING:
    from twolink.viz.film import Film

_LOOPBACK = ("127.0.0.1", "localhost", "::1")

# Frames a second of the motion between which the page's slider steps.
_FPS = 60.0


def view(
    motion: Motion,
    ghost: Ghosts = None,
    nearby: Nearby = None,
    urdf: OwnGeometry = None,
    speed: Speed = 1.0,
    theme: Surroundings = None,
    browser: Annotated[
        bool, typer.Option(help="Open the page in your browser, and not only print its address.")
    ] = True,
    host: Annotated[
        str, typer.Option(help="Where to listen. Default: to this machine alone.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="The port to listen at. Default: any free one.")] = 0,
    force: Force = False,
) -> None:
    """Show a motion live in the browser, through meshcat's viewer.

    The page plays it in real time; it has buttons, and keys: space, arrows, Home, End, + and −, 0.
    All open pages show the same. Press Ctrl-C to stop.
    """
    if not 0 <= port <= 65535:
        refuse(f"--port must be 0 to 65535; got {port}")
    # It takes a tenth of the start of every command.
    import asyncio

    film = film_of(
        motion, ghosts=ghost or [], nearby=nearby, urdf=urdf, fps=_FPS, speed=speed,
        theme=theme, force=force,
    )  # fmt: skip
    print_notes(run.trajectory for run in film.runs)
    asyncio.run(_served(film, host, port, opened=browser, follows=theme is None))


async def _served(film: Film, host: str, port: int, *, opened: bool, follows: bool) -> None:
    """Serve a film until Ctrl-C or SIGTERM."""
    import asyncio

    from twolink.viz.live import LiveView

    live = LiveView(film, host=host, port=port, follows=follows)
    await live.start()
    loop = asyncio.get_running_loop()
    playing = asyncio.ensure_future(live.play())
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, playing.cancel)
    try:
        if host not in _LOOPBACK:
            warn(
                f"Listening at {host}: anyone who has this address and can reach this machine can "
                "watch the motion, and play, pause and seek it; there is no encryption."
            )
        say(f"{live.url}\nPress Ctrl-C to stop.")
        flush()
        if opened:
            import webbrowser

            await asyncio.to_thread(webbrowser.open, live.url)
        await playing
    except asyncio.CancelledError:
        pass
    finally:
        await live.close()
