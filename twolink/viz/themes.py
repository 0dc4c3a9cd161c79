"""Colour themes of pictures, light and dark."""

from __future__ import annotations

from dataclasses import dataclass, fields

from twolink.errors import PictureError
from twolink.inputs import as_word
from twolink.text import choice


@dataclass(frozen=True)
class Theme:
    """Colours as "#rrggbb"; links, runs and energies differ in hue and lightness."""

    name: str
    background: str
    grid: str
    axis: str
    ink: str
    faint: str
    links: tuple[str, str]
    pin: str
    end: str
    surface: str
    contact: str
    impulse: str
    kinetic: str
    potential: str
    ghosts: tuple[str, ...]

    def ghost(self, number: int) -> str:
        """Return the colour of a ghost by its number, from 1."""
        return self.ghosts[(number - 1) % len(self.ghosts)]


LIGHT = Theme(
    name="light",
    background="#ffffff",
    grid="#e9eaec",
    axis="#cdd0d4",
    ink="#1d2126",
    faint="#646b73",
    links=("#0072b2", "#b87400"),
    pin="#ffffff",
    end="#d0410b",
    surface="#4a5058",
    contact="#007a59",
    impulse="#a3206f",
    kinetic="#2b8cc9",
    potential="#7a6cc0",
    ghosts=("#a3206f", "#007a59", "#5b6fd6", "#7a5a2c", "#646b73"),
)

DARK = Theme(
    name="dark",
    background="#14171c",
    grid="#252a32",
    axis="#3d4550",
    ink="#eceef1",
    faint="#9aa3ae",
    links=("#3c9fe0", "#f2b134"),
    pin="#14171c",
    end="#ff7a45",
    surface="#aeb6c0",
    contact="#2fd1a0",
    impulse="#f27cc4",
    kinetic="#58b6ee",
    potential="#a79bea",
    ghosts=("#f27cc4", "#2fd1a0", "#8f9df5", "#cfa46a", "#9aa3ae"),
)

THEMES = {theme.name: theme for theme in (LIGHT, DARK)}


def recoloured(theme: Theme, into: Theme) -> dict[str, str]:
    """Return the mapping of a theme's colours to those of another."""
    found: dict[str, str] = {}
    for field in fields(theme):
        if field.name != "name":
            one, other = getattr(theme, field.name), getattr(into, field.name)
            several = isinstance(one, tuple)
            found.update(zip(one, other, strict=True) if several else [(one, other)])
    return found


def theme_named(name: str) -> Theme:
    """Return a theme by name. Raises `PictureError` for an unknown name."""
    if as_word("theme", name) not in THEMES:
        raise PictureError(choice("theme", name, THEMES))
    return THEMES[name]
