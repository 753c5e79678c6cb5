"""A movie of a whole whisker: the shaft over the ground, its contacts coloured by their state, the moment below."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.style import context
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from vibrissa.arrays import Array, Integers
from vibrissa.errors import FormatError, TooFewError
from vibrissa.figures.colours import KINDS, PREDICTED
from vibrissa.figures.others.scan import moment_unit
from vibrissa.mechanics.rod.film import RodFilm
from vibrissa.mechanics.rod.rod_states import STATES
from vibrissa.video.io.colour import PLAYBACK_RATE, write_colour

SUFFIXES = (".mp4", ".mkv")
COLOURS = dict(zip(("detached", "slip", "stick", "bridge"), ("0.55", *KINDS), strict=False))
_FRAMES, _SLOWEST = 300, 1000.0
_NICE = np.array([1, 2, 5])
_SIZE = (9.6, 5.4)  # [inch]
_PLACES = ((0.08, 0.4, 0.4, 0.48), (0.58, 0.4, 0.4, 0.48), (0.08, 0.1, 0.9, 0.17))  # of the panels, over the picture
_WIDE, _LEAST = 1.5e-3, 20e-6  # [m] half the width of the close view, and least difference of heights in it


def slowed(film: RodFilm) -> float:
    """By how much a movie of a record is slower than the motion.

    Parameters
    ----------
    film : RodFilm
        The record.

    Returns
    -------
    float
        1, 2 or 5 times a power of ten, for at most 300 frames; 1 at least.
    """
    lasting = film.time[-1] - film.time[0]
    nice = np.concatenate([_NICE * 10.0**power for power in range(4)])
    fitting = nice[(nice * lasting * PLAYBACK_RATE <= _FRAMES) & (nice <= _SLOWEST)]
    return float(fitting[-1]) if fitting.size else 1.0


def chosen_times(film: RodFilm) -> Integers:
    """Records that are shown: the nearest to each frame's time.

    Parameters
    ----------
    film : RodFilm
        The record.

    Returns
    -------
    (F,) array of int
        Of the record.
    """
    step = 1 / (PLAYBACK_RATE * slowed(film))
    shown = np.arange(film.time[0], film.time[-1], step)
    return np.unique(np.rint((shown - film.time[0]) / (film.time[1] - film.time[0])).astype(int))


def write_movie(path: Path, film: RodFilm, progress: Callable[[int, int], None] | None = None) -> int:
    """Write the movie as MP4 or MKV.

    Parameters
    ----------
    path : Path
        ``.mp4`` or ``.mkv``.
    film : RodFilm
        The record.
    progress : callable, optional
        Takes the frames that are done, and all of them.

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    InputError
        If the name is another, or there is nothing to show.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise FormatError("movie", "must end in .mp4 or .mkv", str(path))
    if film.time.size < 2:
        raise TooFewError("movie", "must have two frames or more", film.time.size)
    return write_colour(path, frames(film, chosen_times(film), progress))


def frames(
    film: RodFilm, shown: Integers, progress: Callable[[int, int], None] | None = None
) -> Iterator[NDArray[np.uint8]]:
    """Pictures of some records.

    Parameters
    ----------
    film : RodFilm
        The record.
    shown : (F,) array of int
        Which of its times.
    progress : callable, optional
        Takes the frames that are done, and all of them.

    Yields
    ------
    (height, width, 3) array of uint8
        Red, green and blue.
    """
    with as_file(files("vibrissa.figures") / "style.mplstyle") as style, context(style):
        scene = _Scene(film, shown)
    for done, k in enumerate(shown, 1):
        yield scene.picture(int(k))
        if progress is not None:
            progress(done, len(shown))


class _Scene:
    """The panels of the movie, and what moves in them."""

    def __init__(self, film: RodFilm, shown: Integers) -> None:
        self.film, self.centre = film, _centres(film)
        figure = Figure(figsize=_SIZE, dpi=100)
        figure.set_layout_engine("none")
        self.canvas = FigureCanvasAgg(figure)
        self.whole, self.close, moment = (figure.add_axes(place) for place in _PLACES)
        self.ground = [Polygon(np.zeros((1, 2)), color="0.85", ec="0.4", lw=0.8) for _ in self._views]
        for axis, ground in zip(self._views, self.ground, strict=True):
            axis.add_patch(ground)
        self.shaft = [axis.plot([], [], color="k", lw=1.2)[0] for axis in self._views]
        self.dots = [axis.plot([], [], "o", ms=6, clip_on=False)[0] for axis in self._views]
        self.now = moment.axvline(0.0, color="k", lw=0.8)
        self.clock = self.whole.text(0.02, 0.96, "", transform=self.whole.transAxes, va="top")
        self._label(figure, moment, shown)

    @property
    def _views(self) -> tuple[Axes, Axes]:
        return self.whole, self.close

    def _label(self, figure: Figure, moment: Axes, shown: Integers) -> None:
        film, factor = self.film, slowed(self.film)
        levels = film.ground[:, 1] + film.shift[shown, 1].min()
        self.whole.set(xlabel="along the ground [mm]", ylabel="height [mm]")
        self._frame(film.shaft[shown], float(levels.min()))
        self.close.set(xlabel="along the ground [mm]", ylabel="height [µm]", title="about the contacts")
        span = max(np.ptp(levels), _LEAST)
        self.close.set_ylim(1e6 * (levels.min() - 0.3 * span), 1e6 * (levels.max() + 1.5 * span))
        size, unit = moment_unit(film.moment)
        moment.set(xlabel="time [ms]", ylabel=f"moment [{unit}]", xlim=1e3 * film.time[[0, -1]])
        moment.plot(1e3 * film.time, film.moment / size, color=PREDICTED, lw=0.9)
        pace = "at its own pace" if factor == 1 else f"slowed {factor:g} times"
        figure.suptitle(f"whole whisker, {pace}", x=0.01, ha="left")
        handles = [Line2D([], [], color=colour, marker="o", ls="", label=name) for name, colour in COLOURS.items()]
        figure.legend(handles=handles, loc="upper right", ncols=len(handles), frameon=False)

    def _frame(self, shaft: Array, lowest: float) -> None:
        """The whole motion within the first panel, to one scale."""
        low, high = shaft.min(axis=(0, 1)), shaft.max(axis=(0, 1))
        low[1] = min(low[1], lowest)
        middle, half = 1e3 * (low + high) / 2, 0.55e3 * (high - low)
        panel = np.array(_PLACES[0][2:]) * _SIZE
        half = panel * (half / panel).max()
        self.whole.set(xlim=middle[0] + half[0] * np.array([-1, 1]), ylim=middle[1] + half[1] * np.array([-1, 1]))

    def picture(self, k: int) -> NDArray[np.uint8]:
        """Draw one record."""
        film, name = self.film, STATES[int(self.film.state[k])]
        self.close.set_xlim(1e3 * (self.centre[k] - _WIDE), 1e3 * (self.centre[k] + _WIDE))
        for axis, ground, shaft, dots, high in zip(
            self._views, self.ground, self.shaft, self.dots, (1e3, 1e6), strict=True
        ):
            ground.set_xy(_seen(film, k, axis, high))
            shaft.set_data(1e3 * film.shaft[k, :, 0], high * film.shaft[k, :, 1])
            places = film.contacts[k] if film.state[k] else film.shaft[k, :1]  # the tip of a shaft in the air
            dots.set_data(1e3 * places[:, 0], high * places[:, 1])
            dots.set_color(COLOURS[name])
        self.now.set_xdata([1e3 * film.time[k]] * 2)
        self.clock.set_text(f"{1e3 * film.time[k]:.1f} ms\n{name}")
        self.canvas.draw()  # type: ignore[no-untyped-call]
        seen = self.canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        return np.asarray(seen)[..., :3].copy()


def _centres(film: RodFilm) -> Array:
    """Middle of the close view at each record: between the contacts, or under the tip, without haste."""
    middle = film.contacts[..., 0].mean(axis=1)
    middle = np.where(np.isfinite(middle), middle, film.shaft[:, 0, 0])
    width = max(3, film.time.size // 8)
    return np.asarray(uniform_filter1d(middle, width, mode="nearest"))


def _seen(film: RodFilm, k: int, axis: Axes, high: float) -> Array:
    """Outline of the ground within an axis, closed below it."""
    (first, last), (floor, ceiling) = axis.get_xlim(), axis.get_ylim()
    first, last, floor = 2 * first - last, 2 * last - first, 2 * floor - ceiling
    x, y = 1e3 * (film.ground[:, 0] + film.shift[k, 0]), high * (film.ground[:, 1] + film.shift[k, 1])
    inside = slice(*np.searchsorted(x, [first, last]))
    ends = np.interp([first, last], x, y)
    line = [[first, ends[0]], *np.column_stack([x[inside], y[inside]]), [last, ends[1]]]
    return np.array([*line, [last, floor], [first, floor]])
