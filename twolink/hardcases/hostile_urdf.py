"""URDF texts that are broken or hostile, by name."""

from __future__ import annotations

from collections.abc import Callable

from twolink.data import data_path


def _shipped_urdf() -> str:
    return data_path("twolink.urdf").read_text(encoding="utf-8")


def _edited(old: str, new: str) -> Callable[[], str]:
    def text() -> str:
        original = _shipped_urdf()
        assert old in original
        return original.replace(old, new)

    return text


def _with_entities() -> str:
    """Return a URDF whose entities would expand to a billion characters."""
    names = "abcdefghij"
    lines = [
        f'<!ENTITY {first} "{f"&{second};" * 10}">'
        for first, second in zip(names[1:], names, strict=False)
    ]
    entities = "\n".join(['<!ENTITY a "aaaaaaaaaa">', *lines])
    body = _shipped_urdf().partition("<robot")[2]
    start = f'<?xml version="1.0"?>\n<!DOCTYPE robot [\n{entities}\n]>\n<robot'
    return start + body.replace("</robot>", "<note>&j;</note></robot>")


def _with_a_file() -> str:
    body = _shipped_urdf().partition("<robot")[2]
    entity = '<!DOCTYPE robot [<!ENTITY secret SYSTEM "file:///etc/passwd">]>'
    return f'<?xml version="1.0"?>\n{entity}\n<robot' + body.replace(
        "</robot>", "<note>&secret;</note></robot>"
    )


URDFS: dict[str, Callable[[], str]] = {
    "empty": lambda: "",
    "truncated": lambda: _shipped_urdf()[: len(_shipped_urdf()) // 2],
    "NaN mass": _edited('<mass value="1.0"/>', '<mass value="nan"/>'),
    "infinite mass": _edited('<mass value="1.0"/>', '<mass value="1e999"/>'),
    "negative mass": _edited('<mass value="1.0"/>', '<mass value="-1"/>'),
    "negative inertia": _edited('iyy="0.08', 'iyy="-0.08'),
    "no axis": _edited('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'),
    "a loop": lambda: (
        "<robot name='r'><link name='a'/><link name='b'/>"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
        "<joint name='k' type='continuous'><parent link='b'/><child link='a'/></joint></robot>"
    ),
    "entities": _with_entities,
    "a file": _with_a_file,
    "deep": lambda: "<robot name='r'>" + "<a>" * 1_000_000 + "</a>" * 1_000_000 + "</robot>",
    "100 MB": lambda: _shipped_urdf() + "<!--" + "x" * 100_000_000 + "-->",
    "noise": lambda: bytes(range(1, 256)).decode("latin-1") * 100,
}
