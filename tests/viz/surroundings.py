"""Surroundings of a page in the tests' browser: colour scheme, print, motion, and the keyboard."""

from __future__ import annotations

from twolink.viz.browser import Page


def surround(page: Page, *, media: str = "", **features: str) -> None:
    """Emulate a medium, and features such as prefers_color_scheme="dark"."""
    named = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
    page.call("Emulation.setEmulatedMedia", {"media": media, "features": named})


def press(page: Page, key: str, code: str = "", *, shift: bool = False) -> None:
    """Press a key and let it go."""
    about = {"key": key, "code": code or key, "modifiers": 8 if shift else 0}
    if len(key) == 1:
        about["text"] = key
    if key == "Tab":
        about["windowsVirtualKeyCode"] = 9
    if key == "Enter":
        about |= {"windowsVirtualKeyCode": 13, "text": "\r"}
    for kind in ("keyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", {"type": kind, **about})


def tabbed(page: Page, most: int) -> list[str]:
    """Return the names of the elements that the tab key reaches in order, `most` of them."""
    found = []
    for _ in range(most):
        press(page, "Tab")
        found.append(
            page.value(
                "(e => e.getAttribute('aria-label') || e.className || e.textContent)"
                "(document.activeElement)"
            )
        )
    return found
