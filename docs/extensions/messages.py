"""The page of the protocol's messages, from their types."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from extensions.files import write_if_new
from twolink.engines import messages
from twolink.engines.messages import PROTOCOL, Message

_HEAD = f"""# Messages of the protocol

This page is generated from the types of `twolink/engines/messages.py`, protocol {PROTOCOL}.
[Check your engine](../check_your_engine.md#the-messages) shows a conversation. A message is one
JSON object on one line; "text" is a JSON string, and a number that is not finite is `"nan"`,
`"inf"` or `"-inf"`. A message with any other key is refused.
"""


def messages_page(folder: Path) -> str:
    """Return the page, and write the JSON schema of each message into `folder`."""
    schemas = messages.schemas()
    for name, schema in schemas.items():
        write_if_new(folder / f"message-{name}.json", json.dumps(schema, indent=2))
    listed = ", ".join(f"[{name}](message-{name}.json)" for name in schemas)
    sections = "".join(_section(message) for message in _messages())
    return f"{_HEAD}\nJSON schemas: {listed}.\n{sections}"


def _messages() -> Iterator[type[Message]]:
    """Yield the messages in the order of their source."""
    for value in vars(messages).values():
        if isinstance(value, type) and issubclass(value, Message) and value is not Message:
            yield value


def _section(message: type[Message]) -> str:
    text = inspect.cleandoc(message.__doc__ or "")
    lines = ["| key | type | needed |", "|---|---|---|"]
    for name, field in message.model_fields.items():
        needed = "yes" if field.is_required() else ""
        lines.append(f"| `{name}` | {_kind(field.annotation)} | {needed} |")
    return f"\n## {message.__name__}\n\n{text}\n\n" + "\n".join(lines) + "\n"


def _kind(kind: Any) -> str:
    """Return a type in the words of JSON."""
    if kind in _WORDS:
        return _WORDS[kind]
    if isinstance(kind, type) and issubclass(kind, Message):
        return f"[{kind.__name__}](#{kind.__name__.lower()})"
    parts = get_args(kind)
    if get_origin(kind) is tuple:
        items = [part for part in parts if part is not Ellipsis]
        return f"{'list' if len(items) < len(parts) else len(items)} of {_kind(items[0])}"
    if get_origin(kind) is Literal:
        return " or ".join(f"`{json.dumps(part)}`" for part in parts)
    # Of `Annotated` only the type counts.
    parts = parts[:1] if hasattr(kind, "__metadata__") else parts
    return " or ".join(dict.fromkeys(filter(None, map(_kind, parts)))) or "object"


_WORDS = {
    str: "text",
    float: "number",
    int: "whole number",
    bool: "true or false",
    Any: "any",
    type(None): "",
}
