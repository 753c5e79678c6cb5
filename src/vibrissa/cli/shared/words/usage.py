"""One line for each input that the parser of the command line refuses."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from vibrissa.cli.shared.words.glossary import GLOSSARY
from vibrissa.cli.shared.words.renamed import OLD_VERBS, near_name, new_name
from vibrissa.errors import InputError

POINTS = {
    "--seed-point": "COLUMN,ROW",
    "--skin": "COLUMN,ROW",
    "--substrate": "COLUMN,ROW",
    "--scale-point": "COLUMN,ROW",
}
POINTS |= {"--region": "C0,R0,C1,R1", "--lamp": "C0,R0,C1,R1"}


def usage_line(error: Exception, words: Sequence[str], taken: Collection[str] = ()) -> str:
    """The parser's message, without its list of all commands; an unexpected word with the option it may belong to.

    Parameters
    ----------
    error : Exception
        What the parser raised.
    words : sequence of str
        The command line.
    taken : collection of str
        Options that the verb takes.

    Returns
    -------
    str
        One line.
    """
    if line := _renamed(words, taken) or _unread(error):
        return line
    line = " ".join(str(error).split()).replace("requires an argument", "must be given, with its value")
    line = re.sub(r"requires (\d+) positional arguments", r"must be given, with its \1 values", line)
    if line.startswith("Unknown command"):
        line = line.partition(" Available commands:")[0]
    if unused := re.match(r"Unused Tokens: \['(.*?)'", line):
        return _too_many(unused[1], words)
    line = re.sub(r" Did you mean (--\S+) instead of \1=\S+\?", "", line)  # the option was right
    absent = re.search(r"(--[\w.-]+)\W? must be given, with its", line)
    known = GLOSSARY.get(absent[1]) if absent else None
    form = f"; for example {absent[1]} {known.example}" if absent and known else ""
    return f"{line.rstrip('.')}{form}; see --help"


def _renamed(words: Sequence[str], taken: Collection[str]) -> str:
    """Message for a verb or an option by an old name or a common other word; nothing if there is none."""
    verb, *rest = words
    if verb in OLD_VERBS:
        return f"the verb {verb} is now {OLD_VERBS[verb]}; see vibrissa {OLD_VERBS[verb]} --help"
    for option in (word.partition("=")[0] for word in rest):
        if new := new_name(verb, option):
            return f"the option {option} of {verb} is now {new}; see vibrissa {verb} --help"
        if near := near_name(option, taken):
            return f"{verb} has no option {option}; did you mean {near}?"
    return ""


def _unread(error: BaseException | None) -> str:
    """Message of a reader of ours, which the parser wraps in its own; nothing if there is none."""
    while error is not None and not isinstance(error, InputError):
        error = error.__cause__ or error.__context__
    return "" if error is None else str(error)


def _too_many(word: str, words: Sequence[str]) -> str:
    """Message for an unexpected word: a point may have been written with a blank in it."""
    place = words.index(word) if word in words else 0
    option = words[place - 2] if place > 1 else ""
    if option in POINTS:
        return f"{option} must be {POINTS[option]} in one word, got {words[place - 1]!r} and {word!r}"
    return f"{word.strip()!r} is unexpected; see --help"
