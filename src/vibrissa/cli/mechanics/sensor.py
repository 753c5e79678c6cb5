"""The verb `sensor`: a signal measured at a whisker's base."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import NO_WHISKER, Friction, PostureOptions, WhiskerOptions
from vibrissa.cli.shared.words.units import Angle, Duration, OverLength, Rate, Speed
from vibrissa.errors import ConflictError


def sensor(
    signal: Path,
    *,
    kind: Literal["moment", "curvature", "strain", "hall", "force"],
    signal_unit: str,
    calibration: float | None = None,
    sampling_rate: Rate | None = None,
    column: str | None = None,
    rest: tuple[Duration, Duration] | None = None,
    guess: list[Rate] | None = None,
    n_modes: int = 2,
    texture: Path | None = None,
    speed: Speed | None = None,
    contact: OverLength | None = None,
    base_distance: OverLength | None = None,
    base_angle: Angle | None = None,
    friction: Friction = 0.4,
    damping: float | None = None,
    texture_start: Duration = 0.0,
    gratings: int = 39,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Analyse a signal from the base of a robot's or an isolated whisker: resonance, damping, envelope.

    With texture, whisker, posture and speed, the model's prediction is added, and how well the envelopes agree.

    Parameters
    ----------
    signal
        Table (CSV) with a header, or .wav.
    kind
        Quantity that the sensor measures.
    signal_unit
        Unit of the numbers, or of the reading (V), which needs a calibration; full scale of integers in a .wav.
    calibration
        Quantity per unit of the reading: N m (moment, hall), 1/m, strain or N.
    sampling_rate
        Samples per second of a table without times [Hz].
    column
        Column of the table, or channel of the .wav from 1.
    rest
        Start and end of a time without touch [s], whose mean is subtracted.
    guess
        Approximate frequency of a resonance [Hz]; once for each. By default those of the whisker in its posture, or in
        air.
    n_modes
        Number of modes whose resonances are fitted, without --guess.
    texture
        CSV of gaps.
    speed
        Speed of the texture [m/s].
    contact
        Position of the contact along the shaft, over L; or, with a whisker, its distance from the tip of the cone along
        the shaft (11.6mm).
    base_distance
        Instead: height of the base above the substrate, over L; or, with a whisker, in its unit (18.5mm).
    base_angle
        Angle of the shaft at the base to the substrate [rad].
    friction
        Coefficient of friction of the substrate.
    damping
        Damping ratio of every mode of the prediction; by default that fitted to mode 1.
    texture_start
        Time in the file at which x = 0 of the texture meets the contact [s].
    gratings
        Number of shuffled textures whose predictions give the agreement by chance.
    """
    from vibrissa.study.forward.base_signals import analyse_signal
    from vibrissa.study.spec.base_signal import BaseSignal

    if (contact is None and base_distance is None) != (base_angle is None):
        rule = "must have both a place (--contact or --base-distance) and --base-angle, or neither"
        raise ConflictError("posture", rule)
    cone, posture = of.cone(), None
    if base_angle is not None:
        held = PostureOptions(contact=contact, base_distance=base_distance, base_angle=base_angle, friction=friction)
        posture = held.posture(cone)
    entry = BaseSignal(
        path=str(signal.absolute()), kind=kind, unit=signal_unit, calibration=calibration, sampling_rate=sampling_rate,
        column=column, rest=rest, guess=None if guess is None else tuple(guess), modes=n_modes,
        whisker=cone, posture=posture, texture=None if texture is None else str(texture.absolute()),
        scan_speed=speed, start=texture_start, damping=damping, gratings=gratings, name=signal.stem,
    )  # fmt: skip
    with stage("base signal"):
        found = analyse_signal(entry, Path())
    drawing.draw("others.base_signal", found)
    notes = ("absent", "model_damping_note", "clipped_note", "stuck_note")
    tell(*(found.attrs[note] for note in notes if found.attrs.get(note)))
    output.show(found, [str(name) for name in found.data_vars if found[name].dims == ("mode",)])
