"""A session of the page: whisker, texture and scan of a state, and the tables that live moves keep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from vibrissa.errors import RangeError
from vibrissa.mechanics.scan.relief_prediction import ReliefPrediction, predict_relief
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.gap import jump_table
from vibrissa.mechanics.statics.profile import check_tip
from vibrissa.page.shaft_table import ShaftTables, shaft_tables
from vibrissa.page.whole.job import CUT, WholeJob
from vibrissa.page.whole.runs import WholeRuns
from vibrissa.texture.generators import self_affine, wave
from vibrissa.texture.relief import HeightProfile
from vibrissa.texture.surface import Gaps, Reading, periodic_grating, random_grating
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    from vibrissa.mechanics.contact.episodes import Episodes
    from vibrissa.mechanics.quasi_static.held_table import HeldTable
    from vibrissa.mechanics.quasi_static.response import Response
    from vibrissa.mechanics.scan.sampled import Predicted
    from vibrissa.mechanics.statics.gap import JumpTable
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.page.panel.state import Choice, PageState

MODES = 3
LONGEST = 6.0  # [s] of one scan: what the page draws stays a few megabytes
ROUGH_SPACING = 5e-6  # [m] half the shortest wave of self-affine roughness
KEPT = 8  # postures whose tables are kept
ANY_SCAN = Scan(speed=0.1, damping=0.0)  # for tables that serve every speed and damping


def made_surface(choice: Choice) -> Gaps | HeightProfile:
    """Texture of a generator.

    Parameters
    ----------
    choice : Choice
        Kind and settings of the generator.

    Returns
    -------
    Gaps or HeightProfile
        The surface.

    Raises
    ------
    InputError
        If the generator cannot make it.
    """
    rng = np.random.default_rng(choice.seed)
    if choice.kind == "periodic":
        width = choice.duty * choice.period
        return periodic_grating(choice.length, period=choice.period, width=width, depth=choice.depth)
    if choice.kind == "rough":
        return self_affine(choice.length, rng=rng, rms=choice.rms, spacing=ROUGH_SPACING)
    if choice.kind == "wave":
        return wave(choice.length, amplitude=choice.amplitude, period=choice.period)
    reading: Reading = "telegraph" if choice.kind == "random" else "widths"
    return random_grating(choice.length, rng=rng, reading=reading, mean_period=choice.period, depth=choice.depth)


class PageSession:
    """Build the whisker, texture and scan that a page state describes.

    The last tables are kept, so that speed, damping and neuron cost no new ones.

    Parameters
    ----------
    dropped : callable
        Gives the surface of a dropped file by its key.
    whole : WholeRuns, optional
        Scans of the whole whisker, shared with other sessions.
    """

    def __init__(self, dropped: Callable[[str], Gaps | HeightProfile], whole: WholeRuns | None = None) -> None:
        self._dropped, self.whole = dropped, WholeRuns() if whole is None else whole
        self.surface = lru_cache(KEPT)(self._surface)
        self._gaps = lru_cache(KEPT)(self._gaps_anew)
        self._relief = lru_cache(KEPT)(self._relief_anew)
        self._tables: dict[tuple[float, float, Posture, Choice], ShaftTables] = {}
        self._held: dict[Posture, HeldTable] = {}
        self._went: dict[str, Episodes] = {}

    def predict(self, state: PageState, letter: str = "a") -> Predicted:
        """The prediction for one of the two textures.

        Parameters
        ----------
        state : PageState
            Values of the controls.
        letter : {"a", "b"}
            Which texture.

        Returns
        -------
        Prediction or ReliefPrediction
            With 3 modes.

        Raises
        ------
        InputError
            If the state is beyond what the mechanics can follow, or its scan would last too long.
        """
        whisker, posture, choice = state.whisker, state.posture, state.texture(letter)
        check_tip(posture, whisker)
        surface, scan = self.surface(choice), state.scan
        if isinstance(surface, Gaps):
            _refuse_long(float(surface.end[-1]), scan.speed)
            jumps, response = self._gaps(whisker.length, posture, choice)
            return predict(whisker, posture, surface, scan, n_modes=MODES, response=response, jumps=jumps)
        _refuse_long(float(surface.position[-1]), scan.speed)
        return replace(self._relief(whisker.length, posture, choice), whisker=whisker, scan=scan)

    def whole_job(self, state: PageState, letter: str = "a", *, sampled: bool = False) -> WholeJob:
        """The scan of the whole whisker for one of the two textures.

        Parameters
        ----------
        state : PageState
            Values of the controls.
        letter : {"a", "b"}
            Which texture.
        sampled : bool
            Whether the dataset is wanted, or what is drawn.

        Returns
        -------
        WholeJob
            To be asked of ``whole``.

        Raises
        ------
        InputError
            If nothing of the whisker lies beyond its contact, or the scan would last too long.
        """
        whisker, posture, choice = state.whisker, state.posture, state.texture(letter)
        check_tip(posture, whisker)
        if whisker.tip > posture.contact - CUT:
            rule = f"must lie {CUT:g} or more beyond the contact at {posture.contact:.4g} for the whole whisker"
            raise RangeError("Whisker, Tip (tip)", rule, f"{whisker.tip:.4g}", "lower it, or choose the other model")
        surface = self.surface(choice)
        _refuse_long(float((surface.end if isinstance(surface, Gaps) else surface.position)[-1]), state.scan.speed)
        return WholeJob(whisker, posture, state.scan, choice, sampled, surface=surface)

    def shaft_tables(self, state: PageState, letter: str = "a") -> ShaftTables:
        """Where the shaft is without vibration, for the prediction of the same state.

        Parameters
        ----------
        state : PageState
            Values of the controls.
        letter : {"a", "b"}
            Which texture.

        Returns
        -------
        ShaftTables
            For any speed and damping.
        """
        whisker = state.whisker
        key = whisker.length, whisker.tip, state.posture, state.texture(letter)
        if key not in self._tables:
            _keep(self._tables, key, shaft_tables(self.predict(state, letter)))
        return self._tables[key]

    def _surface(self, choice: Choice) -> Gaps | HeightProfile:
        return self._dropped(choice.file) if choice.kind == "file" else made_surface(choice)

    def _gaps_anew(self, length: float, posture: Posture, choice: Choice) -> tuple[JumpTable, Response]:
        """Tables of the jumps and of the response to gaps."""
        troughs, cone = cast(Gaps, self.surface(choice)), _cone(length)
        jumps = jump_table(posture, troughs.width / length)
        return jumps, predict(cone, posture, troughs, ANY_SCAN, n_modes=MODES, jumps=jumps).response

    def _relief_anew(self, length: float, posture: Posture, choice: Choice) -> ReliefPrediction:
        relief = cast(HeightProfile, self.surface(choice))
        held, like = self._held.pop(posture, None), self._went.get(choice.kind)
        made = predict_relief(_cone(length), posture, relief, ANY_SCAN, n_modes=MODES, table=held, like=like)
        _keep(self._held, posture, made.episodes.table)
        self._went[choice.kind] = made.episodes
        return made


def _keep(tables: dict[Any, Any], key: Any, table: Any) -> None:
    """Keep a table, and the last ones before it."""
    tables[key] = table
    if len(tables) > KEPT:
        del tables[next(iter(tables))]


def _cone(length: float) -> Whisker:
    """Any cone of this length: tables over L ask for no more."""
    return Whisker(length=length, cone_angle=1e-3)


def _refuse_long(end: float, speed: float) -> None:
    if end / speed > LONGEST:
        rule, remedy = f"must last at most {LONGEST:g} s on the page", "scan faster, or shorten the texture"
        raise RangeError("scan", rule, f"{end / speed:.3g} s", remedy)
