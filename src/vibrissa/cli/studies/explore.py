"""The verb `explore`: the interactive page."""

from __future__ import annotations

import webbrowser

from vibrissa.cli.shared.output import tell


def explore(state: str = "", *, port: int = 0, browser: bool = True) -> None:
    """A page on this machine alone: a whisker on its texture, live; see it, hear it, take it away.

    Parameters
    ----------
    state
        What the page starts with: its address of an earlier time, or the part of it behind the #.
    port
        Port of 127.0.0.1; a free one by default.
    browser
        Open the page in the browser.
    """
    from urllib.parse import parse_qsl

    from vibrissa.page.server import serve

    given = dict(parse_qsl(state.rpartition("#")[2], keep_blank_values=True))
    serve(given, port=port, tell=tell, opened=webbrowser.open if browser else None)
