"""Small files to try things on: those of the examples, virtual movies, and public recordings."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from math import radians
from pathlib import Path

from vibrissa.api.shared.arguments import names_arguments
from vibrissa.errors import MissingError, did_you_mean

__all__ = ["sample_data"]


@names_arguments
def sample_data(name: str) -> Path:
    """Path of a small file to try things on.

    Parameters
    ----------
    name : str
        A file of the project's examples (``grating.csv``, ``ridges.csv``, ``diameters.csv``, ``spikes.csv``, …), or a
        virtual movie, rendered when it is first asked for. ``movie.mkv``: 400 frames of a whisker of 40 mm and
        1.5 mrad, contact 0.29, base angle 1.2 rad, 2000 frames/s, pixels of 95 µm, over ``random_grating(0.35, rng=1)``
        at 0.1 m/s with damping 0.11 and the linear response. ``whisking.mkv``: 500 frames of four whiskers that whisk
        at 8 Hz, one of which touches a pole of 0.7 mm radius at column 365, row 262; 500 frames/s, pixels of 0.13 mm.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is none of that name; the nearest is suggested.

    Examples
    --------
    >>> import vibrissa as vb
    >>> vb.sample_data("grating.csv").name
    'grating.csv'
    """
    shipped = {path.name: path for path in sorted(_examples().iterdir()) if path.suffix in (".csv", ".toml")}
    if name in shipped:
        return shipped[name]
    if name in RENDERED:
        return _rendered(name)
    known = [*shipped, *RENDERED]
    raise MissingError("name", "must be a sample", repr(name), did_you_mean(name, known, f"one of {', '.join(known)}"))


def _examples() -> Path:
    """Folder of the examples: in the installed package, or in a clone."""
    packaged = Path(__file__).parents[1] / "data" / "examples"
    return packaged if packaged.is_dir() else Path(__file__).parents[3] / "examples"


def _rendered(name: str) -> Path:
    """A virtual movie, rendered once for each version of the package on a machine."""
    from vibrissa import __version__
    from vibrissa.files import written_whole

    path = Path(tempfile.gettempdir()) / f"vibrissa-{__version__}-{name}"
    if not path.is_file():
        with written_whole(path) as temporary:
            RENDERED[name](temporary)
    return path


def _dragged(path: Path) -> None:
    """Film the whisker of the built-in experiment."""
    from vibrissa.study.movie.virtual import film_motion, lay_out, predicted_motion
    from vibrissa.study.spec.settings import read_study
    from vibrissa.video.io.movie import write_movie

    study = read_study(None, "small")
    assert study.film is not None
    film, motion = replace(study.film, n_frames=400), predicted_motion(study)
    write_movie(path, film_motion(motion, film, lay_out(motion, film)), playback_rate=25)


def _whisking(path: Path) -> None:
    """Film row C of a pad that whisks, beside a pole."""
    from vibrissa.video.camera.camera import Camera
    from vibrissa.video.camera.pad.filming import film
    from vibrissa.video.camera.pad.settings import FilmedPole, Head, WhiskingScene, Whisks
    from vibrissa.video.io.movie import write_movie

    pixel = 0.13e-3
    scene = WhiskingScene(
        camera=Camera(width=400, height=340, pixel_size=pixel, frame_rate=500.0, exposure=4e-4, blur=1.8, noise=2.0),
        head=Head(nose=(30 * pixel, 250 * pixel)),
        sides=("left",),
        names=("C1", "C2", "C3", "C4"),
        whisks=Whisks(amplitude=radians(18)),
        pole=FilmedPole(position=(365 * pixel, 262 * pixel), touched_by=(0,)),
        seed=1,
    )
    write_movie(path, film(scene, 500), playback_rate=25)


RENDERED: dict[str, Callable[[Path], None]] = {"movie.mkv": _dragged, "whisking.mkv": _whisking}
