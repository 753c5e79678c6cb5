"""A texture in another order: same gaps, same lands, for what chance would give."""

from __future__ import annotations

import numpy as np

from vibrissa.texture.surface import Gaps


def shuffled(texture: Gaps, rng: np.random.Generator) -> Gaps:
    """Texture of the same gaps and lands in another order, gaps and lands drawn apart.

    Of a grating whose widths are independent this is another grating of its statistics; it starts and ends where the
    first does.

    Parameters
    ----------
    texture : Gaps
        What was scanned.
    rng : numpy.random.Generator
        Draws the order.

    Returns
    -------
    Gaps
        As many gaps, as deep.
    """
    land = texture.position[1:] - texture.end[:-1]
    width = rng.permutation(texture.width)
    before = np.append(texture.position[0], rng.permutation(land))
    end = np.cumsum(width + before)
    return Gaps(position=end - width, width=width, depth=texture.depth)
