"""What is taken away from the page: data, sound, picture, texture, and the study file that makes the same."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.mechanics.sampled import sampling_times, scanned
from vibrissa.mechanics.superposition import Prediction
from vibrissa.mechanics.topography import scanned_relief
from vibrissa.page.bench import MODES
from vibrissa.page.picture import drawn
from vibrissa.page.signals import NODE, TRIALS, live_arrays, node_motion
from vibrissa.study.pick import as_toml
from vibrissa.texture.io import write_relief, write_troughs

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.page.bench import Bench, Motion
    from vibrissa.page.state import State

RATE = 20_000.0  # [Hz] of data and sound, as `vibrissa scan`
LOUD = 0.9  # of full scale: the loudest sample
FRAME_RATE, LEAST_FRAMES = 2000.0, 100  # [Hz] of the study's virtual camera
COLUMNS = ("excursion", "base_curvature", "base_moment", "transverse_force")

KINDS = {
    "data.nc": "application/x-netcdf",
    "signals.csv": "text/csv",
    "sound.wav": "audio/wav",
    "study.toml": "application/toml",
    "texture.csv": "text/csv",
    "picture.png": "image/png",
    "picture.svg": "image/svg+xml",
}


def exported(bench: Bench, state: State, letter: str, name: str) -> bytes:
    """One file.

    Parameters
    ----------
    bench, state
        What is set, and what makes it.
    letter : {"a", "b"}
        Which texture.
    name : str
        One of ``KINDS``.

    Raises
    ------
    InputError
        If the state is beyond the mechanics, or a study file cannot say it.
    """
    prediction = bench.predict(state, letter)
    return MAKERS[name](prediction, state, letter)


def _dataset(prediction: Motion) -> xr.Dataset:
    """The whole scan at 20 kHz, as `vibrissa scan --node 0.005` gives it."""
    if isinstance(prediction, Prediction):
        return scanned(prediction, RATE, nodes=[NODE])
    return scanned_relief(prediction, RATE, nodes=[NODE])


def _netcdf(prediction: Motion, state: State, letter: str) -> bytes:
    return bytes(_dataset(prediction).to_netcdf(engine="h5netcdf"))


def _csv(prediction: Motion, state: State, letter: str) -> bytes:
    """Time and signals, with their units in the header; lengths in metres."""
    data, length = _dataset(prediction), prediction.whisker.length
    columns = {"time_s": data.time.values, "excursion_m": length * data.excursion.values}
    for i in range(data.sizes["mode"]):
        columns[f"mode_{i + 1}_m"] = length * data.mode_displacement.values[i]
        columns[f"envelope_{i + 1}_m"] = length * data.envelope.values[i]
    columns["base_curvature_per_m"] = data.base_curvature.values
    columns["base_moment_n_m"] = data.base_moment.values
    columns["displacement_m"] = data.displacement.values[:, 0]
    text = io.StringIO()
    np.savetxt(text, np.stack(list(columns.values()), axis=1), "%.9g", ",", header=",".join(columns), comments="")
    return text.getvalue().encode()


def _wave(prediction: Motion, state: State, letter: str) -> bytes:
    """Displacement 5 mm from the base, 16 bits, at true pitch; the loudest sample at 0.9 of full scale."""
    from scipy.io import wavfile

    moved, _ = node_motion(prediction, sampling_times(prediction, RATE))
    loud = np.abs(moved).max()
    samples: NDArray[np.int16] = np.rint(moved * (LOUD * 32767 / loud if loud else 0.0)).astype(np.int16)
    file = io.BytesIO()
    wavfile.write(file, int(RATE), samples)
    return file.getvalue()


def _texture(prediction: Motion, state: State, letter: str) -> bytes:
    """The texture as `vibrissa scan` reads it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "texture.csv"
        if isinstance(prediction, Prediction):
            write_troughs(prediction.texture, path)
        else:
            write_relief(prediction.relief, path)
        return path.read_bytes()


def _study(prediction: Motion, state: State, letter: str) -> bytes:
    """The study file of the same whisker, posture, scan, texture and neuron, filmed by the virtual camera."""
    choice, whisker, unit = state.texture(letter), prediction.whisker, state.unit
    if choice.kind not in ("random", "widths"):
        remedy = "take texture.csv and give it to vibrissa scan"
        raise InputError("study file", "can say random gratings only", choice.kind, remedy)
    reading = {"random": "telegraph", "widths": "widths"}[choice.kind]
    frames = max(LEAST_FRAMES, int(prediction.end * FRAME_RATE))
    table: dict[str, Any] = {
        "name": "From the page of vibrissa explore",
        "n_modes": MODES,
        "whisker": {name: float(value) for name, value in vars(whisker).items()},
        "posture": {name: getattr(prediction.posture, name) for name in ("contact", "base_angle", "friction")},
        "scan": {"speed": prediction.scan.speed, "damping": prediction.scan.damping, "response": "exact"},
        "texture": {
            "length": choice.length, "seed": choice.seed, "reading": reading, "mean_period": choice.period,
            "depth": choice.depth,
        },
        "film": {"n_frames": frames},
        "film.camera": {"frame_rate": FRAME_RATE},
        "recording": {"n_trials": TRIALS, "distance": NODE},
        "recording.unit": {name: getattr(unit, name) for name in ("threshold", "slope", "baseline", "latency")},
    }  # fmt: skip
    return as_toml(table).encode()


def _picture(prediction: Motion, state: State, letter: str, kind: str) -> bytes:
    file = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else {}  # equal states give equal files
    drawn(prediction, live_arrays(prediction, state.unit)).savefig(file, format=kind, dpi=150, metadata=metadata)
    return file.getvalue()


MAKERS: dict[str, Callable[[Motion, State, str], bytes]] = {
    "data.nc": _netcdf,
    "signals.csv": _csv,
    "sound.wav": _wave,
    "study.toml": _study,
    "texture.csv": _texture,
    "picture.png": lambda prediction, state, letter: _picture(prediction, state, letter, "png"),
    "picture.svg": lambda prediction, state, letter: _picture(prediction, state, letter, "svg"),
}
