"""The verb `replay`: the command of a 24-whisker stimulator."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from vibrissa.cli.shared.display.output import Beside, Json, Out, names_without, show, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions
from vibrissa.cli.shared.display.progress import stage
from vibrissa.cli.shared.options import Seed
from vibrissa.cli.shared.words.refusals import in_options
from vibrissa.cli.shared.words.units import Acceleration, Duration, Length, Rate, Speed, in_si
from vibrissa.errors import InputError, MissingError, UnknownError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

    from vibrissa.stimulus.array import Spread


def replay(
    inputs: list[Path],
    *,
    out: Annotated[Out, Beside(("{0.name}.json",))],
    distance: Length = 5e-3,
    which: int = 0,
    duration: Duration = 10.0,
    sampling_rate: Rate = 20000.0,
    low: Rate = 0.1,
    high: Rate = 83.0,
    order: int = 4,
    norm: Literal["phase", "delay", "mag"] = "mag",
    causal: Annotated[bool, Parameter(negative="--zero-phase")] = True,
    fade: Duration = 0.05,
    ramp: Duration = 0.0,
    factor: float = 1.0,
    delays: str = "least",
    separation: Duration = 0.1,
    seed: Seed = 0,
    max_travel: Length | None = None,
    max_speed: Speed | None = None,
    max_acceleration: Acceleration | None = None,
    encoding: Literal["float32", "int24", "int16"] = "float32",
    full_scale: Length | None = None,
    measured: Path | None = None,
    measured_whisker: str = "alpha",
    drawing: PictureOptions = NO_PICTURE,
    json: Json = False,
) -> None:
    """Replay a whisker's motion on 24 whiskers: textures joined, filtered to the stimulator's band, shifted in time.

    The command is a loop: it is filtered as if repeated for ever, and the copies are shifted circularly.

    Parameters
    ----------
    inputs
        One for each texture, in order: a prediction (`vibrissa scan … --node 0.005`), tracked profiles, or a CSV with
        the columns time,displacement in seconds and metres.
    out
        Command to write: .nc, .wav, .npy or .csv, with a .json that describes it.
    distance
        Distance from the base of the point whose motion is replayed [m].
    which
        Which of the tracked whiskers, from 0.
    duration
        Length of the command [s].
    sampling_rate
        Samples per second [Hz].
    low
        Lower corner of the stimulator's band [Hz].
    high
        Upper corner of the stimulator's band [Hz], at most a quarter of the sampling rate of every input.
    order
        Order of the Bessel filter.
    norm
        Meaning of the corners: midpoint of the phase, delay, or -3 dB.
    causal
        Filter once forwards, with its delay; with --zero-phase forwards and backwards, without delay, the gain squared.
    fade
        Overlap of neighbouring textures [s].
    ramp
        Time from rest into the loop, and out of it [s]; 0 for a loop that is played without end.
    factor
        Factor on the command.
    delays
        Delays of the copies: even, random, least (correlated), or 24 times in seconds with commas between.
    separation
        Least time between delays that are random or least [s].
    seed
        Seed of random delays.
    max_travel
        Travel of the stimulator, to either side of rest [m].
    max_speed
        Speed of the stimulator [m/s].
    max_acceleration
        Acceleration of the stimulator [m/s²].
    encoding
        Encoding of samples in WAV.
    full_scale
        Displacement at full scale in WAV [m]; the command's peak by default.
    measured
        Motion of the stimulator to compare: a CSV with time,displacement, 0 s being the first sample of the command
        (of its ramp, if there is one); or a command, whose times are on this one's clock.
    measured_whisker
        The whisker that was measured.
    """
    import xarray as xr

    from vibrissa.stimulus.array import replay_command
    from vibrissa.stimulus.band import Band
    from vibrissa.stimulus.export import Sound, refuse_ending, write_command
    from vibrissa.stimulus.fidelity import compare_file
    from vibrissa.stimulus.limits import Limits
    from vibrissa.stimulus.waveform import read_motion

    refuse_ending(out)
    if not out.absolute().parent.is_dir():
        raise MissingError("--out", "must lie in an existing folder", str(out), "make it, or choose another")
    sound = Sound(encoding=encoding, full_scale=full_scale)
    with stage("command of the array"):
        data = replay_command(
            [read_motion(path, distance=distance, which=which) for path in inputs],
            duration=duration,
            sampling_rate=sampling_rate,
            band=Band(low=low, high=high, order=order, norm=norm, causal=causal),
            fade=fade,
            ramp=ramp,
            scale=factor,
            delays=_delays(delays),
            separation=separation,
            seed=seed,
            limits=Limits(travel=max_travel, speed=max_speed, acceleration=max_acceleration),
        )
    if measured is not None:
        data = xr.merge([data, compare_file(data, measured, measured_whisker)], combine_attrs="drop_conflicts")
    write_command(data, out, sound=sound)
    drawing.draw("spikes.command", data)
    tell(f"the command is in {out}, what it holds in {out}.json")
    tell(*_cuts(inputs, data))
    notes = [data.attrs[f"{about}_note"] for about in ("correlation", "resonance", "seam")]
    tell(*(in_options(note) for note in notes if note))
    show(data, names_without(data, "time", "coherence_frequency"), json)


def _cuts(inputs: Sequence[Path], data: xr.Dataset) -> list[str]:
    """Which part of a motion is replayed, where it is not replayed from its start."""
    cut = zip(inputs, data.seam_time.values, data.seam_source_time.values, strict=True)
    return [f"from {at:.4g} s on, before delays, {path} is replayed from its {t:.6g} s" for path, at, t in cut if t > 0]


def _delays(text: str) -> Spread | Sequence[float]:
    spreads: dict[str, Spread] = {"even": "even", "random": "random", "least": "least"}
    if text in spreads:
        return spreads[text]
    try:
        return [in_si(one, "--delays", "duration") for one in text.split(",")]
    except InputError:
        remedy = "for example --delays 0ms,20ms,…, 24 of them"
        raise UnknownError(
            "--delays", "must be even, random, least, or times with commas between", text, remedy
        ) from None
