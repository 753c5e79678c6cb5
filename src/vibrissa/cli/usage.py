"""What the parser of the command line refuses, told in one line."""

from __future__ import annotations

import re
from collections.abc import Sequence

POINTS = {"--seed": "COLUMN,ROW", "--skin": "COLUMN,ROW", "--substrate": "COLUMN,ROW", "--scale": "COLUMN,ROW"}
POINTS |= {"--region": "C0,R0,C1,R1", "--lamp": "C0,R0,C1,R1"}


def usage_line(error: Exception, words: Sequence[str]) -> str:
    """The parser's words on an error, without its list of all commands; a word too many by what it may have meant.

    Parameters
    ----------
    error : Exception
        What the parser raised.
    words : sequence of str
        The command line.
    """
    line = " ".join(str(error).split()).replace("requires an argument", "must be given, with its value")
    line = re.sub(r"requires (\d+) positional arguments", r"must be given, with its \1 values", line)
    if line.startswith("Unknown command"):
        line = line.partition(" Available commands:")[0]
    if unused := re.match(r"Unused Tokens: \['(.*?)'", line):
        return _too_many(unused[1], words)
    return f"{line.rstrip('.')}; see --help"


def _too_many(word: str, words: Sequence[str]) -> str:
    """A point written with a blank leaves a word over."""
    place = words.index(word) if word in words else 0
    option = words[place - 2] if place > 1 else ""
    if option in POINTS:
        return f"{option} must be {POINTS[option]} in one word, got {words[place - 1]!r} and {word!r}"
    return f"{word!r} is a word too many; see --help"
