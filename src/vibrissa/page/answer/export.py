"""Files that the page gives: data, sound, picture, texture, and the study file that makes the same."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import ConflictError
from vibrissa.mechanics.scan.sampled import sampling_times, scanned, scanned_relief
from vibrissa.mechanics.scan.texture_prediction import Prediction
from vibrissa.netcdf import encoded
from vibrissa.page.answer.picture import picture
from vibrissa.page.answer.snippets import command, script
from vibrissa.page.session import MODES
from vibrissa.page.shaft_table import NODE
from vibrissa.page.signals import TRIALS, live_arrays, node_motion
from vibrissa.page.whole.drawn import whole_arrays
from vibrissa.tables.writer import table_text
from vibrissa.texture.io import write_gaps, write_height_profile

if TYPE_CHECKING:
    import xarray as xr

    from vibrissa.arrays import Array
    from vibrissa.mechanics.scan.sampled import Predicted
    from vibrissa.page.panel.state import Choice, PageState
    from vibrissa.page.session import PageSession
    from vibrissa.study.spec.settings import Film

    Maker = Callable[[Predicted, PageState, str], bytes]

RATE = 20_000.0  # [Hz] of data and sound, as `vibrissa scan`
LOUD = 0.9  # of full scale: the loudest sample
FRAME_RATE, LEAST_FRAMES = 2000.0, 100  # [Hz] of the study's virtual camera
READINGS = {"random": "telegraph", "widths": "widths"}
FOLDER, BESIDE = "vibrissa-study", "texture.csv"  # in the archive: its folder, and the texture beside the study
THEN = (1980, 1, 1, 0, 0, 0)  # of every file in the archive: equal states give equal archives


def exported(session: PageSession, state: PageState, letter: str, name: str) -> bytes:
    """One file.

    Parameters
    ----------
    session : PageSession
        That makes the prediction.
    state : PageState
        Values of the controls.
    letter : {"a", "b"}
        Which texture.
    name : str
        One of ``KINDS``.

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    InputError
        If the state is beyond the mechanics.
    """
    if state.whole and name in WHOLE:
        return WHOLE[name](session, state, letter)
    _, make = KINDS[name]
    return make(session.predict(state, letter), state, letter)


def _dataset(prediction: Predicted) -> xr.Dataset:
    """The whole scan at 20 kHz, as `vibrissa scan --node 0.005` gives it."""
    if isinstance(prediction, Prediction):
        return scanned(prediction, RATE, nodes=[NODE])
    return scanned_relief(prediction, RATE, nodes=[NODE])


def _netcdf(prediction: Predicted, state: PageState, letter: str) -> bytes:
    return encoded(_dataset(prediction))


def _csv(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """Time and signals, with their units in the header; lengths in metres."""
    return _table(_dataset(prediction), prediction.whisker.length)


def _table(data: xr.Dataset, length: float) -> bytes:
    columns = {"time_s": data.time.values}
    if "excursion" in data:  # a rod has contacts, not one
        columns["excursion_m"] = length * data.excursion.values
    for i in range(data.sizes["mode"]):
        columns[f"mode_{i + 1}_m"] = length * data.mode_displacement.values[i]
        columns[f"envelope_{i + 1}_m"] = data.envelope.values[i]
    columns["base_curvature_per_m"] = data.base_curvature.values
    columns["base_moment_n_m"] = data.base_moment.values
    columns["displacement_m"] = data.displacement.values[:, 0]
    return table_text(columns, digits=9).encode()


def _wave(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """Displacement 5 mm from the base, 16 bits, at true pitch; the loudest sample at 0.9 of full scale."""
    return _sound(node_motion(prediction, sampling_times(prediction, RATE))[0])


def _sound(moved: Array) -> bytes:
    from scipy.io import wavfile

    loud = np.abs(moved).max()
    samples: NDArray[np.int16] = np.rint(moved * (LOUD * 32767 / loud if loud else 0.0)).astype(np.int16)
    file = io.BytesIO()
    wavfile.write(file, int(RATE), samples)
    return file.getvalue()


def _texture(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """The texture as `vibrissa scan` reads it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "texture.csv"
        if isinstance(prediction, Prediction):
            write_gaps(prediction.texture, path)
        else:
            write_height_profile(prediction.relief, path)
        return path.read_bytes()


def _study(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """An archive with the study file and, where it names one, its texture: unpacked it runs as it is."""
    files = {"study.toml": _settings(prediction, state, letter)}
    if state.texture(letter).kind not in READINGS:
        files[BESIDE] = _texture(prediction, state, letter)
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, content in files.items():
            entry = zipfile.ZipInfo(f"{FOLDER}/{name}", THEN)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            opened.writestr(entry, content)
    return archive.getvalue()


def _settings(prediction: Predicted, state: PageState, letter: str) -> bytes:
    """The study file of the same whisker, posture, scan, texture and neuron, filmed by the virtual camera."""
    # loaded when a study is wanted: codecs and schema take 50 MB of the page's memory
    from vibrissa.study.pick.pick import as_toml
    from vibrissa.study.spec.settings import Film

    posture, scan = prediction.posture, prediction.scan
    neuron, film = state.unit, Film(n_frames=max(LEAST_FRAMES, int(np.ceil(prediction.end * FRAME_RATE))))
    table: dict[str, Any] = {
        "name": "From the page of vibrissa explore",
        "n_modes": MODES,
        "whisker": {name: float(value) for name, value in vars(prediction.whisker).items()},
        "posture": {name: getattr(posture, name) for name in ("contact", "base_angle", "friction")},
        "scan": {"speed": scan.speed, "damping": scan.damping, "response": "exact"},
        "texture": _texture_table(prediction, state.texture(letter)),
        "film": {"n_frames": film.n_frames},
        "film.camera": {"frame_rate": FRAME_RATE, **_image(prediction, film)},
        "recording": {"n_trials": TRIALS, "distance": NODE},
        "recording.unit": {name: getattr(neuron, name) for name in ("threshold", "slope", "baseline", "latency")},
    }
    return as_toml(table).encode()


def _texture_table(prediction: Predicted, choice: Choice) -> dict[str, Any]:
    """A random grating by its seed, any other surface by its file."""
    if choice.kind in READINGS:
        numbers = {"length": choice.length, "seed": choice.seed, "mean_period": choice.period, "depth": choice.depth}
        return {**numbers, "reading": READINGS[choice.kind]}
    return {"file": BESIDE} | ({} if isinstance(prediction, Prediction) else {"level": "none"})


def _image(prediction: Predicted, film: Film) -> dict[str, int]:
    """Size of an image that holds the whisker [pixels], in twenties."""
    from vibrissa.study.movie.virtual import lay_out

    scene = lay_out(prediction, film)
    sizes = {"width": np.ptp(scene.x), "height": np.ptp(scene.y)}
    return {name: 20 * int(np.ceil(size / film.camera.pixel_size / 20) + 3) for name, size in sizes.items()}


def _picture(kind: Literal["png", "svg"], prediction: Predicted, state: PageState, letter: str) -> bytes:
    return picture(prediction, live_arrays(prediction, state.unit), kind)


def _sampled(session: PageSession, state: PageState, letter: str) -> xr.Dataset:
    """The scan of the whole whisker at 20 kHz, as `vibrissa scan --model rod --node 0.005` gives it."""
    found: xr.Dataset = session.whole.wait(session.whole_job(state, letter, sampled=True))
    return found


def _whole_netcdf(session: PageSession, state: PageState, letter: str) -> bytes:
    return encoded(_sampled(session, state, letter))


def _whole_csv(session: PageSession, state: PageState, letter: str) -> bytes:
    return _table(_sampled(session, state, letter), state.whisker.length)


def _whole_wave(session: PageSession, state: PageState, letter: str) -> bytes:
    moved = _sampled(session, state, letter).displacement.to_numpy()[:, 0]
    return _sound(moved - moved.mean())


def _whole_picture(kind: Literal["png", "svg"], session: PageSession, state: PageState, letter: str) -> bytes:
    job = session.whole_job(state, letter)
    scan = session.whole.wait(job)
    return picture(session.predict(state, letter), whole_arrays(scan, job, state.unit), kind, "whole whisker (rod); ")


def _whole_study(session: PageSession, state: PageState, letter: str) -> bytes:
    remedy = "copy the command or Python, or choose the other model"
    raise ConflictError("study.zip", "must be of one contact: a study does not film the whole whisker", remedy=remedy)


WHOLE: dict[str, Callable[[PageSession, PageState, str], bytes]] = {  # what else a state of the whole whisker gives
    "data.nc": _whole_netcdf,
    "signals.csv": _whole_csv,
    "sound.wav": _whole_wave,
    "study.zip": _whole_study,
    "picture.png": partial(_whole_picture, "png"),
    "picture.svg": partial(_whole_picture, "svg"),
}
KINDS: dict[str, tuple[str, Maker]] = {  # media type of each file, and what makes it
    "data.nc": ("application/x-netcdf", _netcdf),
    "signals.csv": ("text/csv", _csv),
    "sound.wav": ("audio/wav", _wave),
    "study.zip": ("application/zip", _study),
    "texture.csv": ("text/csv", _texture),
    "picture.png": ("image/png", partial(_picture, "png")),
    "picture.svg": ("image/svg+xml", partial(_picture, "svg")),
    "command.txt": ("text/plain", command),
    "script.py": ("text/plain", script),
}
