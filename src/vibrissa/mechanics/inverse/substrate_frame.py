"""The frame of the substrate in an image, given by a curve of Eq. 1 that lies in the image."""

from __future__ import annotations

import numpy as np

from vibrissa.arrays import Complex


class SubstrateFrame:
    """Real along the substrate towards the base, imaginary above it, 0 at the contact.

    Parameters
    ----------
    curve : (S,) array of complex
        Points x + iy of a fitted profile in the image, from the contact to the base; it leaves the contact along the
        substrate.
    """

    def __init__(self, curve: Complex) -> None:
        self._contact, self._along = curve[0], (curve[1] - curve[0]) / abs(curve[1] - curve[0])
        self._mirrored = bool(((curve[-1] - curve[0]) / self._along).imag < 0)

    def from_image(self, z: Complex) -> Complex:
        """Points of the image in this frame.

        Parameters
        ----------
        z : (N,) array of complex
            x + iy in the image.

        Returns
        -------
        (N,) array of complex
            In the same unit.
        """
        turned = (z - self._contact) / self._along
        return np.conj(turned) if self._mirrored else turned

    def to_image(self, z: Complex) -> Complex:
        """Points of this frame in the image.

        Parameters
        ----------
        z : (N,) array of complex
            Along the substrate and above it.

        Returns
        -------
        (N,) array of complex
            x + iy in the image.
        """
        return (np.conj(z) if self._mirrored else z) * self._along + self._contact
