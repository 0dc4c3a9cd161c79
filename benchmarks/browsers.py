"""A recording by `twolink.viz.browser` and by Playwright on the same Chromium.

`uv run --with playwright python -m benchmarks.browsers`, without `playwright install`.
"""

from __future__ import annotations

import hashlib
import importlib
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import distribution
from pathlib import Path
from time import perf_counter

from twolink import Scene, simulate
from twolink.viz.browser import Browser, browser_program
from twolink.viz.film import Film
from twolink.viz.page import player_page
from twolink.viz.run import Run

SIZE, FRAMES = (1280, 720), 91
ASK = "document.querySelector('.twolink-player').twolink.picture({})"


def ours(address: str) -> Iterator[str]:
    """Yield the pictures by `twolink.viz.browser`."""
    with Browser() as browser:
        page = browser.page(*SIZE, scale=2)
        page.open(address)
        for number in range(FRAMES):
            yield page.value(ASK.format(number))


def playwrights(address: str) -> Iterator[str]:
    """Yield the pictures by Playwright."""
    with importlib.import_module("playwright.sync_api").sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=browser_program(),
            args=["--no-sandbox", "--force-color-profile=srgb", "--font-render-hinting=none"],
        )
        viewport = {"width": SIZE[0], "height": SIZE[1]}
        page = browser.new_page(viewport=viewport, device_scale_factor=2)
        page.goto(address)
        page.wait_for_selector(".twolink-player[data-ready]", state="attached")
        for number in range(FRAMES):
            yield page.evaluate(ASK.format(number))
        browser.close()


def measured(name: str, pictures: Callable[[str], Iterator[str]], address: str) -> None:
    """Print the times of the first picture and of each further one, and a digest of all."""
    start = perf_counter()
    digest, found = hashlib.sha256(), pictures(address)
    digest.update(next(found).encode())
    first = perf_counter()
    for picture in found:
        digest.update(picture.encode())
    each = (perf_counter() - first) / (FRAMES - 1)
    print(
        f"{name:<12} first picture {first - start:5.2f} s, each further {each:6.3f} s, "
        f"all: {digest.hexdigest()[:12]}"
    )


def main() -> None:
    """Record three seconds of a film by both."""
    scene = replace(Scene.load("bounce_to_rest"), duration=3.0)
    film = Film((Run("film", simulate(scene)),))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "film.html"
        file.write_text(player_page(film, bare=True), encoding="utf-8")
        for name, pictures in (("twolink.viz.browser", ours), ("Playwright", playwrights)):
            measured(name, pictures, file.as_uri())
    package = distribution("playwright")
    size = sum(
        Path(str(each.locate())).stat().st_size
        for each in package.files or ()
        if Path(str(each.locate())).is_file()
    )
    print(f"Playwright {package.version}: {size / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
