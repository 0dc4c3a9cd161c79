"""Check a built site: `python -m tests.docs.site FOLDER`; exit code 1 and a line for each fault.

Every internal link must lead to a file of the site and to an element with that id, and no page may
load anything from another host.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# Attributes by which a page loads something; a link that a reader follows is no load.
_LOADS = {("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src")}
_OUTSIDE = re.compile(r"(?:https?:)?//", re.IGNORECASE)
_STYLE_LOADS = re.compile(r"(?:url\(\s*|@import\s+)[\"']?((?:https?:)?//[^\"')\s]+)", re.IGNORECASE)
# Films are whole pages with programs of their own, and are tested with the player.
_FILMS = "films"


class Page(HTMLParser):
    """The ids, links and loads of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect the attributes of an element."""
        given = {name: value for name, value in attrs if value}
        self.ids |= {given[name] for name in ("id", "name") if name in given}
        for name in ("href", "src"):
            if name in given:
                self.links.append(given[name])
                if (tag, name) in _LOADS:
                    self.loads.append(given[name])


def faults(site: Path) -> Iterator[str]:
    """Yield a sentence for each broken link and each load from another host."""
    films = site / _FILMS
    files = [file for file in sorted(site.rglob("*.html")) if films not in file.parents]
    pages = {file.resolve(): Page(file.read_text(encoding="utf-8")) for file in files}
    if not pages:
        yield f"{site}: there is no page"
    for file, page in pages.items():
        name = file.relative_to(site.resolve())
        for load in page.loads:
            if _OUTSIDE.match(load):
                yield f"{name}: loads {load}"
        for link in dict.fromkeys(page.links):
            if _broken(link, file, pages):
                yield f"{name}: {link} leads nowhere"
    for file in sorted(site.rglob("*.css")):
        for load in _STYLE_LOADS.findall(file.read_text(encoding="utf-8")):
            yield f"{file.relative_to(site)}: loads {load}"


def _broken(link: str, file: Path, pages: dict[Path, Page]) -> bool:
    """Return whether an internal link of a page leads nowhere."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return False
    target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
    if target.is_dir():
        target /= "index.html"
    if not target.exists():
        return True
    place = unquote(parts.fragment)
    return bool(place) and target in pages and place not in pages[target].ids


def main() -> None:
    """Print the faults of the site in the folder of the command line."""
    found = list(faults(Path(sys.argv[1])))
    print(*found, f"{len(found)} faults", sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
