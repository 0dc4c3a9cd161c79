"""Text from files and command lines, made fit for a terminal, a sentence or a page."""

from __future__ import annotations

import re
import reprlib
from collections import Counter
from collections.abc import Iterable, Sequence
from difflib import get_close_matches

# Controls (but for line feeds and tabs), marks that reorder text, other line ends, and halves of
# characters, of which Python makes the bytes of file names that are not UTF-8.
_UNFIT = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)
_UNFIT_IN_A_LINE = re.compile(_UNFIT.pattern[:-1] + "\t\n]")

_LONGEST_SENTENCE, _LONGEST_NAME = 600, 400
_MOST_NAMES = 12

# Bits of an integer above which it is not shown by its digits: Python writes no more than 4300.
_LONG_INTEGER = 10_000


class _Short(reprlib.Repr):
    """Representations of limited length, also of integers that Python does not write."""

    def repr_int(self, value: int, level: int) -> str:
        """Return the representation of an integer."""
        if value.bit_length() > _LONG_INTEGER:
            return "an integer of thousands of digits"
        return super().repr_int(value, level)


_SHORT = _Short()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 80
_SHORT.maxtuple = _SHORT.maxlist = _SHORT.maxdict = 12


def printable(text: object) -> str:
    r"""Return text with escapes such as `\x1b` in place of characters that steer a terminal."""
    return _UNFIT.sub(_escaped, str(text))


def one_line(text: object, longest: int = _LONGEST_SENTENCE) -> str:
    """Return printable text on one line, without its middle where it is longer than `longest`."""
    line = _UNFIT_IN_A_LINE.sub(_escaped, str(text))
    half = (longest - 3) // 2
    return line if len(line) <= longest else f"{line[:half]} … {line[-half:]}"


def quoted(value: object) -> str:
    """Return the representation of a received value on one line, shortened if it is long."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    try:
        return one_line(_SHORT.repr(value), 200)
    except Exception:
        return f"an object of type {type(value).__name__}"


def name_of_source(source: str) -> str:
    """Return the name of a text in messages; one that no file system would hold is shortened."""
    return one_line(source) if len(source) <= _LONGEST_NAME else quoted(source)


def rounded(number: float) -> str:
    """Return a number with three digits, and its thousands apart, such as 1.29 or 6,360."""
    return f"{float(f'{number:.3g}'):,g}"


def distinct(number: float) -> str:
    """Return a number with as many digits as tell it from all others, such as 5 or 5.0000001."""
    return repr(float(number)).removesuffix(".0")


def as_vector(components: Iterable[float]) -> str:
    """Return a vector with six digits of each component, such as (1, 0, -0.333333)."""
    # Adding 0.0 turns −0.0 into 0.0.
    return f"({', '.join(f'{component + 0.0:.6g}' for component in components)})"


def distinct_names(names: Iterable[str], form: str = "{} ({})") -> list[str]:
    """Return names that are all different: those that come again have a number, by the `form`.

    The number is the first one, from 2 on, that makes a name of no other.
    """
    every = list(names)
    taken, seen = set(every), Counter[str]()
    found = []
    for name in every:
        seen[name] += 1
        own = name
        while seen[name] > 1 and (own := form.format(name, seen[name])) in taken:
            seen[name] += 1
        taken.add(own)
        found.append(own)
    return found


def as_sentence(words: str) -> str:
    """Return words as a sentence: a capital first, and one full stop at the end."""
    return f"{words[:1].upper()}{words[1:]}{'' if words.endswith('.') else '.'}"


def either(words: Sequence[str]) -> str:
    """Return words as an enumeration: "a, b or c"."""
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last


def nearest(name: str, known: Iterable[str], cutoff: float) -> list[str]:
    """Return up to three known names that are similar to a name, the most similar first."""
    return get_close_matches(name[:100], list(known), n=3, cutoff=cutoff)


def choice(name: str, received: object, known: Iterable[str]) -> str:
    """Return the sentence that rejects an unknown name, with the known names and the nearest.

    Of more than a dozen known names the first dozen are listed.
    """
    names = list(known)
    near = nearest(str(received), names, cutoff=0.5)
    listed = ", ".join(names[:_MOST_NAMES])
    more = f", … ({len(names)} in all)" if len(names) > _MOST_NAMES else ""
    hint = f" (did you mean {' or '.join(map(repr, near))}?)" if near else ""
    return f"{name} must be one of {listed}{more}; got {quoted(received)}{hint}"


def _escaped(match: re.Match[str]) -> str:
    code = ord(match[0])
    # A byte of a file name that is not UTF-8.
    if 0xDC80 <= code <= 0xDCFF:
        code -= 0xDC00
    short = {0x09: "\\t", 0x0A: "\\n", 0x0D: "\\r"}
    return short.get(code) or (f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}")
