"""The study file: which movie or which virtual experiment, and what is known of it."""

from __future__ import annotations

import dataclasses
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from vibrissa.errors import ConflictError, FormatError, MissingError, RangeError
from vibrissa.limits import require_memory
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.profile import Posture, check_tip
from vibrissa.neural.simulated.virtual import NEURON_MODELS, NeuronModel, ThresholdLinearUnit
from vibrissa.quantities.identity import SURE
from vibrissa.quantities.kinds import Method
from vibrissa.study.spec.base_signal import BaseSignal
from vibrissa.study.spec.checked import checked_table, validated
from vibrissa.study.spec.comparison import Comparison
from vibrissa.study.spec.cortex import Cortex
from vibrissa.study.spec.laboratory import Laboratory
from vibrissa.study.spec.neurons import Neurons
from vibrissa.study.spec.textures import Grating, TextureFile
from vibrissa.video.camera.camera import Camera
from vibrissa.video.camera.scenery import Light
from vibrissa.video.identity.whisking import Whisking
from vibrissa.video.kernel.estimator_table import Estimator
from vibrissa.whisker import Whisker

Scale = Literal["small", "paper"]
BUILT_IN: dict[Scale, str] = {"small": "experiment.toml", "paper": "paper.toml"}


@dataclass(frozen=True, kw_only=True)
class MovieFile:
    """A recorded movie and how to track it.

    Attributes
    ----------
    path : str
        The movie, relative to the study file.
    pixel_size : float
        Side of a pixel in the plane of the whiskers [m].
    frame_rate : float, optional
        Rate of acquisition [Hz]; a container's own rate is a playback rate and is never used, but a camera's header
        holds it.
    seeds : ((column, row), ...)
        A point of each whisker in the first frame [pixels]; none if they are marked in ``whisking``, or found.
    names : (str, ...)
        Names of the whiskers; numbers by default.
    skin : ((column, row), ...), optional
        Where each whisker leaves the skin [pixels]; by default where each is first seen.
    base : {"left", "right", "top", "bottom"}, optional
        Side of the image on which the whiskers leave the skin; as found with the whiskers, else left.
    polarity : {"dark", "bright"}
        Whiskers darker or brighter than what is behind them.
    background : str
        "space" (estimated in every frame), "mean" (of the movie itself, if no whisker stays in one place), "median"
        (likewise, of whiskers that are linked), or an image or movie without the whiskers, relative to the study file.
    region : (first column, first row, last column, last row), optional
        Part of the image that is searched [pixels]; all by default.
    search : int
        Largest distance of the line from where it is expected, in one column [pixels].
    threshold : float
        Signal to noise of the contrast below which a column is lost.
    estimator : str
        Method that places the line in a column; see :class:`vibrissa.video.follow.search.Search`.
    node_spacing : float, optional
        Arc length between nodes [m]; 5 pixels by default.
    whisking : Whisking, optional
        The fan of the pad and marks of the whiskers, instead of seeds, if they swing through one another.
    substrate : ((column, row), (column, row)), optional
        Two points of the line along which the whiskers touch the substrate [pixels]; then skin and contact are
        extrapolated, and a contact off the line is rejected.
    whisker_length : float, optional
        Length of the nontruncated cone of the whiskers [m], for the contact; without it, the paper's polynomial.
    lamp : (first column, first row, last column, last row) or "find", optional
        Where the lamp is that lights as the texture arrives [pixels].
    start, stop : int
        First frame that is tracked, from 0, and the first after it that is not; all by default. Points are of frame
        ``start``; times count from the movie's first frame.
    drop_frames : {"nan"}, optional
        Frames that the movie's time stamps, or the numbers of its images, show to be missing become missing frames of
        the profile; by default they are reported, and frames are taken as evenly spaced.
    tracking : {"auto", "follow", "link"}
        Whiskers followed from the first frame on, or found in every frame and linked, see
        :func:`vibrissa.video.linked.tracking_way.choose_way`.
    marks : ((frame, column, row, name), ...)
        Points of whiskers in any frame [pixels], with the whisker's name, of whiskers that are linked.
    head : str, optional
        File with the head in every frame, relative to the study file, or "find": lines are linked in its coordinates.
    head_points : (str, str)
        Names of a caudal and of a rostral keypoint of the head in that file; by default its two.
    least_probability : float
        Probability of a name from which on a linked line is called that whisker's.
    """

    path: str
    pixel_size: float
    frame_rate: float | None = None
    seeds: tuple[tuple[float, float], ...] = ()
    names: tuple[str, ...] = ()
    skin: tuple[tuple[float, float], ...] | None = None
    base: Literal["left", "right", "top", "bottom"] | None = None
    polarity: Literal["dark", "bright"] = "dark"
    background: str = "space"
    region: tuple[int, int, int, int] | None = None
    search: int = 4
    threshold: float = 3.0
    estimator: Estimator = "matched"
    node_spacing: float | None = None
    whisking: Whisking | None = None
    substrate: tuple[tuple[float, float], tuple[float, float]] | None = None
    whisker_length: float | None = None
    lamp: tuple[int, int, int, int] | Literal["find"] | None = None
    start: int = 0
    stop: int | None = None
    drop_frames: Literal["nan"] | None = None
    tracking: Method = "auto"
    marks: tuple[tuple[int, float, float, str], ...] = ()
    head: str | None = None
    head_points: tuple[str, ...] = ()
    least_probability: float = SURE


@dataclass(frozen=True, kw_only=True)
class Film:
    """A virtual movie of one whisker.

    Attributes
    ----------
    n_frames : int
        Number of frames.
    subframes : int
        Instants averaged in each exposure.
    seed : int
        Seed of the pixel noise.
    camera : Camera
        The virtual camera.
    light : Light
        Unevenness and drift of the light; by default neither.
    fur : bool
        Whether the head is seen, up to where the whisker leaves the skin, and its fur.
    shadow : float
        Length of shaft that the substrate's shadow hides before the contact [m], of some 3 mm in the paper; 0 for a
        substrate that is not seen.
    """

    n_frames: int
    subframes: int = 3
    seed: int = 0
    camera: Camera = dataclasses.field(default_factory=Camera)
    light: Light = dataclasses.field(default_factory=Light)
    fur: bool = False
    shadow: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.shadow < 0.1:
            raise RangeError("Film.shadow", "must lie between 0 and 0.1", self.shadow, "give it in m")
        instants = float(self.n_frames * self.subframes)
        require_memory("Film", f"{self.n_frames} frames of {self.subframes}", 8 * 4 * self.camera.width * instants)


@dataclass(frozen=True, kw_only=True)
class UnitRecording:
    """A simulated unit, driven by the envelope, or the phase, of the whisker's displacement near its base.

    Attributes
    ----------
    n_trials : int
        Repeats of the sweep.
    seed : int
        Seed of the spikes.
    distance : float
        Distance from the base at which the displacement is taken [m].
    bin_width : float
        Width of the time bins [s].
    unit : NeuronModel
        The unit's truth; its ``model`` is ``threshold-linear`` or ``carrier-phase``.
    """

    n_trials: int = 40
    seed: int = 0
    distance: float = 5e-3
    bin_width: float = 0.01
    unit: NeuronModel = dataclasses.field(default_factory=ThresholdLinearUnit)


@dataclass(frozen=True, kw_only=True)
class Study:
    """What a study file says. Any part may be absent; what there is must be complete.

    One movie is a ``movie`` or a ``film``. A ``film``, and a ``texture`` without a movie, need what makes the motion:
    ``whisker``, ``posture``, ``scan`` and ``texture``.

    Attributes
    ----------
    name : str
        Title of the report.
    about : str
        A sentence for the report.
    assumptions : (str, ...)
        What is assumed, not measured; the report repeats it.
    n_modes : int
        Modes that are decomposed and fitted.
    movie : MovieFile, optional
        A recorded movie.
    film : Film, optional
        Instead: a virtual one.
    whisker : Whisker, optional
        The whisker of the movie, or the one that is drawn over the texture.
    posture : Posture, optional
        How it touches the texture.
    scan : Scan, optional
        How the texture is drawn past it.
    texture : Grating or TextureFile, optional
        The surface; without a movie, what it does to the whisker is predicted.
    recording : UnitRecording, optional
        A simulated unit that listens.
    laboratory : Laboratory, optional
        Many virtual sweeps.
    sweeps : str, optional
        Instead: the table of many recorded sweeps, relative to the study file; see
        :func:`vibrissa.study.spec.recorded_sweeps.read_sweeps`.
    comparison : Comparison
        How prediction is held against measurement in many sweeps.
    base_signal : (BaseSignal, ...)
        Signals measured at the base of a whisker.
    cortex : Cortex, optional
        A simulated population at the stimulator.
    neural : (Neurons, ...)
        Recorded spikes, and what was played meanwhile.
    folder : Path
        Where the file's relative paths start.
    """

    name: str
    about: str = ""
    assumptions: tuple[str, ...] = ()
    n_modes: int = 3
    movie: MovieFile | None = None
    film: Film | None = None
    whisker: Whisker | None = None
    posture: Posture | None = None
    scan: Scan | None = None
    texture: Grating | TextureFile | None = None
    recording: UnitRecording | None = None
    laboratory: Laboratory | None = None
    sweeps: str | None = None
    comparison: Comparison = dataclasses.field(default_factory=Comparison)
    base_signal: tuple[BaseSignal, ...] = ()
    cortex: Cortex | None = None
    neural: tuple[Neurons, ...] = ()
    folder: Path = Path()

    def __post_init__(self) -> None:
        one = self.movie is not None or self.film is not None
        many, neurons = self.laboratory or self.sweeps is not None, self.cortex or self.neural
        if not (one or many or neurons or self.base_signal or self.texture):
            raise MissingError(
                "study",
                "must have a [movie], a [film], a [laboratory], sweeps, a [[base_signal]], a [cortex] or a [[neural]]",
                remedy="or a [texture] with [whisker], [posture] and [scan]",
            )
        for pair in (("movie", "film"), ("laboratory", "sweeps")):
            if all(getattr(self, name) is not None for name in pair):
                raise ConflictError("study", f"must have either {pair[0]} or {pair[1]}", "both")
        needed = {"whisker": self.whisker, "posture": self.posture, "scan": self.scan, "texture": self.texture}
        missing = [f"[{name}]" for name, part in needed.items() if part is None]
        if missing and (self.film is not None or self.only_surface):
            part, what = ("[film]", "motion it shows") if self.film is not None else ("[texture]", "vibration")
            raise ConflictError(part, f"must come with {', '.join(missing)}", remedy=f"they make the {what}")
        if self.posture is not None and self.whisker is not None:
            check_tip(self.posture, self.whisker)

    @property
    def only_surface(self) -> bool:
        """Whether a texture is given without a movie: then what it does to the whisker is predicted."""
        return self.texture is not None and self.movie is None and self.film is None


def read_study(path: str | Path | None = None, scale: Scale = "small") -> Study:
    """Read a study file (TOML); without one, the built-in virtual experiment, small or at the paper's scale.

    Parameters
    ----------
    path : path, optional
        The file.
    scale : {"small", "paper"}
        Which built-in experiment.

    Returns
    -------
    Study
        Checked.

    Raises
    ------
    InputError
        If the file is missing or no TOML, a key is unknown (the nearest right one is named), or a value is bad.
    """
    if path is None:
        text = resources.files("vibrissa.data").joinpath(BUILT_IN[scale]).read_text(encoding="utf-8")
        return validated_study(tomllib.loads(text), "built-in experiment", Path())
    path = Path(path)
    if not path.is_file():
        raise MissingError(str(path), "must be an existing study file (TOML)")
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise FormatError(str(path), "must be text in UTF-8", remedy="save it as UTF-8") from error
    except ValueError as error:  # no TOML, or a number of thousands of digits
        raise FormatError(str(path), "must be TOML", remedy=str(error)) from error
    return validated_study(table, str(path), path.parent)


def validated_study(table: dict[str, Any], source: str, folder: Path) -> Study:
    """Study of a table as TOML gives it; ``source`` names it in errors, relative paths start at ``folder``.

    Parameters
    ----------
    table : dict
        As TOML gives it.
    source : str
        Names the file in errors.
    folder : Path
        Where relative paths start.

    Returns
    -------
    Study
        Checked.

    Raises
    ------
    InputError
        As :func:`read_study`.
    """
    table = checked_table(Study, table, source)
    if isinstance(table.get("texture"), dict):  # its own first: of two kinds the errors of both would be reported
        kind: type = TextureFile if "file" in table["texture"] else Grating
        validated(kind, table["texture"], source, ("texture",))
    if isinstance(unit := table.get("recording", {}).get("unit"), dict):  # the model decides which keys it has
        model = {"model": ThresholdLinearUnit.model} | unit
        validated(NEURON_MODELS[model["model"]], model, source, ("recording", "unit"))
        table = {**table, "recording": {**table["recording"], "unit": model}}
    study: Study = validated(Study, {**table, "folder": folder}, source)
    return study
