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
    Preset("Tip contact", "The tip alone touches the grating, and every assumption of the model holds.", CLEAN),
    Preset(
        "Long free end",
        "The same whisker uncut: 9.6 mm lie beyond the contact and bridge the gaps, so this model, which has one "
        "contact, is wrong here; vibrissa scan --model rod computes the whole shaft.",
        {**CLEAN, "tip": 0.05},
    ),
    Preset(
        "Smooth against rough",
        "Texture A is a tenth as rough as texture B: play both, and compare their rates under A or B.",
        {**CLEAN, **ROUGH, "a.rms": 5e-7, "b.rms": 5e-6},
    ),
    Preset(
        "Long whisker",
        "55 mm: the resonances are low. Compare the short one.",
        {**CLEAN, "length": 0.055, "cone_angle": 2.4e-3},
    ),
    Preset(
        "Short whisker",
        "22 mm: the same shape rings 2.5 times as fast as the long one.",
        {**CLEAN, "length": 0.022, "cone_angle": 2.4e-3},
    ),
    Preset(
        "Paper: one gap",
        "Gaps of 0.6 mm every 10 mm, as in Figure 2: the contact is held by an edge, jumps, and the whisker rings.",
        {"hold": "height", "a.kind": "periodic", "a.period": 0.01, "a.duty": 0.06, "b.kind": "periodic"},
    ),
    Preset(
        "Paper: random grating",
        "Random gaps, 0.6 mm apart on average, as in Figure 3, at a posture of the paper.",
        {"hold": "height"},
    ),
)


def as_list() -> list[dict[str, Any]]:
    """The presets as plain values, for the page."""
    return [asdict(preset) for preset in PRESETS]
