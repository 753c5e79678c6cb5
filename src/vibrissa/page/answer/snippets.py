"""The state as a command and as Python: each makes the numbers of data.nc again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import TYPE_CHECKING

from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.page.session import ROUGH_SPACING
from vibrissa.page.shaft_table import NODE

if TYPE_CHECKING:
    from vibrissa.mechanics.scan.sampled import Predicted
    from vibrissa.page.panel.state import Choice, PageState

TEXTURE, DATA = "vibrissa-texture.csv", "vibrissa-scan.nc"  # the first as the page gives it


def command(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """Line for a shell: `vibrissa scan` of the texture that the page gives.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        Of the state.
    state : PageState
        Values of the controls.
    letter : {"a", "b"}
        Which texture.

    Returns
    -------
    bytes
        The line.
    """
    whisker, posture, scan = prediction.whisker, prediction.posture, prediction.scan
    numbers = {f"whisker.{name.replace('_', '-')}": value for name, value in vars(whisker).items()}
    numbers |= {"contact": posture.contact, "base-angle": posture.base_angle, "friction": posture.friction}
    numbers |= {"speed": scan.speed, "damping": scan.damping, "node": NODE}
    words = ["vibrissa", "scan", TEXTURE, *(["--model", "rod"] if state.whole else [])]
    for name, value in numbers.items():
        words += [f"--{name}", repr(float(value))]
    if not isinstance(prediction, Prediction):
        words += ["--levelling", "none"]
    return (shlex.join([*words, "--out", DATA]) + "\n").encode()


def script(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """Python that makes the same scan.

    Parameters
    ----------
    prediction, state, letter
        As in :func:`command`.

    Returns
    -------
    bytes
        The lines.
    """
    posture, scan = prediction.posture, prediction.scan
    cone = {name: float(value) for name, value in vars(prediction.whisker).items()}
    held = {name: float(getattr(posture, name)) for name in ("contact", "base_angle", "friction")}
    model = ', model="rod"' if state.whole else ""
    lines = [
        "import vibrissa as vb",
        "",
        f"whisker = vb.Whisker({_named(cone)})",
        f"posture = vb.Posture({_named(held)})",
        f"surface = {_surface(prediction, state.texture(letter))}",
        f"motion = vb.scan(whisker, posture, surface, speed={scan.speed!r}, damping={scan.damping!r}{model})",
        f"data = motion.sample(20000.0, nodes=[{NODE!r}])",
        "print(data.displacement)",
    ]
    return ("\n".join(lines) + "\n").encode()


def _surface(prediction: Predicted, choice: Choice) -> str:
    """Call that makes the texture; waves and dropped files are read from the file that the page gives."""
    if choice.kind in ("random", "widths"):
        reading = "telegraph" if choice.kind == "random" else "widths"
        numbers = {"rng": choice.seed, "reading": reading, "mean_period": choice.period, "depth": choice.depth}
        return f"vb.random_grating({choice.length!r}, {_named(numbers)})"
    if choice.kind == "periodic":
        numbers = {"period": choice.period, "width": choice.duty * choice.period, "depth": choice.depth}
        return f"vb.periodic_grating({choice.length!r}, {_named(numbers)})"
    if choice.kind == "rough":
        numbers = {"rng": choice.seed, "rms": choice.rms, "spacing": ROUGH_SPACING}
        return f"vb.self_affine({choice.length!r}, {_named(numbers)})"
    level = "" if isinstance(prediction, Prediction) else ', levelling="none"'
    return f'vb.read_surface("{TEXTURE}"{level})  # texture.csv under "Take away"'


def _named(values: Mapping[str, object]) -> str:
    return ", ".join(f"{name}={value!r}" for name, value in values.items())
