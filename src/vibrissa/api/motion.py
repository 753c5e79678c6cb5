"""A surface drawn past a whisker: one call for gaps, for any heights, and for a posture that changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.api.remarks import as_sentence, remark
from vibrissa.api.shared.arguments import names_arguments
from vibrissa.api.shared.rods import Model, refuse_forms, rod_of
from vibrissa.errors import ConflictError, InputError, RangeError
from vibrissa.mechanics.free_end.free_end_prediction import FreeEndPrediction
from vibrissa.mechanics.free_end.validity import chosen
from vibrissa.mechanics.modes.basis import Modes
from vibrissa.mechanics.quasi_static.response import Form
from vibrissa.mechanics.rod.rod_prediction import RodPrediction
from vibrissa.mechanics.scan import diagnostics
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction, predict_relief
from vibrissa.mechanics.scan.sampled import scanned, scanned_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import Prediction, predict
from vibrissa.mechanics.scan.undersampling import contact_lines, surface_remarks
from vibrissa.mechanics.statics.contact_law import friction_remarks
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.vibration.dynamics import JumpRule
from vibrissa.mechanics.whisking import active_whisking
from vibrissa.mechanics.whisking.base_path import BasePath
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.mechanics.whisking.slow_prediction import SlowPrediction
from vibrissa.mechanics.whisking.swing_prediction import SwingPrediction
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import DAMPING, Whisker

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Motion:
    """The predicted motion of a whisker over a surface; :func:`vibrissa.scan` makes it.

    Attributes
    ----------
    prediction : Prediction, ReliefPrediction, SlowPrediction, RodPrediction, SwingPrediction or FreeEndPrediction
        The model, which gives every quantity at any time.
    """

    prediction: Prediction | ReliefPrediction | SlowPrediction | RodPrediction | SwingPrediction | FreeEndPrediction

    @property
    def whisker(self) -> Whisker:
        """The whisker that was scanned."""
        return self.prediction.whisker

    @cached_property
    def verdict(self) -> str:
        """Whether the prediction is *usable*, needs *caution* or lies *outside the model*, with the reasons."""
        return str(self.sample().attrs["verdict"])

    def __repr__(self) -> str:
        if isinstance(self.prediction, SwingPrediction):
            return "<Motion of the whole whisker, whose base moves: .sample(rate)>"
        scan = self.prediction.scan
        kind = {Prediction: "gaps", ReliefPrediction: "a height profile", SlowPrediction: "gaps, posture changing"}
        if isinstance(self.prediction, RodPrediction):
            return f"<Motion of the whole whisker at {scan.speed:g} m/s: .sample(rate), .plot()>"
        if isinstance(self.prediction, FreeEndPrediction):
            return f"<Motion with the free end at {scan.speed:g} m/s: .sample(rate), .plot()>"
        try:
            found = self.verdict.partition(";")[0].partition(" (docs/")[0]
        except InputError:  # too long to be sampled whole
            found = "too long to be judged whole"
        return f"<Motion over {kind[type(self.prediction)]} at {scan.speed:g} m/s: {found}; .sample(rate), .plot()>"

    @names_arguments
    def sample(self, rate: float = 20e3, *, nodes: Sequence[float] | float | None = None) -> xr.Dataset:
        """The motion at even times, from 0 until the ringing after the last event has died away.

        Parameters
        ----------
        rate : float
            Samples per second [Hz].
        nodes : float or sequence of float, optional
            Distances from the base of points of the shaft whose motion is wanted [m].

        Returns
        -------
        Dataset
            ``mode_amplitude`` and ``mode_displacement`` over L, the ``envelope`` of the latter [m], on (mode, time);
            what the follicle feels; ``displacement`` (time, node) [m]; how far the assumptions hold, and the attribute
            ``verdict``. Of a posture that changes, what belongs to the moment, and no nodes; of a rod whose base moves,
            what :func:`vibrissa.mechanics.whisking.swing_prediction.swing_signals` gives.

        Raises
        ------
        InputError
            If the rate is not positive, the record too long, or a node not on the whisker.

        Examples
        --------
        >>> import vibrissa as vb
        >>> surface = vb.periodic_grating(0.02, period=2e-3)
        >>> motion = vb.scan(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2), surface, speed=0.1)
        >>> motion.sample(2000, nodes=[5e-3]).displacement.dims
        ('time', 'node')
        """
        if not 0 < rate < np.inf:
            raise RangeError("rate", "must be positive (Hz)", rate)
        nodes = [float(nodes)] if isinstance(nodes, float | int) else nodes
        if isinstance(self.prediction, SlowPrediction | SwingPrediction):
            if nodes is not None:
                raise ConflictError("nodes", "must be left out where the posture changes", nodes)
            if isinstance(self.prediction, SwingPrediction):
                return self.prediction.sampled(rate)
            return active_whisking.slow_signals(self.prediction, self.prediction.times(rate))
        if isinstance(self.prediction, RodPrediction | FreeEndPrediction):
            data = self.prediction.sampled(rate, nodes)
        elif isinstance(self.prediction, ReliefPrediction):
            data = scanned_relief(self.prediction, rate, nodes=nodes)
        else:
            data = scanned(self.prediction, rate, nodes=nodes)
        if "envelope" not in data:
            raise RangeError("rate", "must give at least 4 samples", rate, "in Hz: 2000 for 2 kHz")
        fast = data.resonant_frequency.to_numpy() >= rate / 2
        if fast.any():
            remark(f"modes {1 + int(fast.argmax())} and above ring too fast for {rate:g} samples per second")
        if isinstance(self.prediction, Prediction | ReliefPrediction):
            remark(*contact_lines(self.prediction, rate))
        else:
            remark(*surface_remarks(self.prediction.texture, self.prediction.scan.speed, rate))
        return data

    def remarks(self, rate: float = 20e3) -> list[str]:
        """Sentences on how far the assumptions hold: the verdict first, then the free end.

        Parameters
        ----------
        rate : float
            Samples per second at which the load on the contact is looked at [Hz].

        Returns
        -------
        list of str
            A sentence each.
        """
        if isinstance(self.prediction, SlowPrediction):
            judged, *lines = active_whisking.remarks(self.prediction, self.prediction.times(rate))
        elif isinstance(self.prediction, RodPrediction | SwingPrediction | FreeEndPrediction):
            judged, lines = str(self.sample(rate).attrs["verdict"]), []
        elif isinstance(self.prediction, ReliefPrediction):
            judged, *lines = diagnostics.relief_remarks(self.sample(rate))
        else:
            judged, *lines = diagnostics.remarks(self.sample(rate))
        level, _, reasons = judged.partition(": ")
        needs = "needs caution" if level == "caution" else f"is {level}"
        return [as_sentence(line) for line in (f"the prediction {needs}: {reasons}", *lines)]

    def plot(self) -> Figure:
        """The motion where it is strongest: excursion, modes with their envelopes, moment at the base, spectra.

        Returns
        -------
        Figure
            Of matplotlib.

        Raises
        ------
        InputError
            If the posture changes: plot what ``sample`` gives.
        """
        from vibrissa.figures.others import scan

        if isinstance(self.prediction, SlowPrediction | SwingPrediction):
            raise ConflictError("motion", "must be of one posture to be plotted", remedy="plot what sample() gives")
        return scan.draw(scan.compute(self.sample()))


@names_arguments
def scan(
    whisker: Whisker,
    posture: Posture | PosturePath | BasePath,
    surface: Gaps | HeightProfile,
    *,
    speed: float,
    damping: float = DAMPING,
    n_modes: int = 3,
    response: Form = "exact",
    jump: JumpRule = "continuous",
    modes: Modes = "straight",
    model: Model = "modes",
) -> Motion:
    """The vibration of a whisker along which a surface is drawn.

    Parameters
    ----------
    whisker : Whisker
        The cone.
    posture : Posture, PosturePath or BasePath
        How it is held; a path where that changes in time: slowly compared with the ringing, or, of a rod, in any way. A
        base path, of a rod only, need not touch the surface.
    surface : Gaps or HeightProfile
        Gaps, or heights along the scan.
    speed : float
        Of the surface past the base [m/s].
    damping : float
        Damping ratio of every mode.
    n_modes : int
        Number of modes.
    response, jump, modes
        Forms of the model of modes, as of :class:`vibrissa.mechanics.scan.scan_settings.Scan`.
    model : {"modes", "free-end", "rod", "auto"} or Rod
        The paper's modes of a shaft that touches the ground in a single contact; a model as fast whose free end
        bears on the land behind each gap (``"free-end"``, gaps only); ``"auto"``, the second for gaps, else the
        first, whose verdicts name the rod where neither is valid; or the whole whisker as a rod:
        ``"rod"``, or a :class:`vibrissa.mechanics.rod.rod_settings.Rod` with intrinsic
        curvature, rounded edges or a compliant follicle. It is computed each time it is sampled, which takes some 0.5 s
        for each second.

    Returns
    -------
    Motion
        At any time; ``sample`` gives a Dataset.

    Raises
    ------
    InputError
        If the posture cannot cross the surface, or a setting is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> import vibrissa as vb
    >>> surface = vb.random_grating(0.05, rng=1)
    >>> motion = vb.scan(vb.atlas("C2"), vb.Posture(contact=0.29, base_angle=1.2), surface, speed=0.1)
    >>> motion.sample(rate=2000).envelope.attrs["units"]
    'm'
    """
    how = Scan(speed=speed, damping=damping, response=response, jump=jump, modes=modes)
    if isinstance(posture, Posture):
        remark(*friction_remarks(posture.friction))
    if isinstance(posture, BasePath | PosturePath):
        return _moving(whisker, posture, surface, how, n_modes, model)
    rod = rod_of(model)
    if model == "auto":
        model = chosen(posture, surface)
    if model != "modes":
        refuse_forms(response, jump, modes, model if isinstance(model, str) else "rod")
    if rod is not None:
        return Motion(RodPrediction(whisker, posture, surface, how, n_modes, rod))
    if model == "free-end":
        return Motion(FreeEndPrediction(whisker, posture, surface, how, n_modes))  # type: ignore[arg-type]
    if isinstance(surface, HeightProfile):
        return Motion(predict_relief(whisker, posture, surface, how, n_modes=n_modes))
    return Motion(predict(whisker, posture, surface, how, n_modes=n_modes))


def _moving(
    whisker: Whisker, path: BasePath | PosturePath, surface: Gaps | HeightProfile, how: Scan, n_modes: int, model: Model
) -> Motion:
    """Motion of a whisker whose posture changes: by the rod, or slowly, by modes."""
    if (rod := rod_of(model)) is not None:
        refuse_forms(how.response, how.jump, how.modes)
        swing = path if isinstance(path, BasePath) else BasePath.of(path)
        return Motion(SwingPrediction(whisker, swing, surface, how.speed, how.damping, rod))
    if isinstance(path, BasePath):
        raise ConflictError("model", "must be 'rod' for a base path", repr(model), "model='rod'")
    if model != "modes":
        raise ConflictError("model", "must be 'modes' or 'rod' where the posture changes", repr(model))
    if isinstance(surface, HeightProfile):
        raise ConflictError("surface", "must be gaps where the posture changes", "a height profile")
    return Motion(active_whisking.predict_slow(whisker, path, surface, how, n_modes=n_modes))
