"""What a movie of the rod shows: the shaft, the ground under it, the contacts, the moment at the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vibrissa.arrays import Array, Integers
from vibrissa.mechanics.rod.kernels.ground import Ground
from vibrissa.mechanics.rod.rod_model import RodRecord
from vibrissa.mechanics.scan.follicle import force_unit
from vibrissa.whisker import Whisker


@dataclass(frozen=True)
class RodFilm:
    """The rod along time, in the frame in which its base is (or was at first) at rest.

    Attributes
    ----------
    time : (T,) array
        [s].
    shaft : (T, N + 1, 2) array
        Places of the nodes [m].
    ground : (P, 2) array
        Corners of the ground, in its own frame [m].
    shift : (T, 2) array
        Where the origin of the ground is [m].
    contacts : (T, 2, 2) array
        The contact nearest to the base and that nearest to the tip [m]; NaN without contact.
    state : (T,) array
        Numbers of ``vibrissa.mechanics.rod.rod_states.STATES``.
    moment : (T,) array
        At the base [N m].
    """

    time: Array
    shaft: Array
    ground: Array
    shift: Array
    contacts: Array
    state: Integers
    moment: Array


def film_of(
    whisker: Whisker, time: Array, record: RodRecord, ground: Ground, s: Array, shift: Array, state: Integers
) -> RodFilm:
    """Film of a record that holds the shapes.

    Parameters
    ----------
    whisker : Whisker
        Gives the units.
    time : (T,) array
        [s].
    record : RodRecord
        With its shapes.
    ground : Ground
        Under the rod.
    s : (N + 1,) array
        Nodes.
    shift : (T, 2) array
        Where the ground's origin is, over L.
    state : (T,) array
        Of the contacts.

    Returns
    -------
    RodFilm
        In metres.
    """
    length, nodes = whisker.length, record.shapes[:, :-1].reshape(time.size, -1, 2)
    contacts = np.full((time.size, 2, 2), np.nan)
    for k, touches in enumerate(record.contact[4] > 0):
        for which, place in enumerate(record.contact[[3, 2], k]):  # from the base: the larger s first
            if touches:
                contacts[k, which] = [np.interp(place, s, nodes[k, :, axis]) for axis in range(2)]
    return RodFilm(
        time=time,
        shaft=length * nodes,
        ground=length * np.stack([ground.x, ground.y], axis=1),
        shift=length * shift,
        contacts=length * contacts,
        state=state,
        moment=force_unit(whisker) * length * record.moment,
    )
