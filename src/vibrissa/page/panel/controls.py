"""The page's controls: what may be set, its bounds and how it is shown. Page and checks read this one table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from vibrissa.page.panel.glossary import about
from vibrissa.whisker import DAMPING, DENSITY, YOUNGS_MODULUS, atlas

TEXTURES = {
    "random": "random grating (no memory)",
    "widths": "random grating (Gaussian widths)",
    "periodic": "periodic grating",
    "rough": "self-affine roughness",
    "wave": "smooth wave",
    "file": "dropped file",
}
HOLDS = {"height": "pad-to-substrate distance H", "contact": "contact ε along the shaft"}
MODELS = {"contact": "one contact (at once)", "rod": "whole whisker (rod, seconds)"}
GRATINGS, RANDOM = ("random", "widths", "periodic"), ("random", "widths", "rough")


@dataclass(frozen=True)
class Control:
    """One control.

    Attributes
    ----------
    label : str
        Name of the quantity, with its symbol.
    group : str
        Heading under which it is shown.
    default : float or str
        In SI, or one of the choices.
    low, high : float
        Bounds [SI].
    step : float
        Of the slider [SI].
    unit : str
        As shown.
    scale : float
        Shown number over SI.
    choices : dict
        Names and what they mean, if it is a choice.
    only : dict
        Shown only where these other controls have one of these values.
    whole : bool
        Whether it must be an integer.
    """

    label: str
    group: str
    default: float | str
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    unit: str = ""
    scale: float = 1.0
    choices: Mapping[str, str] = field(default_factory=dict)
    only: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    whole: bool = False


def _texture(letter: str, seed: int) -> dict[str, Control]:
    """Controls of one of the two textures."""
    group = f"Texture {letter.upper()}"

    def only(*kinds: str) -> dict[str, tuple[str, ...]]:
        return {f"{letter}.kind": kinds}

    made = only(*(kind for kind in TEXTURES if kind != "file"))
    period = only(*GRATINGS, "wave")
    controls = {
        "kind": Control("Kind", group, "random", choices=TEXTURES),
        "seed": Control("Seed", group, seed, 0, 2**32 - 1, 1, only=only(*RANDOM), whole=True),
        "length": Control("Length", group, 0.04, 0.005, 0.35, 0.005, "mm", 1e3, only=made),
        "period": Control("Mean period", group, 0.6e-3, 0.1e-3, 0.01, 5e-5, "mm", 1e3, only=period),
        "duty": Control("Gap over period", group, 0.5, 0.05, 0.95, 0.05, only=only("periodic")),
        "depth": Control("Depth", group, 35e-6, 1e-6, 1e-3, 1e-6, "µm", 1e6, only=only(*GRATINGS)),
        "rms": Control("Roughness rms", group, 5e-6, 1e-7, 1e-4, 5e-7, "µm", 1e6, only=only("rough")),
        "amplitude": Control("Amplitude", group, 20e-6, 1e-7, 1e-3, 1e-6, "µm", 1e6, only=only("wave")),
        "file": Control("File", group, "", only=only("file")),
    }
    return {f"{letter}.{name}": control for name, control in controls.items()}


def _whisker() -> dict[str, Control]:
    names = {entry.name: entry.name for entry in atlas() if entry.n_cone}
    group, own = "Whisker", {"whisker": ("own",)}
    return {
        "whisker": Control("Whisker", group, "own", choices={"own": "own numbers", **names}),
        "length": Control("Length of the cone L", group, 0.04, 0.005, 0.1, 5e-4, "mm", 1e3, only=own),
        "cone_angle": Control("Cone angle α", group, 1.5e-3, 2e-4, 0.01, 5e-5, "mrad", 1e3, only=own),
        "tip": Control("Tip, over L", group, 0.05, 0.0, 0.9, 0.01, only=own),
        "youngs_modulus": Control("Young's modulus E", group, YOUNGS_MODULUS, 1e8, 2e11, 1e8, "GPa", 1e-9, only=own),
        "density": Control("Density ρ", group, DENSITY, 100.0, 2e4, 10.0, "kg/m³", only=own),
    }


def _rest() -> dict[str, Control]:
    posture, scan, unit = "Posture", "Scan", "Neuron"
    height, contact = {"hold": ("height",)}, {"hold": ("contact",)}
    return {
        "hold": Control("Held by", posture, "height", choices=HOLDS),
        "height": Control("Distance H", posture, 0.0185, 1e-3, 0.1, 1e-4, "mm", 1e3, only=height),
        "contact": Control("Contact ε", posture, 0.29, 0.02, 0.95, 0.005, only=contact),
        "base_angle": Control("Base angle θ_b", posture, 1.2, 0.05, 1.55, 0.01, "rad"),
        "friction": Control("Friction μ", posture, 0.4, 0.0, 2.0, 0.02),
        "speed": Control("Scanning speed v", scan, 0.1, 0.01, 1.0, 0.005, "mm/s", 1e3),
        "damping": Control("Damping ζ", scan, DAMPING, 0.0, 0.9, 0.01),
        "model": Control("Model", scan, "contact", choices=MODELS),
        "threshold": Control("Threshold of the envelope", unit, 8e-6, 0.0, 1e-3, 5e-7, "µm", 1e6),
        "slope": Control("Slope", unit, 2.5e6, 0.0, 1e9, 1e5, "spikes/s per µm", 1e-6),
        "baseline": Control("Baseline", unit, 5.0, 0.0, 200.0, 0.5, "spikes/s"),
    }


CONTROLS: dict[str, Control] = {**_whisker(), **_rest(), **_texture("a", 1), **_texture("b", 2)}


def as_table() -> dict[str, dict[str, Any]]:
    """The controls as plain values, for the page."""
    return {name: {**asdict(control), "about": about(name)} for name, control in CONTROLS.items()}
