"""What units code: surround maps, demodulation, drives, kernels, information."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity


def _ends(name: str, dims: tuple[str, ...], unit: str, long_name: str) -> dict[str, Quantity]:
    """A number and the ends of its 95 % interval."""
    return {
        name: Quantity(dims, unit, long_name),
        f"{name}_low": Quantity(dims, unit, f"{long_name}, lower end of the 95 % interval"),
        f"{name}_high": Quantity(dims, unit, f"{long_name}, upper end of the 95 % interval"),
    }


def _information(name: str, unit: str, long_name: str) -> dict[str, Quantity]:
    """An information, corrected with its interval, as counted, and by extrapolation."""
    return _ends(name, ("unit",), unit, long_name) | {
        f"{name}_plain": Quantity(("unit",), unit, f"{long_name}, as counted"),
        f"{name}_extrapolated": Quantity(("unit",), unit, f"{long_name}, extrapolated to many trials"),
    }


CODING: dict[str, Quantity] = {
    # information
    **_information("spike_information", "bit", "information of one spike about the time in the stimulus"),
    **_information("information_rate", "bit/s", "information of single spikes about the time in the stimulus"),
    **_information("count_information", "bit", "information of the count in a bin about the time in the stimulus"),
    "informative": Quantity(("unit",), "1", "whether spikes tell of the stimulus beyond their interval of error"),
}
