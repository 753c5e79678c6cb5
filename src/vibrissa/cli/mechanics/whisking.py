"""The verb `whisking`: gaps drawn past a whisker whose posture changes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import Parameter

from vibrissa.cli.mechanics.rod_movie import MovieFile, film_rate, refuse_movie, write_film
from vibrissa.cli.mechanics.rod_options import NO_ROD, Model, RodOptions
from vibrissa.cli.mechanics.scan import ScanOptions, undersampled
from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, names_without, show, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import NO_WHISKER, Flag, Friction, WhiskerOptions
from vibrissa.cli.shared.words.units import Length
from vibrissa.errors import ConflictError, RangeError

if TYPE_CHECKING:
    from vibrissa.mechanics.whisking.posture_path import PosturePath


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class SwingOptions:
    """Settings of a whole whisker whose base moves; with --model rod only.

    Attributes
    ----------
    damping_about : {"contact", "air"}, optional
        Whose modes have the ratio --damping: those about a posture of the path in contact (default), or those of the
        whisker in the air.
    surface_distance : float, optional
        Distance from the base to x = 0 of the surface, back along it, where the path begins [m]; by default x = 0 lies
        under the contact of Eq. (1), or under the tip in the air.
    """

    damping_about: Literal["contact", "air"] | None = None
    surface_distance: Length | None = None

    def chosen(self) -> dict[str, Any]:
        """Settings of the prediction.

        Returns
        -------
        dict
            ``about`` and ``surface_distance``.
        """
        return {"about": self.damping_about or "contact", "surface_distance": self.surface_distance}

    def refuse_without_rod(self) -> None:
        """Refuse them where modes predict.

        Raises
        ------
        InputError
            Names the first of them.
        """
        given = (("--damping-about", self.damping_about), ("--surface-distance", self.surface_distance))
        for option, value in given:
            if value is not None:
                raise ConflictError(option, "must go with --model rod", value)


NO_SWING = SwingOptions()


def whisking(
    texture: Path,
    path: Path,
    *,
    drawn: ScanOptions,
    friction: Friction = 0.4,
    reverse: Flag = False,
    model: Model = "modes",
    rod: RodOptions = NO_ROD,
    swinging: SwingOptions = NO_SWING,
    movie: MovieFile = None,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Predict a slowly whisking whisker's vibration on gaps: resonance, gain and pace change with the posture.

    Refused where the posture changes too fast, where the contact moves back, or where no profile exists. --model rod
    moves the base of the whole whisker instead, over any surface: it may begin in the air, touch, sweep and leave.

    Parameters
    ----------
    texture
        CSV of gaps, as `scan` takes it; with --model rod any surface that `scan` takes.
    path
        CSV with columns time,base_angle and contact or base_distance (seconds, radians, over L); with --model rod also
        travel, the way of the base along the surface beside that at --speed (metres).
    friction
        Coefficient of friction of the substrate.
    reverse
        Scan the texture in the other direction.
    """
    refuse_movie(movie, model)
    if model == "rod":
        return _rod(texture, path, drawn, friction, reverse, rod, swinging, movie, of, drawing, output)
    rod.refuse_without_rod()
    swinging.refuse_without_rod()
    if drawn.speed == 0:
        raise RangeError(
            "--speed", "must be positive (m/s)", drawn.speed, "or use --model rod with a path that has a column travel"
        )
    import numpy as np

    from vibrissa.mechanics.whisking.active_whisking import predict_slow, remarks, slow_signals
    from vibrissa.mechanics.whisking.posture_path import read_posture_path
    from vibrissa.texture.io import read_gaps

    cone, how, troughs = of.needed_cone(), drawn.scan(), read_gaps(texture)
    if reverse:
        troughs = troughs.reversed(float(troughs.position[0] + troughs.end[-1]))
    way = read_posture_path(path, friction)
    with progress_bars() as progress:
        progress("postures on the way", 0, 0)
        prediction = predict_slow(cone, way, troughs, how, n_modes=drawn.n_modes)
        t = prediction.times(drawn.sampling_rate)
        progress("signals of the scan", 0, 0)
        data = slow_signals(prediction, t)
    highest = prediction.omega(t).max(axis=-1) / (2 * np.pi)
    tell(*remarks(prediction, t), *undersampled(highest, drawn.sampling_rate), _steepest(way))
    drawing.draw("others.contents", data)
    output.save(data)
    if output == PRINTED:
        tell("what happens along the path (resonance, coupling, ringing) is not printed: --out slow.nc writes it")
    free = ["free_end_length", "jump_count", "jumps_allowed", "jumps_allowed_share"]
    show(data[[*free, "frequency_rate", "gain_rate", "mode_mixing", "ring_down_change"]].max(), json=output.json)


def _rod(
    texture: Path,
    path: Path,
    drawn: ScanOptions,
    friction: float,
    reverse: bool,
    rod: RodOptions,
    swinging: SwingOptions,
    movie: Path | None,
    of: WhiskerOptions,
    drawing: PictureOptions,
    output: OutputOptions,
) -> None:
    """The base of the whole whisker moved over the surface."""
    from vibrissa.mechanics.whisking.base_path import read_base_path
    from vibrissa.mechanics.whisking.swing_prediction import SwingPrediction, event_lines, swing_film
    from vibrissa.texture.io import read_texture

    for option, value, usual in (("--response", drawn.response, "exact"), ("--jump", drawn.jump, "continuous")):
        if value != usual:
            raise ConflictError(option, "must be left out with --model rod", value)
    cone, notes = of.needed_cone(), list[str]()
    surface, way = read_texture(texture, flip=reverse, tell=notes.append), read_base_path(path, friction)
    prediction = SwingPrediction(cone, way, surface, drawn.speed, drawn.damping, rod.settings(of), **swinging.chosen())
    with progress_bars() as progress:
        data = prediction.sampled(
            drawn.sampling_rate, progress=lambda done, of_all: progress("the whole whisker", done, of_all)
        )
    tell(data.attrs["verdict"], *notes, *event_lines(data))
    rate = film_rate(float(way.time[-1] - way.time[0]), drawn.sampling_rate)
    write_film(movie, lambda: swing_film(prediction, rate))
    drawing.draw("others.contents", data)
    output.show(data, names_without(data, "time", "contact_event"))


def _steepest(way: PosturePath) -> str:
    """What the curved profile does to the resonance where the base angle of the path is largest."""
    from vibrissa.mechanics.modes.shift import resonance_shift, shift_remark

    steepest = float(way.time[way.base_angle.argmax()])
    line = shift_remark(resonance_shift(way.at(steepest), 1))
    return f"modes are the straight shaft's; at {steepest:.4g} s, where the base is steepest, {line}"
