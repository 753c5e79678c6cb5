"""A figure that a notebook draws when it is the value of a cell, without a window or pyplot."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """A figure of matplotlib that IPython shows as a picture."""

    def _repr_png_(self) -> bytes:
        """The picture, as IPython asks for it."""
        picture = io.BytesIO()
        self.savefig(picture, format="png", dpi=100)
        return picture.getvalue()
