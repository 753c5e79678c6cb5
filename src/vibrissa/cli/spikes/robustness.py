"""The verb robustness: decoders trained at one speed, height and angle, tested at others."""

from __future__ import annotations

from vibrissa.cli.shared.display.output import PRINTED, OutputOptions, show, tell
from vibrissa.cli.shared.display.pictures import NO_PICTURE, PictureOptions, write_picture
from vibrissa.cli.shared.display.progress import progress_bars
from vibrissa.cli.shared.options import NO_WHISKER, PostureOptions, Seed, WhiskerOptions
from vibrissa.cli.shared.words.units import Length, Speed
from vibrissa.whisker import DAMPING


def robustness(
    *,
    at: PostureOptions,
    speed: Speed,
    speed_ratio: list[float] | None = None,
    height_ratio: list[float] | None = None,
    angle_ratio: list[float] | None = None,
    mean_period: list[Length] | None = None,
    damping: float = DAMPING,
    sets: int = 16,
    trials: int = 20,
    seed: Seed = 0,
    of: WhiskerOptions = NO_WHISKER,
    drawing: PictureOptions = NO_PICTURE,
    output: OutputOptions = PRINTED,
) -> None:
    """Test decoders at other speeds and postures than those of learning: envelope, spectrum, rate, events.

    Random gratings are scanned by the model; populations of each code answer with Poisson spikes. This takes minutes.

    Parameters
    ----------
    speed
        Speed of the texture at which the decoders learn [m/s]. The posture given is the one in which they learn.
    speed_ratio
        Another speed at which they are tested, over the first; once for each. Default: 0.5, 0.7, 1.4, 2.
    height_ratio
        Another height of the base, over the first; once for each. Default: 0.8, 0.9, 1.1, 1.2.
    angle_ratio
        Another base angle, over the first; once for each. Default: 0.75, 0.875, 1.08, 1.16.
    mean_period
        Mean of one land and one gap together of a grating of each set [m]; once for each. Default: five of 0.6 mm.
    damping
        Damping ratio of every mode.
    sets
        Sets of gratings, each with its own population; the intervals are over sets.
    trials
        Trials of each grating for learning, and for each test.
    seed
        Seed of gratings, units and spikes.
    """
    import numpy as np

    from vibrissa.figures.others import robustness as figure

    cone = of.needed_cone()
    posture = at.posture(cone)
    others = {"speeds": speed_ratio, "heights": height_ratio, "angles": angle_ratio}
    ways = figure.ways(posture, speed, **{name: given for name, given in others.items() if given})
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
    if drawing.picture is not None:
        write_picture(figure.draw(data), drawing.picture)
    output.show(data, columns=[])
    if not output.json:
        show(data.kept_share.to_dataset("arm"), list(figure.ARMS))
