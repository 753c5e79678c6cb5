"""Draw the rooms of the package, as the contract of pyproject.toml lists them, to docs/layers.svg.

python docs/make_layers.py
"""

import tomllib
from pathlib import Path
from xml.sax.saxutils import escape

DOCS = Path(__file__).parent
WIDTH, HEIGHT, GAP = 640, 30, 10  # of a row, and between rows [pixels]
FILL, LINE, INK, ARROW = "#e8eef4", "#5b7083", "#1c2833", "#8a97a3"


def layers():
    """Give the rows from the top, each a list of rooms."""
    contracts = tomllib.loads((DOCS.parent / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    rows = next(contract["layers"] for contract in contracts if contract["id"] == "rooms")
    return [[room.strip(" ()") for room in row.split("|")] for row in rows]


def picture():
    """Give the picture: a row of boxes for each layer; imports go downwards alone."""
    rows = layers()
    height = len(rows) * (HEIGHT + GAP) + GAP
    boxes = "\n".join(row_of(rooms, GAP + i * (HEIGHT + GAP)) for i, rooms in enumerate(rows))
    x, end = WIDTH + 26, height - GAP - 8
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH + 110} {height}" role="img" '
        f'font-family="monospace" font-size="14">\n<title>Rooms of vibrissa; imports go downwards alone</title>\n'
        f"{boxes}\n"
        f'<path d="M{x} {GAP} V{end} m-6 -8 l6 8 l6 -8" fill="none" stroke="{ARROW}" stroke-width="2"/>\n'
        f'<text x="{x + 12}" y="{height / 2:g}" fill="{ARROW}">imports</text>\n</svg>\n'
    )


def row_of(rooms, top):
    """Give the boxes of one row."""
    wide = (WIDTH - GAP * (len(rooms) - 1)) / len(rooms)
    return "\n".join(
        f'<rect x="{GAP + i * (wide + GAP):g}" y="{top}" width="{wide:g}" height="{HEIGHT}" rx="4" fill="{FILL}" '
        f'stroke="{LINE}"/><text x="{GAP + i * (wide + GAP) + wide / 2:g}" y="{top + 20}" text-anchor="middle" '
        f'fill="{INK}">{escape(room)}</text>'
        for i, room in enumerate(rooms)
    )


if __name__ == "__main__":
    (DOCS / "layers.svg").write_text(picture(), encoding="utf-8")
