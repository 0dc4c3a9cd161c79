"""The prefixes of XML namespaces in a URDF, by which programs find their extensions."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from xml.parsers import expat


def prefixes_in(text: str) -> dict[str, str]:
    """Return the prefixes of the namespaces of well-formed XML, each that of its first one."""
    found: dict[str, str] = {}
    parser = expat.ParserCreate("utf-8", "}")

    def declared(prefix: str | None, space: str | None) -> None:
        if prefix and space and prefix not in found.values():
            found.setdefault(space, prefix)

    parser.StartNamespaceDeclHandler = declared
    parser.Parse(text.encode("utf-8"), True)
    return found


def use_prefixes(robot: ET.Element, prefixes: dict[str, str]) -> None:
    """Give names of extensions their prefixes, which are declared at the root.

    ElementTree would write others, such as ns0, which no program looks for.
    """
    used: dict[str, str] = {}

    def named(name: str) -> str:
        space, inner, own = name[1:].partition("}") if name.startswith("{") else ("", "", name)
        if not inner or space not in prefixes:
            return name
        used[f"xmlns:{prefixes[space]}"] = space
        return f"{prefixes[space]}:{own}"

    for element in robot.iter():
        if isinstance(element.tag, str):
            element.tag = named(element.tag)
            attributes = {named(name): value for name, value in element.attrib.items()}
            element.attrib.clear()
            element.attrib.update(attributes)
    for declaration, space in used.items():
        robot.set(declaration, space)
