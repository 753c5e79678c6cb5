"""The page's controls: what may be set, its bounds and how it is shown. Page and checks read this one table."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from vibrissa.whisker import DENSITY, YOUNGS_MODULUS, atlas

TEXTURES = {
    "random": "random grating (no memory)",
    "widths": "random grating (Gaussian widths)",
    "periodic": "periodic grating",
    "rough": "self-affine roughness",
    "wave": "smooth wave",
    "file": "dropped file",
}
HOLDS = {"height": "pad-to-substrate distance H", "contact": "contact ε along the shaft"}
GRATINGS, RANDOM = ("random", "widths", "periodic"), ("random", "widths", "rough")


@dataclass(frozen=True, kw_only=True)
class Control:
    """One control.

    Attributes
    ----------
    label : str
        What it is, with its symbol.
    default : float or str
        In SI, or one of the choices.
    group : str
        Heading under which it stands.
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
    default: float | str
    group: str
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    unit: str = ""
    scale: float = 1.0
    choices: dict[str, str] = field(default_factory=dict)
    only: dict[str, tuple[str, ...]] = field(default_factory=dict)
    whole: bool = False


def _number(
    label: str, group: str, default: float, low: float, high: float, step: float, unit: str = "", scale: float = 1.0
) -> dict[str, Any]:
    return {
        "label": label, "group": group, "default": default, "low": low, "high": high, "step": step, "unit": unit,
        "scale": scale,
    }  # fmt: skip


def _texture(letter: str, seed: int) -> dict[str, Control]:
    """Controls of one of the two textures."""
    group = f"Texture {letter.upper()}"

    def control(name: str, kinds: tuple[str, ...], **what: Any) -> tuple[str, Control]:
        return f"{letter}.{name}", Control(**what, only={f"{letter}.kind": kinds})

    kind = Control(label="Kind", group=group, default="random", choices=TEXTURES)
    made = tuple(name for name in TEXTURES if name != "file")
    return {
        f"{letter}.kind": kind,
        **dict(
            [
                control("seed", RANDOM, **_number("Seed", group, seed, 0, 2**32 - 1, 1), whole=True),
                control("length", made, **_number("Length", group, 0.04, 0.005, 0.35, 0.005, "mm", 1e3)),
                control(
                    "period",
                    (*GRATINGS, "wave"),
                    **_number("Mean period", group, 0.6e-3, 0.1e-3, 0.01, 5e-5, "mm", 1e3),
                ),
                control("duty", ("periodic",), **_number("Gap over period", group, 0.5, 0.05, 0.95, 0.05)),
                control("depth", GRATINGS, **_number("Depth", group, 35e-6, 1e-6, 1e-3, 1e-6, "µm", 1e6)),
                control("rms", ("rough",), **_number("Roughness rms", group, 5e-6, 1e-7, 1e-4, 5e-7, "µm", 1e6)),
                control("amplitude", ("wave",), **_number("Amplitude", group, 20e-6, 1e-7, 1e-3, 1e-6, "µm", 1e6)),
                control("file", ("file",), label="File", group=group, default=""),
            ]
        ),
    }


def _whisker() -> dict[str, Control]:
    names = {entry.name: entry.name for entry in atlas() if entry.n_cone}
    own: dict[str, tuple[str, ...]] = {"whisker": ("own",)}
    group = "Whisker"
    return {
        "whisker": Control(label="Whisker", group=group, default="own", choices={"own": "own numbers", **names}),
        "length": Control(**_number("Length of the cone L", group, 0.04, 0.005, 0.1, 5e-4, "mm", 1e3), only=own),
        "cone_angle": Control(**_number("Cone angle α", group, 1.5e-3, 2e-4, 0.01, 5e-5, "mrad", 1e3), only=own),
        "tip": Control(**_number("Tip, over L", group, 0.05, 0.0, 0.9, 0.01), only=own),
        "youngs_modulus": Control(
            **_number("Young's modulus E", group, YOUNGS_MODULUS, 1e8, 2e11, 1e8, "GPa", 1e-9), only=own
        ),
        "density": Control(**_number("Density ρ", group, DENSITY, 100.0, 2e4, 10.0, "kg/m³"), only=own),
    }


def _rest() -> dict[str, Control]:
    posture, scan, unit = "Posture", "Scan", "Neuron"
    return {
        "hold": Control(label="Held by", group=posture, default="height", choices=HOLDS),
        "height": Control(
            **_number("Distance H", group=posture, default=0.0185, low=1e-3, high=0.1, step=1e-4, unit="mm", scale=1e3),
            only={"hold": ("height",)},
        ),
        "contact": Control(
            **_number("Contact ε", group=posture, default=0.29, low=0.02, high=0.95, step=0.005),
            only={"hold": ("contact",)},
        ),
        "base_angle": Control(**_number("Base angle θ_b", posture, 1.2, 0.05, 1.55, 0.01, "rad")),
        "friction": Control(**_number("Friction μ", posture, 0.4, 0.0, 2.0, 0.02)),
        "speed": Control(**_number("Scanning speed v", scan, 0.1, 0.01, 1.0, 0.005, "mm/s", 1e3)),
        "damping": Control(**_number("Damping ζ", scan, 0.11, 0.0, 0.9, 0.01)),
        "threshold": Control(**_number("Threshold of the envelope", unit, 8e-6, 0.0, 1e-3, 5e-7, "µm", 1e6)),
        "slope": Control(**_number("Slope", unit, 2.5e6, 0.0, 1e9, 1e5, "spikes/s per µm", 1e-6)),
        "baseline": Control(**_number("Baseline", unit, 5.0, 0.0, 200.0, 0.5, "spikes/s")),
    }


CONTROLS: dict[str, Control] = {**_whisker(), **_rest(), **_texture("a", 1), **_texture("b", 2)}


def as_table() -> dict[str, dict[str, Any]]:
    """The controls as plain values, for the page."""
    return {name: asdict(control) for name, control in CONTROLS.items()}
