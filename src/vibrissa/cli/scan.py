"""The verbs of textures: `scan`, and `whisk` for a posture that changes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from vibrissa.cli.options import Atlas, AtPosture, Json, OfWhisker, Out, needed_cone
from vibrissa.cli.output import refuse_suffix, show, tell
from vibrissa.errors import InputError

if TYPE_CHECKING:
    from vibrissa.texture.relief import Relief
    from vibrissa.texture.surface import Troughs

Jump = Literal["continuous", "ramp-limit", "paper2014"]


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
        from vibrissa.texture.io import holds_troughs, read_relief, read_troughs

        if not holds_troughs(path):
            settled = {"line": self.line, "x_unit": self.x_unit, "z_unit": self.z_unit, "level": self.level}
            how: dict[str, Any] = {**settled, "fill": self.fill, "flip": self.reverse, "part": self._part()}
            return read_relief(path, tell=tell, **how)
        useless = [name for name in ("line", "part", "x_unit", "z_unit", "fill", "level") if getattr(self, name)]
        if useless:
            option = f"--{useless[0].replace('_', '-')}"
            raise InputError(option, f"must not be given: {path} is a table of gaps, which leaves nothing open")
        troughs = read_troughs(path)
        return troughs.reversed(float(troughs.position[0] + troughs.end[-1])) if self.reverse else troughs

    def _part(self) -> tuple[float, float] | None:
        if self.part is None:
            return None
        try:
            first, last = map(float, self.part.split(":"))
        except ValueError:
            raise InputError("--part", "must be FIRST:LAST [m]", repr(self.part), "for example 0.06:0.09") from None
        return first, last


OfFile = Annotated[FileOptions, Parameter(name="*")]


def scan(
    texture: Path,
    *,
    at: AtPosture,
    scan_speed: float,
    damping: float = 0.11,
    sampling_rate: float = 20000.0,
    response: Literal["exact", "linear"] = "exact",
    jump: Jump = "continuous",
    modes: Literal["straight", "curved", "curved-coulomb", "curved-edge"] = "straight",
    file: OfFile = FileOptions(),
    count: int = 3,
    node: list[float] | None = None,
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
    scan_speed
        Speed of the texture [m/s].
    damping
        Damping ratio of every mode.
    sampling_rate
        Samples per second [Hz].
    response
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump
        What the velocity does where the contact jumps.
    modes
        Modes of a straight shaft (the paper's), or about the curved profile: of a point of the shaft that slides,
        friction constant or following the load, or of a shaft that slips over an edge; these carry axial force.
    count
        Number of modes. In the exact response the first millisecond of force and moment after a jump grows with it.
    node
        Distance from the base of a point of the shaft whose motion is wanted [m]; once for each.
    """
    from vibrissa.mechanics.diagnostics import relief_remarks, remarks
    from vibrissa.mechanics.sampled import scanned
    from vibrissa.mechanics.shift import resonance_shift, shift_remark
    from vibrissa.mechanics.superposition import Scan, predict
    from vibrissa.mechanics.topography import predict_relief, scanned_relief
    from vibrissa.texture.surface import Troughs

    cone, surface = needed_cone(whisker, atlas), file.texture(texture)
    how = Scan(speed=scan_speed, damping=damping, jump=jump, response=response, modes=modes)
    if isinstance(surface, Troughs):
        data = scanned(predict(cone, at.posture(), surface, how, n_modes=count), sampling_rate, nodes=node)
        lines = remarks(data)
    else:
        relief = predict_relief(cone, at.posture(), surface, how, n_modes=count)
        data = scanned_relief(relief, sampling_rate, nodes=node)
        lines = relief_remarks(data)
        lines += [shift_remark(resonance_shift(at.posture(), 1))] if modes == "straight" else []
    for line in lines:
        tell(line)
    show(data, [str(name) for name in data.data_vars if not {"time", "trough"} & set(data[name].dims)], json, out)


def whisk(
    texture: Path,
    path: Path,
    *,
    scan_speed: float,
    friction: float = 0.4,
    damping: float = 0.11,
    sampling_rate: float = 20000.0,
    response: Literal["exact", "linear"] = "exact",
    jump: Jump = "continuous",
    reverse: Annotated[bool, Parameter(negative="")] = False,
    count: int = 3,
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
    scan_speed
        Speed of the texture past the base [m/s].
    friction
        Coefficient of friction of the substrate.
    damping
        Damping ratio of every mode.
    sampling_rate
        Samples per second [Hz].
    response
        Quasi-static response of the profile held by the edge, or the paper's linear one.
    jump
        What the velocity does where the contact jumps.
    reverse
        Scan the texture in the other direction.
    count
        Number of modes.
    """
    import numpy as np

    from vibrissa.files import save
    from vibrissa.mechanics.posture_path import read_posture_path
    from vibrissa.mechanics.slow import predict_slow, remarks, slow_signals
    from vibrissa.mechanics.superposition import Scan
    from vibrissa.texture.io import read_troughs

    cone, troughs = needed_cone(whisker, atlas), read_troughs(texture)
    if reverse:
        troughs = troughs.reversed(float(troughs.position[0] + troughs.end[-1]))
    how = Scan(speed=scan_speed, damping=damping, jump=jump, response=response)
    if not (np.isfinite(sampling_rate) and sampling_rate > 0):
        raise InputError("--sampling-rate", "must be positive (Hz)", sampling_rate)
    way = read_posture_path(path, friction)
    prediction = predict_slow(cone, way, troughs, how, n_modes=count)
    t = np.arange(way.time[0], way.time[-1], 1 / sampling_rate)
    data = slow_signals(prediction, t)
    for line in remarks(prediction, t):
        tell(line)
    if out is not None:
        refuse_suffix(out)
        save(data, out)
    show(data[["frequency_rate", "gain_rate", "mode_mixing", "ring_down_change"]].max(), None, json, None)
