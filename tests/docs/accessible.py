"""Check a built site with axe-core: `python -m tests.docs.accessible FOLDER`.

Every page is read at the width of a phone in light and of a desktop in dark, and the first page in
all four ways: frame and menus are the same on all. Exit code 1 and a line for each rule that a page
violates, or for a page that is wider than its window.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from tests.viz.accessibility import violations
from tests.viz.surroundings import surround
from twolink.viz.browser import Browser, Page

# Widths and schemes in which all pages are read, and those of the first one alone.
_WAYS = ((390, "light"), (1280, "dark"))
_MORE_WAYS = ((390, "dark"), (1280, "light"))
# Films are tested with the player; theme files are parts of pages.
_OTHERS = {"films", "_static"}

# Seconds for one page. A long one takes several of them, and other steps run beside this one.
_PATIENCE = 120.0


def inaccessible(site: Path) -> Iterator[str]:
    """Yield a sentence for each fault of each page, once for all widths and schemes."""
    files = [f for f in sorted(site.rglob("*.html")) if not _OTHERS & set(f.parts)]
    if not files:
        yield f"{site}: there is no page"
    found: dict[str, None] = {}
    with Browser(patience=_PATIENCE) as browser:
        for width, scheme in (*_WAYS, *_MORE_WAYS):
            page = browser.page(width, 900)
            surround(page, prefers_color_scheme=scheme)
            for file in files if (width, scheme) in _WAYS else _first(files):
                name = file.relative_to(site).as_posix()
                found |= dict.fromkeys(f"{name}: {fault}" for fault in _faults(page, file))
    yield from found


def _first(files: list[Path]) -> list[Path]:
    """Return the first page of a site, or of a folder without one."""
    return [file for file in files if file.name == "index.html"][:1] or files[:1]


def _faults(page: Page, file: Path) -> list[str]:
    page.value("window.before = true")
    page.call("Page.navigate", {"url": file.resolve().as_uri()})
    page.wait_until("!window.before && document.readyState === 'complete'")
    wide = page.value("document.documentElement.scrollWidth > innerWidth")
    return violations(page) + (["it is wider than its window"] if wide else [])


def main(site: Path) -> int:
    """Print the faults of a site; return how many there are."""
    found = list(inaccessible(site))
    for fault in found:
        print(fault)
    print(f"{len(found)} faults")
    return len(found)


if __name__ == "__main__":
    sys.exit(1 if main(Path(sys.argv[1])) else 0)
