"""The verbs of textures: `scan`, and `whisk` for a posture that changes."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from vibrissa.cli.options import Atlas, AtPosture, Json, OfModes, OfWhisker, Out, needed_cone
from vibrissa.cli.output import refuse_out, show, tell
from vibrissa.cli.scan_spikes import NO_SPIKES, OfSpikes
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vibrissa.mechanics.basis import Modes
    from vibrissa.mechanics.posture_path import PosturePath
    from vibrissa.mechanics.superposition import Scan
    from vibrissa.texture.relief import Relief
    from vibrissa.texture.surface import Troughs


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """What a file of a surface leaves open.

    Attributes
    ----------
    line : str, optional
        Line of a map: x:12 runs along x as number 12 along y, counted from 0; y:12 along y.
    part : str, optional
        FIRST:LAST, distances from the file's first point that are wanted [m].
    x_unit : str, optional
        Unit of the positions (m, mm, um, nm) where the file states none.
    z_unit : str, optional
        Unit of the heights where the file states none.
    fill : bool
        Straight lines across points that were not measured.
    level : {"line", "none"}, optional
        Take the tilt away, or keep it.
    reverse : bool
        Scan in the other direction: what comes last in the file meets the contact first.
    """

    line: str | None = None
    part: str | None = None
    x_unit: str | None = None
    z_unit: str | None = None
    fill: Annotated[bool, Parameter(negative="")] = False
    level: Literal["line", "none"] | None = None
    reverse: Annotated[bool, Parameter(name=["--reverse", "--flip"], negative="")] = False

    def texture(self, path: Path) -> Troughs | Relief:
        """Gaps, or heights along the scan."""
        from vibrissa.texture.io import Settled, read_texture

        settled: Settled = {"line": self.line, "part": self._part(), "fill": self.fill, "level": self.level}
        settled |= {"x_unit": self.x_unit, "z_unit": self.z_unit}
        return read_texture(path, flip=self.reverse, tell=tell, **settled)

    def _part(self) -> tuple[float, float] | None:
        if self.part is None:
            return None
        try:
            first, last = map(float, self.part.split(":"))
        except ValueError:
            raise InputError("--part", "must be FIRST:LAST [m]", repr(self.part), "for example 0.06:0.09") from None
        return first, last


OfFile = Annotated[FileOptions, Parameter(name="*")]


@dataclass(frozen=True, kw_only=True)
class ScanOptions:
    """How a texture is drawn past a whisker, and how its vibration is sampled.

    Attributes
    ----------
    scan_speed : float
        Speed of the texture past the base [m/s].
    damping : float
        Damping ratio of every mode.
    sampling_rate : float
        Samples per second [Hz].
    response : {"exact", "linear"}
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump : {"continuous", "ramp-limit", "paper2014"}
        What the velocity does where the contact jumps.
    count : int
        Number of modes. In the exact response the first millisecond of force and moment after a jump grows with it.
    """

    scan_speed: float
    damping: float = 0.11
    sampling_rate: float = 20000.0
    response: Literal["exact", "linear"] = "exact"
    jump: Literal["continuous", "ramp-limit", "paper2014"] = "continuous"
    count: int = 3

    def scan(self, modes: Modes = "straight") -> Scan:
        """What :func:`vibrissa.mechanics.superposition.predict` takes."""
        from vibrissa.mechanics.superposition import Scan

        if not (isfinite(self.sampling_rate) and self.sampling_rate > 0):
            raise InputError("--sampling-rate", "must be positive (Hz)", self.sampling_rate)
        return Scan(speed=self.scan_speed, damping=self.damping, jump=self.jump, response=self.response, modes=modes)


Drawn = Annotated[ScanOptions, Parameter(name="*")]


def scan(
    texture: Path,
    *,
    at: AtPosture,
    drawn: Drawn,
    modes: OfModes = "straight",
    file: OfFile = FileOptions(),
    node: list[float] | None = None,
    spiking: OfSpikes = NO_SPIKES,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """A texture drawn past a whisker: its vibration, what the follicle feels, and how far the assumptions hold.

    Time 0 is the moment x = 0 meets the contact; the record ends when the ringing after the last gap has died away.

    Parameters
    ----------
    texture
        Gaps: CSV with columns position,width in metres, or position_um,width_um or _mm (and depth, if it is not 35 µm),
        the edge of each that meets the contact first, in order of arrival. Or any surface: CSV with columns
        position_mm,height_um, two bare columns, .npy, or the file of a profilometer or microscope.
    node
        Distance from the base of a point of the shaft whose motion is wanted [m]; once for each.
    """
    from vibrissa.study.surface import scan_surface

    refuse_out(out)
    cone, posture, how, surface = needed_cone(whisker, atlas), at.posture(), drawn.scan(modes), file.texture(texture)
    units = spiking.units()
    sampled: dict[str, Any] = {"n_modes": drawn.count, "sampling_rate": drawn.sampling_rate, "nodes": node}
    prediction, data, lines = scan_surface(surface, cone, posture, how, **sampled)
    for line in [*lines, *_undersampled(data.resonant_frequency.to_numpy(), drawn.sampling_rate)]:
        tell(line)
    if units is not None:
        data = spiking.added(data, prediction, units)
    long = {"time", "trough", "spike"}
    show(data, [str(name) for name in data.data_vars if not long & set(data[name].dims)], json, out)


def whisk(
    texture: Path,
    path: Path,
    *,
    drawn: Drawn,
    friction: float = 0.4,
    reverse: Annotated[bool, Parameter(negative="")] = False,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Gaps drawn past a whisker that whisks slowly: resonance, gain and the contact's pace change with the posture.

    Refused where the posture changes too fast for it, where the contact goes back, or no profile follows.

    Parameters
    ----------
    texture
        CSV of gaps, as `scan` takes it.
    path
        CSV with columns time,base_angle and contact or base_distance (seconds, radians, over L).
    friction
        Coefficient of friction of the substrate.
    reverse
        Scan the texture in the other direction.
    """
    import numpy as np

    from vibrissa.files import save
    from vibrissa.mechanics.posture_path import read_posture_path
    from vibrissa.mechanics.slow import predict_slow, remarks, slow_signals
    from vibrissa.texture.io import read_troughs

    refuse_out(out)
    cone, how, troughs = needed_cone(whisker, atlas), drawn.scan(), read_troughs(texture)
    if reverse:
        troughs = troughs.reversed(float(troughs.position[0] + troughs.end[-1]))
    way = read_posture_path(path, friction)
    prediction = predict_slow(cone, way, troughs, how, n_modes=drawn.count)
    t = np.arange(way.time[0], way.time[-1], 1 / drawn.sampling_rate)
    data = slow_signals(prediction, t)
    highest = prediction.omega(t).max(axis=-1) / (2 * np.pi)
    for line in [*remarks(prediction, t), *_undersampled(highest, drawn.sampling_rate), _steepest(way)]:
        tell(line)
    if out is not None:
        save(data, out)
    elif not json:
        tell("what happens along the path (resonance, coupling, ringing) is not printed: --out slow.nc writes it")
    show(data[["frequency_rate", "gain_rate", "mode_mixing", "ring_down_change"]].max(), None, json, None)


def _undersampled(resonances: NDArray[np.float64], rate: float) -> list[str]:
    """First mode that rings too fast for the samples, if one does [Hz]."""
    for mode, frequency in enumerate(resonances, start=1):
        if rate <= 2 * frequency:
            line = f"{rate:g} samples per second are not above twice the {frequency:.4g} Hz of mode {mode}: "
            return [line + "its record does not show how it rings; raise --sampling-rate"]
    return []


def _steepest(way: PosturePath) -> str:
    """What the curved profile does to the resonance where the path has the base stand steepest."""
    from vibrissa.mechanics.shift import resonance_shift, shift_remark

    steepest = float(way.time[way.base_angle.argmax()])
    line = shift_remark(resonance_shift(way.at(steepest), 1))
    return f"modes are the straight shaft's; at {steepest:.4g} s, where the base stands steepest, {line}"
