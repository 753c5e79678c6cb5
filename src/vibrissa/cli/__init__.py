"""The command line: verbs in groups (mechanics, movies, spikes, studies), and what they share.

Others use :func:`main`, which runs a command line, and ``app``, which parses it. Each verb is a function of its group;
it imports heavy packages when it is called.

Internal: the public names are those of ``vibrissa`` itself.
"""

from __future__ import annotations

import sys
from functools import partial
from io import TextIOWrapper

from cyclopts import App, CycloptsError, Group, Parameter

from vibrissa import __version__
from vibrissa.cli import mechanics, movies, spikes, studies
from vibrissa.cli.shared.boundary import DEBUG, REFUSED, one_line_for_all
from vibrissa.cli.shared.display.output import tell
from vibrissa.cli.shared.overwriting import refuse_overwriting
from vibrissa.cli.shared.stoppable import stoppable
from vibrissa.cli.shared.words.refusals import as_typed
from vibrissa.cli.shared.words.units import with_negative
from vibrissa.cli.shared.words.usage import usage_line
from vibrissa.errors import InputError
from vibrissa.limits import cap_memory

app = App(
    name="vibrissa",
    help="From surface to spikes: how a rat's whisker feels fine texture.",
    help_epilogue="With --debug a verb that fails shows where. `vibrissa info` says what a report of a fault needs.",
    version=__version__,
    default_parameter=Parameter(negative_iterable=()),
)
for room in (mechanics, movies, spikes, studies):
    group = Group.create_ordered(room.GROUP)
    for verb in room.VERBS:
        app.command(verb, group=group, validator=partial(refuse_overwriting, verb))


def main() -> None:
    """Run the command line; what goes wrong is one line on stderr and exit code 2, or 1 for a fault of the package."""
    for stream in (sys.stdout, sys.stderr):
        _never_fails(stream)
    words = with_negative([word for word in sys.argv[1:] if word != DEBUG])
    with one_line_for_all(debug=DEBUG in sys.argv):
        try:
            cap_memory()
            with stoppable():
                app(words, print_error=False, exit_on_error=False)
        except CycloptsError as error:
            _refuse(usage_line(error, words, options_of(words[0]) if words and words[0] in app else ()))
        except InputError as error:
            if DEBUG in sys.argv:
                raise
            _refuse(str(as_typed(error, options_of(words[0]), words)))


def options_of(verb: str) -> set[str]:
    """The options that a verb takes.

    Parameters
    ----------
    verb : str
        Its name.

    Returns
    -------
    set of str
        ``--contact``, …
    """
    arguments = app[verb].assemble_argument_collection()
    return {name for one in arguments if not one.children for name in one.names if name.startswith("--")}


def _never_fails(stream: object) -> None:
    """Write ? for a letter that the terminal's encoding lacks, such as µ in ASCII."""
    if isinstance(stream, TextIOWrapper) and stream.errors in ("strict", "surrogateescape"):
        stream.reconfigure(errors="replace")


def _refuse(line: str) -> None:
    tell(line)
    sys.exit(REFUSED)
