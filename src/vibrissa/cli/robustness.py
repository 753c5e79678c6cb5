"""The verb robustness: codes taught at one speed, height and angle, asked at others."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

from vibrissa.cli.options import Atlas, AtPosture, Json, OfWhisker, Out, needed_cone
from vibrissa.cli.pictures import Picture, refuse_picture, write_picture

Several = Annotated[list[float] | None, Parameter(negative="", show_default=False)]


def robustness(
    *,
    at: AtPosture,
    scan_speed: float,
    speed: Several = None,
    height: Several = None,
    angle: Several = None,
    mean_period: Several = None,
    damping: float = 0.11,
    sets: int = 16,
    trials: int = 20,
    seed: int = 0,
    whisker: OfWhisker = None,
    atlas: Atlas = None,
    picture: Picture = None,
    out: Out = None,
    json: Json = False,
) -> None:
    """Whether textures learnt at one speed and posture are told apart at others: envelope, spectrum, rate, events.

    Random gratings are scanned by the model; populations of each code answer with Poisson spikes. This takes minutes.

    Parameters
    ----------
    scan_speed
        Speed at which the decoders learn [m/s]. The posture given is the one in which they learn.
    speed
        Another speed at which they are asked, over the first; once for each. Default: 0.5, 0.7, 1.4, 2.
    height
        Another height of the base, over the first; once for each. Default: 0.8, 0.9, 1.1, 1.2.
    angle
        Another base angle, over the first; once for each. Default: 0.75, 0.875, 1.08, 1.16.
    mean_period
        Mean period of one grating of each set [m]; once for each. Default: five of 0.6 mm.
    damping
        Damping ratio of every mode.
    sets
        Sets of gratings, each with a population of its own, over which the intervals go.
    trials
        Trials of each grating to learn from, and to be asked.
    seed
        Seed of gratings, units and spikes.
    """
    import numpy as np

    from vibrissa.cli.output import progress_bars, refuse_out, show, tell
    from vibrissa.figures import robustness as figure

    cone, posture = needed_cone(whisker, atlas), at.posture()
    refuse_picture(picture)
    refuse_out(out)
    others = {"speeds": speed, "heights": height, "angles": angle}
    ways = figure.ways(posture, scan_speed, **{name: given for name, given in others.items() if given})
    with progress_bars() as progress:
        data = figure.compute(
            cone,
            ways,
            rng=np.random.default_rng(seed),
            damping=damping,
            n_sets=sets,
            n_trials=trials,
            mean_periods=mean_period or figure.PERIODS,
            progress=progress,
        )
    tell(data.attrs["verdict"])
    if picture is not None:
        write_picture(figure.draw(data), picture)
    if json:
        show(data, None, True, out)
    else:
        show(data, [], False, out)
        show(data.kept_share.to_dataset("arm"), list(figure.ARMS), False, None)
