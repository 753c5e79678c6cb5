"""The directive ``pictured``: a PNG of these pages with the caption that its file carries, as text below it.

A figure of the package has its caption in the metadata of the PNG (``Description``), as ``vibrissa figure`` writes it:
the code of the figure is the one place of the caption.

    ```{pictured} two-channels.png
    ```
"""

from pathlib import Path

from docutils import nodes
from PIL import Image
from sphinx.util.docutils import SphinxDirective


def caption(path):
    """Caption that a picture carries; empty where it has none."""
    with Image.open(path) as picture:
        return picture.info.get("Description", "")


class Pictured(SphinxDirective):
    """Picture and caption; a line of text where the picture was not made."""

    required_arguments = 1

    def run(self):
        """Give the figure."""
        (name,) = self.arguments
        if "_build/gallery/" in name:
            self.env.events.emit("figures-wanted")
        path = Path(self.env.srcdir, Path(self.env.docname).parent, name)
        if not path.exists():
            return [nodes.paragraph("", "", nodes.emphasis(text="(left out of this build)"))]
        self.env.note_dependency(str(path))
        words = caption(path)
        image = nodes.image(uri=name, alt=words.partition(". ")[0])
        figure = nodes.figure("", image)
        if words:
            figure += nodes.caption(words, words)
        return [figure]


def setup(app):
    """Register the directive."""
    app.add_directive("pictured", Pictured)
    return {"parallel_read_safe": True}
