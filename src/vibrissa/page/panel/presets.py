"""States to start from: each shows one thing, and the first is free of caveats."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Preset:
    """A state with its name.

    Attributes
    ----------
    name : str
        As on its button.
    about : str
        One sentence: what to look at.
    state : dict
        Controls that differ from their defaults.
    """

    name: str
    about: str
    state: dict[str, float | str]


CLEAN: dict[str, float | str] = {
    "hold": "contact",
    "contact": 0.29,
    "tip": 0.29,  # nothing of the shaft lies beyond the contact
    "base_angle": 0.6,  # up to here the modes of the straight shaft hold
    "threshold": 4e-6,  # a third of the largest envelope, so that the neuron follows it
    "slope": 1e7,
}
ROUGH = {"a.kind": "rough", "b.kind": "rough"}
PRESETS = (
    Preset(
        "Tip contact",
        "A whisker that ends where it touches: at each gap it is let go and rings, and a neuron answers the ringing.",
        CLEAN,
    ),
    Preset(
        "Long free end",
        "The same whisker uncut, computed as a whole (rod): the 9.6 mm beyond the contact bridge the gaps, and nine "
        "tenths of the vibration are gone.",
        {**CLEAN, "tip": 0.05, "model": "rod"},
    ),
    Preset(
        "Smooth against rough",
        "Texture A is a tenth as rough as texture B: listen to both, and compare their rates in the last picture.",
        {**CLEAN, **ROUGH, "a.rms": 5e-7, "b.rms": 5e-6},
    ),
    Preset(
        "Long whisker",
        "A whisker of 55 mm rings slowly; the short one, of the same shape, rings 2.5 times as fast.",
        {**CLEAN, "length": 0.055, "cone_angle": 2.4e-3},
    ),
    Preset(
        "Short whisker",
        "The same shape with 22 mm rings 2.5 times as fast as with 55 mm.",
        {**CLEAN, "length": 0.022, "cone_angle": 2.4e-3},
    ),
    Preset(
        "Paper: one gap",
        "Gaps of 0.6 mm every 10 mm, as in Figure 2 of the paper: at each the whisker rings. The paper leaves the free "
        "end out, hence the red verdict.",
        {"hold": "height", "a.kind": "periodic", "a.period": 0.01, "a.duty": 0.06, "b.kind": "periodic"},
    ),
    Preset(
        "Paper: random grating",
        "Random gaps, 0.6 mm apart on average, as in Figure 3 of the paper, at one of its postures. The paper leaves "
        "the free end out, hence the red verdict.",
        {"hold": "height"},
    ),
)


def as_list() -> list[dict[str, Any]]:
    """The presets as plain values, for the page."""
    return [asdict(preset) for preset in PRESETS]
