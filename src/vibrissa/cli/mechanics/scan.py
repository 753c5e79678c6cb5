"""The verb `scan`: a texture drawn past a whisker."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import Parameter

from vibrissa.arrays import Array
from vibrissa.cli.mechanics.rod_movie import MovieFile, film_rate, refuse_movie, write_film
from vibrissa.cli.mechanics.rod_options import NO_ROD, RodOptions, ScanModel
from vibrissa.cli.mechanics.scan_spikes import NO_SPIKES, SpikeOptions
from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, names_without, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import NO_WHISKER, Flag, OfModes, PostureOptions, WhiskerOptions
from vibrissa.cli.shared.words.units import Length, Rate, Speed, in_si
from vibrissa.errors import ConflictError, RangeError, ShapeError
from vibrissa.whisker import DAMPING

if TYPE_CHECKING:
    from collections.abc import Callable

    from vibrissa.mechanics.modes.basis import Modes
    from vibrissa.mechanics.scan.scan_settings import Scan
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.texture.surface import Gaps


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """How a file of a surface is read where the file does not state it.

    Attributes
    ----------
    line : str, optional
        Line of a map: x:12 runs along x as number 12 along y, counted from 0; y:12 along y.
    part : str, optional
        FIRST:LAST of the part to read: distances from the file's first point [m].
    x_unit : str, optional
        Unit of the positions (m, mm, um, nm) where the file states none.
    z_unit : str, optional
        Unit of the heights where the file states none.
    fill : bool
        Straight lines across points that were not measured.
    levelling : {"line", "none"}, optional
        Remove the tilt, or keep it.
    reverse : bool
        Scan in the other direction: the last point of the file meets the contact first.
    """

    line: str | None = None
    part: str | None = None
    x_unit: str | None = None
    z_unit: str | None = None
    fill: Flag = False
    levelling: Literal["line", "none"] | None = None
    reverse: Flag = False

    def texture(self, path: Path, note: Callable[[str], None]) -> Gaps | HeightProfile:
        """Gaps, or heights along the scan; every decision about the file is noted.

        Parameters
        ----------
        path : Path
            The file.
        note : callable
            Takes a line.

        Returns
        -------
        Gaps or HeightProfile
            The texture.
        """
        from vibrissa.texture.io import Settled, read_texture

        settled: Settled = {"line": self.line, "part": self._part(), "fill": self.fill, "level": self.levelling}
        settled |= {"x_unit": self.x_unit, "z_unit": self.z_unit}
        return read_texture(path, flip=self.reverse, tell=note, **settled)

    def _part(self) -> tuple[float, float] | None:
        if self.part is None:
            return None
        if self.part.count(":") != 1:
            raise ShapeError("--part", "must be FIRST:LAST", repr(self.part), "for example --part 60mm:90mm")
        first, last = (in_si(word, "--part", "length") for word in self.part.split(":"))
        return first, last


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ScanOptions:
    """How a texture is drawn past a whisker, and how its vibration is sampled.

    Attributes
    ----------
    speed : float
        Speed of the texture past the base [m/s].
    damping : float
        Damping ratio of every mode.
    sampling_rate : float
        Samples per second [Hz].
    response : {"exact", "linear"}
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump : {"continuous", "ramp-limit", "paper2014"}
        Change of the velocity where the contact jumps.
    n_modes : int
        Number of modes. In the exact response the first millisecond of force and moment after a jump grows with it.
    """

    speed: Speed
    damping: float = DAMPING
    sampling_rate: Rate = 20000.0
    response: Literal["exact", "linear"] = "exact"
    jump: Literal["continuous", "ramp-limit", "paper2014"] = "continuous"
    n_modes: int = 3

    def scan(self, modes: Modes = "straight") -> Scan:
        """What :func:`vibrissa.mechanics.scan.texture_prediction.predict` takes.

        Parameters
        ----------
        modes : str
            Of which shaft.

        Returns
        -------
        Scan
            The settings.

        Raises
        ------
        InputError
            If the sampling rate is not positive.
        """
        from vibrissa.mechanics.scan.scan_settings import Scan

        if not (isfinite(self.sampling_rate) and self.sampling_rate > 0):
            raise RangeError("--sampling-rate", "must be positive (Hz)", self.sampling_rate)
        return Scan(speed=self.speed, damping=self.damping, jump=self.jump, response=self.response, modes=modes)


def scan(
    texture: Path,
    *,
    at: PostureOptions,
    drawn: ScanOptions,
    modes: OfModes = "straight",
    file: FileOptions = FileOptions(),
    node: list[Length] | None = None,
    model: ScanModel = "modes",
    rod: RodOptions = NO_ROD,
    movie: MovieFile = None,
    spiking: SpikeOptions = NO_SPIKES,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Predict a whisker's vibration on a texture, what the follicle feels, and how far the assumptions hold.

    Time 0 is the moment x = 0 meets the contact; the record ends when the ringing after the last gap has died away.

    Parameters
    ----------
    texture
        Gaps: CSV with columns position,width in metres, or position_um,width_um or _mm (and depth, if it is not 35 µm),
        the edge of each that meets the contact first, in order of arrival. Or any surface: CSV with columns
        position_mm,height_um, two bare columns, .npy, or the file of a profilometer or microscope.
    node
        Distance from the base of a point of the shaft whose motion is written [m]; once for each.
    """
    from vibrissa.mechanics.rod.rod_prediction import RodPrediction
    from vibrissa.study.forward.surface import scan_surface

    refuse_movie(movie, model)
    if model != "rod":
        rod.refuse_without_rod()
    for option, value, usual in (
        ("--response", drawn.response, "exact"), ("--jump", drawn.jump, "continuous"), ("--modes", modes, "straight")
    ):  # fmt: skip
        if model != "modes" and value != usual:
            raise ConflictError(option, f"must be left out with --model {model}", value)
    cone, how = of.needed_cone(), drawn.scan(modes)
    posture = at.posture(cone)
    units, notes, lines = spiking.units(), list[str](), list[str]()
    sampled: dict[str, Any] = {"n_modes": drawn.n_modes, "sampling_rate": drawn.sampling_rate, "nodes": node}
    sampled |= {"rod": rod.settings(of)} if model == "rod" else {"model": model}
    try:
        surface = file.texture(texture, notes.append)
        with progress_bars() as progress:
            prediction, data, lines = scan_surface(surface, cone, posture, how, progress=progress, **sampled)
        lines += undersampled(data.resonant_frequency.to_numpy(), drawn.sampling_rate)
    finally:
        tell(*lines, *notes)  # what the free end allows comes first
    if isinstance(prediction, RodPrediction):
        whole = prediction
        write_film(movie, lambda: whole.film(film_rate(whole.duration, drawn.sampling_rate)))
    if units is not None:
        data = spiking.added(data, prediction, units)
    drawing.draw("others.scan", data)
    output.show(data, names_without(data, "time", "trough", "spike"))


def undersampled(resonances: Array, rate: float) -> list[str]:
    """First mode that rings too fast for the samples, if one does.

    Parameters
    ----------
    resonances : (M,) array
        Resonant frequency of each mode [Hz].
    rate : float
        Samples per second [Hz].

    Returns
    -------
    list of str
        One line, or none.
    """
    for mode, frequency in enumerate(resonances, start=1):
        if rate <= 2 * frequency:
            line = f"{rate:g} samples per second are not above twice the {frequency:.4g} Hz of mode {mode}: "
            return [line + "its record does not show how it rings; raise --sampling-rate"]
    return []
