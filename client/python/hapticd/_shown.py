"""Text of others as a terminal may get it."""

from __future__ import annotations

import re
import sys
from typing import Any, TextIO

#: What proto/text/utf8_text.h lists: control characters, ends of lines of Unicode, marks of direction; and half characters,
#: which no stream can encode.
_OBEYED = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")
_SHORT = {"\n": "\\n", "\r": "\\r", "\t": "\\t"}


def printable(text: str) -> str:
    """Text on one line, without anything that a terminal would obey or that would reorder what is shown: it is escaped
    as in JSON. A text that is printable stays as it is."""
    return _OBEYED.sub(lambda found: _SHORT.get(found[0], f"\\u{ord(found[0]):04x}"), text)


def say(text: Any, to: TextIO | None = None) -> None:
    """A text of one line or several, each of them printable; to the standard output if not named otherwise."""
    stream = sys.stdout if to is None else to
    print("\n".join(printable(line) for line in str(text).split("\n")), file=stream, flush=True)
