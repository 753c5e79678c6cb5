"""A figure that a notebook draws when it is the value of a cell, without a window or pyplot."""

from __future__ import annotations

import base64
import html
import io

from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """A figure of matplotlib that IPython shows as a picture, its caption as text below.

    Attributes
    ----------
    caption : str
        What is seen; empty where there is none.
    """

    caption: str = ""

    def _repr_png_(self) -> bytes:
        """The picture, as IPython asks for it."""
        picture = io.BytesIO()
        self.savefig(picture, format="png", dpi=100)
        return picture.getvalue()

    def _repr_html_(self) -> str | None:
        """Picture and caption, as IPython asks for them; nothing without a caption: then the picture is enough."""
        if not self.caption:
            return None
        picture = base64.b64encode(self._repr_png_()).decode()
        words = html.escape(self.caption)
        return f'<figure><img src="data:image/png;base64,{picture}"><figcaption>{words}</figcaption></figure>'
