"""The page's views as one figure, to be kept."""

from __future__ import annotations

import io
from collections.abc import Mapping
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from vibrissa.figures.canvas import new_figure
from vibrissa.page.signals import RATE, TRIALS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vibrissa.mechanics.scan.sampled import Predicted

BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"  # modes 1 to 3, of Okabe and Ito
Arrays = Mapping[str, NDArray[np.float32]]


def picture(prediction: Predicted, arrays: Arrays, kind: Literal["png", "svg"], model: str = "") -> bytes:
    """The views as a file: whisker, excursion, modes, moment, spectrogram and firing; equal states give equal files.

    Parameters
    ----------
    prediction : Prediction or ReliefPrediction
        Whose posture is in the title.
    arrays : mapping
        Of :func:`vibrissa.page.signals.live_arrays`.
    kind : {"png", "svg"}
        Format.
    model : str
        Words before the title.

    Returns
    -------
    bytes
        The file.
    """
    from matplotlib import style

    file = io.BytesIO()
    with as_file(files("vibrissa.figures") / "style.mplstyle") as path, style.context([path, {"svg.hashsalt": "page"}]):
        metadata = {"Date": None} if kind == "svg" else {}
        _drawn(prediction, arrays, model).savefig(file, format=kind, dpi=150, metadata=metadata)
    return file.getvalue()


def _drawn(prediction: Predicted, arrays: Arrays, model: str) -> Figure:
    figure, grid = new_figure(10.0, 9.0, 4, 2)
    axes = grid.ravel()
    time = np.arange(len(arrays["excursion"])) / RATE
    _whisker(axes[0], prediction, arrays)
    _line(axes[1], time, arrays["excursion"] * 1e6, "Excursion d [µm]")
    for i, colour in enumerate((BLUE, VERMILION, GREEN)):
        _mode(axes[2 + i], i, colour, time, arrays)
    _line(axes[5], time, arrays["moment"] * 1e9, "Moment at the base [nN m]")
    _spectrogram(axes[6], arrays)
    _firing(axes[7], time, arrays)
    figure.suptitle(model + _title(prediction), fontsize=9 if not model else 8.5)
    return figure


def _title(prediction: Predicted) -> str:
    whisker, posture, scan = prediction.whisker, prediction.posture, prediction.scan
    height = prediction.response.flat.base[1] * whisker.length
    lines = ", ".join(f"{one:.0f}" for one in prediction.omega / (2 * np.pi))
    return (
        f"L {whisker.length * 1e3:.3g} mm, α {whisker.cone_angle * 1e3:.3g} mrad; H {height * 1e3:.3g} mm, "
        f"ε {posture.contact:.3g}, θ_b {posture.base_angle:.3g} rad, μ {posture.friction:.2g}; "
        f"v {scan.speed * 1e3:.3g} mm/s, ζ {scan.damping:.2g}; resonances {lines} Hz"
    )


def _line(axes: Any, time: NDArray[Any], values: NDArray[Any], label: str) -> None:
    axes.plot(time, values, color=BLUE, lw=0.7)
    axes.set(xlabel="Time [s]", ylabel=label)


def _whisker(axes: Any, prediction: Predicted, arrays: Arrays) -> None:
    """Profile at the first moment, the free end dashed, and the substrate line, in millimetres from the base."""
    x, y, s = arrays["shaft_x"][0] * 1e3, arrays["shaft_y"][0] * 1e3, arrays["shaft"]
    contact = int(np.searchsorted(s, prediction.posture.contact - 1e-6))
    axes.axhline(y[contact], color="0.5", lw=0.8)
    axes.plot(x[contact:], y[contact:], color=BLUE, lw=1.6)
    axes.plot(x[: contact + 1], y[: contact + 1], color=VERMILION, lw=1.6, ls=(0, (2, 1)), label="free end")
    axes.legend(loc="upper left")
    axes.set(xlabel="From the base along the substrate [mm]", ylabel="Up [mm]", aspect="equal")


def _mode(axes: Any, i: int, colour: str, time: NDArray[Any], arrays: Arrays) -> None:
    mean = arrays["modes"][i].mean()
    for sign in (1, -1):
        axes.plot(time, sign * arrays["envelopes"][i] * 1e6, color="0.6", lw=0.8)
    axes.plot(time, (arrays["modes"][i] - mean) * 1e6, color=colour, lw=0.5)
    axes.set(xlabel="Time [s]", ylabel=f"Mode {i + 1}, q + Q(d) [µm]")


def _spectrogram(axes: Any, arrays: Arrays) -> None:
    (_, highest), (first, last) = arrays["spectrogram_axes"].tolist()
    top = float(arrays["spectrogram"].max())
    shown = axes.imshow(
        arrays["spectrogram"], origin="lower", aspect="auto", extent=(first, last, 0, highest), cmap="cividis",
        vmin=top - 60, vmax=top,
    )  # fmt: skip
    axes.set(xlabel="Time [s]", ylabel="Frequency [Hz]")
    axes.figure.colorbar(shown, ax=axes, label="dB re 1 µm²/Hz")


def _firing(axes: Any, time: NDArray[Any], arrays: Arrays) -> None:
    """Rate, and above it the spikes of each trial."""
    rate, (when, trial) = arrays["firing"], arrays["spikes"]
    top = 1.1 * float(rate.max()) or 1.0
    axes.plot(time, rate, color=BLUE)
    axes.plot(when, top * (1 + 0.6 * trial / TRIALS), "|", color="0.35", ms=3)
    axes.set(xlabel="Time [s]", ylabel="Rate [Hz], spikes of 12 trials", ylim=(0, 1.65 * top))
    axes.set_yticks([tick for tick in axes.get_yticks() if 0 <= tick <= top])  # above are trials
