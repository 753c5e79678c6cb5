"""Nodes of the rod: fine where contacts are expected, coarser away from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrissa.arrays import Array
from vibrissa.errors import RangeError

REACH = 0.03  # of the fine part to both sides of the contact, over L


class Fineness(NamedTuple):
    """How fine the mesh is.

    Attributes
    ----------
    finest : float
        Distance between nodes about the contact, over L.
    coarsest : float
        Largest distance, towards the base; towards the tip a third of it.
    growth : float
        By how much the distance grows for each unit of distance from the fine part.
    """

    finest: float = 2e-3
    coarsest: float = 0.03
    growth: float = 0.15

    def refined(self, factor: float) -> Fineness:
        """The same mesh with cells smaller by a factor.

        Parameters
        ----------
        factor : float
            Above 1 for smaller cells.

        Returns
        -------
        Fineness
            The finer mesh.
        """
        return Fineness(self.finest / factor, self.coarsest / factor, self.growth / factor)


USUAL = Fineness()


def graded_nodes(tip: float, contact: float, fineness: Fineness, reach: float = REACH) -> Array:
    """Positions of the nodes along the shaft, from the physical tip to the base.

    Parameters
    ----------
    tip, contact : float
        Physical tip and contact, over L.
    fineness : Fineness
        How fine.
    reach : float
        Of the fine part to both sides of the contact, over L.

    Returns
    -------
    (N + 1,) array
        s of the nodes, ascending; one lies on the contact, the first on the tip, the last is 1.

    Raises
    ------
    InputError
        If the tip lies beyond the contact.
    """
    if not 0 <= tip < contact:
        raise RangeError("Whisker.tip", f"must lie below the contact {contact:g}", tip, "nothing would touch")
    down = _way(contact - tip, fineness._replace(coarsest=fineness.coarsest / 3), reach)
    up = _way(1 - contact, fineness, reach)
    nodes = np.concatenate([contact - down[:0:-1], contact + up])
    nodes[0], nodes[-1] = tip, 1.0
    return nodes


def _way(length: float, fineness: Fineness, reach: float) -> Array:
    """Distances from the contact, 0 to the length, stretched so that the last is the length."""
    places = [0.0]
    while places[-1] < length * (1 - 1e-12):
        beyond = max(0.0, places[-1] - reach)
        places.append(places[-1] + min(fineness.coarsest, fineness.finest + beyond * fineness.growth))
    return np.array(places) * (length / places[-1])
