"""The verb `explore`: the interactive page."""

from __future__ import annotations

import webbrowser

from vibrissa.cli.shared.display.output import tell


def explore(state: str = "", *, port: int = 0, browser: bool = True) -> None:
    """Explore a whisker on its texture on a local page: change it, see and hear the motion, download the data.

    Parameters
    ----------
    state
        State in which the page starts: an address copied from it, or the part after the #.
    port
        Port of 127.0.0.1; a free one by default.
    browser
        Open the page in the browser.
    """
    from urllib.parse import parse_qsl

    from vibrissa.page.server import serve

    given = dict(parse_qsl(state.rpartition("#")[2], keep_blank_values=True))
    serve(given, port=port, tell=tell, opened=webbrowser.open if browser else None)
