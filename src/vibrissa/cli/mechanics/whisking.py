"""The verb `whisking`: gaps drawn past a whisker whose posture changes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vibrissa.cli.mechanics.scan import ScanOptions, undersampled
from vibrissa.cli.shared.options import NO_WHISKER, Flag, WhiskerOptions
from vibrissa.cli.shared.output import PRINTED, OutputOptions, show, tell
from vibrissa.cli.shared.progress import progress_bars

if TYPE_CHECKING:
    from vibrissa.mechanics.whisking.posture_path import PosturePath


def whisking(
    texture: Path,
    path: Path,
    *,
    drawn: ScanOptions,
    friction: float = 0.4,
    reverse: Flag = False,
    of: WhiskerOptions = NO_WHISKER,
    output: OutputOptions = PRINTED,
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
        t = np.arange(way.time[0], way.time[-1], 1 / drawn.sampling_rate)
        progress("signals of the scan", 0, 0)
        data = slow_signals(prediction, t)
    highest = prediction.omega(t).max(axis=-1) / (2 * np.pi)
    tell(*remarks(prediction, t), *undersampled(highest, drawn.sampling_rate), _steepest(way))
    output.save(data)
    if output == PRINTED:
        tell("what happens along the path (resonance, coupling, ringing) is not printed: --out slow.nc writes it")
    free = ["free_end_length", "jump_count", "jumps_allowed", "jumps_allowed_share"]
    show(data[[*free, "frequency_rate", "gain_rate", "mode_mixing", "ring_down_change"]].max(), json=output.json)


def _steepest(way: PosturePath) -> str:
    """What the curved profile does to the resonance where the base angle of the path is largest."""
    from vibrissa.mechanics.modes.shift import resonance_shift, shift_remark

    steepest = float(way.time[way.base_angle.argmax()])
    line = shift_remark(resonance_shift(way.at(steepest), 1))
    return f"modes are the straight shaft's; at {steepest:.4g} s, where the base is steepest, {line}"
