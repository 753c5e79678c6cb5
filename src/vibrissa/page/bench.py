"""The bench behind the page: whisker, texture and scan of a state, and the tables that live moves keep."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from vibrissa.errors import InputError
from vibrissa.mechanics.gap import jump_table
from vibrissa.mechanics.superposition import Prediction, Scan, check_tip, predict
from vibrissa.mechanics.topography import ReliefPrediction, predict_relief
from vibrissa.page.shaft import Ways, ways
from vibrissa.texture.generators import self_affine, wave
from vibrissa.texture.relief import Relief
from vibrissa.texture.surface import Reading, Troughs, periodic_grating, random_grating
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    from vibrissa.mechanics.contact import Episodes
    from vibrissa.mechanics.gap import JumpTable
    from vibrissa.mechanics.ground import HeldTable
    from vibrissa.mechanics.profile import Posture
    from vibrissa.mechanics.response import Response
    from vibrissa.page.state import Choice, State

Motion = Prediction | ReliefPrediction

MODES = 3
LONGEST = 6.0  # [s] of one scan: what the page draws stays a few megabytes
ROUGH_SPACING = 5e-6  # [m] half the shortest wave of self-affine roughness
KEPT = 8  # postures whose tables are kept


def made_surface(choice: Choice) -> Troughs | Relief:
    """Texture of a generator.

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


class Bench:
    """Makes what a state says; keeps the last tables, so that speed, damping and neuron cost no new ones.

    Parameters
    ----------
    dropped : callable
        Gives the surface of a dropped file by its key.
    """

    def __init__(self, dropped: Callable[[str], Troughs | Relief]) -> None:
        self._dropped = dropped
        self.surface = lru_cache(KEPT)(self._surface)
        self._jumps = lru_cache(KEPT)(self._jumps_anew)
        self._response = lru_cache(KEPT)(self._response_anew)
        self._relief = lru_cache(KEPT)(self._relief_anew)
        self._ways: dict[tuple[float, float, Posture, Choice], Ways] = {}
        self._held: dict[Posture, HeldTable] = {}
        self._went: dict[str, Episodes] = {}

    def predict(self, state: State, letter: str = "a") -> Motion:
        """The prediction for one of the two textures.

        Parameters
        ----------
        state : State
            What is set.
        letter : {"a", "b"}
            Which texture.

        Raises
        ------
        InputError
            If the state is beyond what the mechanics can follow, or its scan would last too long.
        """
        whisker, posture, choice = state.whisker, state.posture, state.texture(letter)
        check_tip(posture, whisker)
        surface, scan = self.surface(choice), state.scan
        if isinstance(surface, Troughs):
            _refuse_long(float(surface.end[-1]), scan.speed)
            jumps = self._jumps(whisker.length, posture, choice)
            response = self._response(whisker.length, posture, choice)
            return predict(whisker, posture, surface, scan, n_modes=MODES, response=response, jumps=jumps)
        _refuse_long(float(surface.position[-1]), scan.speed)
        return replace(self._relief(whisker.length, posture, choice), whisker=whisker, scan=scan)

    def ways(self, state: State, letter: str = "a") -> Ways:
        """Where the shaft is without vibration, for the prediction of the same state."""
        whisker = state.whisker
        key = whisker.length, whisker.tip, state.posture, state.texture(letter)
        if key not in self._ways:
            self._ways = dict([*self._ways.items()][1 - KEPT :]) | {key: ways(self.predict(state, letter))}
        return self._ways[key]

    def _surface(self, choice: Choice) -> Troughs | Relief:
        return self._dropped(choice.file) if choice.kind == "file" else made_surface(choice)

    def _troughs(self, choice: Choice) -> Troughs:
        surface = self.surface(choice)
        if not isinstance(surface, Troughs):
            raise InputError("texture", "must be gaps")
        return surface

    def _jumps_anew(self, length: float, posture: Posture, choice: Choice) -> JumpTable:
        return jump_table(posture, self._troughs(choice).width / length)

    def _response_anew(self, length: float, posture: Posture, choice: Choice) -> Response:
        jumps, scan = self._jumps(length, posture, choice), Scan(speed=0.1, damping=0.0)
        return predict(_cone(length), posture, self._troughs(choice), scan, n_modes=MODES, jumps=jumps).response

    def _relief_anew(self, length: float, posture: Posture, choice: Choice) -> ReliefPrediction:
        surface, scan = self.surface(choice), Scan(speed=0.1, damping=0.0)
        relief = Relief.from_troughs(surface) if isinstance(surface, Troughs) else surface
        held, like = self._held.pop(posture, None), self._went.get(choice.kind)
        made = predict_relief(_cone(length), posture, relief, scan, n_modes=MODES, table=held, like=like)
        self._held = dict([*self._held.items()][1 - KEPT :]) | {posture: made.episodes.table}
        self._went[choice.kind] = made.episodes
        return made


def _cone(length: float) -> Whisker:
    """Any cone of this length: tables over L ask for no more."""
    return Whisker(length=length, cone_angle=1e-3)


def _refuse_long(end: float, speed: float) -> None:
    if end / speed > LONGEST:
        rule, remedy = f"must last at most {LONGEST:g} s on the page", "scan faster, or shorten the texture"
        raise InputError("scan", rule, f"{end / speed:.3g} s", remedy)
