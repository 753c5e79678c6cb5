"""The parts ``[[base_signal]]`` of a study: signals measured at the base of a whisker."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vibrissa.errors import ConflictError, MissingError, RangeError
from vibrissa.mechanics.sensor.base_signal import Kind
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker


@dataclass(frozen=True, kw_only=True)
class BaseSignal:
    """A signal measured at the base of a whisker, and what is known of the whisker.

    Attributes
    ----------
    path : str
        ``.wav`` or a table (CSV), relative to the study file.
    name : str
        For the report; the file's by default.
    kind, unit, calibration, sampling_rate, column, rest
        See :func:`vibrissa.mechanics.sensor.base_signal.read_base_signal`.
    guess : (float, ...), optional
        Approximate resonant frequencies [Hz]; by default those of whisker and posture, or of the whisker in air.
    modes : int
        Resonances that are looked for, if they are not guessed.
    whisker : Whisker, optional
        The whisker.
    posture : Posture, optional
        How it touches the texture.
    texture : str, optional
        CSV of gaps, relative to the study file: with whisker, posture and speed, the signal is predicted.
    scan_speed : float, optional
        v [m/s].
    start : float
        When x = 0 of the texture meets the contact, in the file's time [s]; to some 50 ms.
    damping : float, optional
        ζ of the prediction; by default that fitted to mode 1 under the texture's forcing, or 0.11 where none was.
    gratings : int
        Shuffled textures whose predictions give the agreement by chance; 0 for none.
    """

    path: str
    kind: Kind
    unit: str
    name: str = ""
    calibration: float | None = None
    sampling_rate: float | None = None
    column: str | None = None
    rest: tuple[float, float] | None = None
    guess: tuple[float, ...] | None = None
    modes: int = 2
    whisker: Whisker | None = None
    posture: Posture | None = None
    texture: str | None = None
    scan_speed: float | None = None
    start: float = 0.0
    damping: float | None = None
    gratings: int = 39

    def __post_init__(self) -> None:
        if self.guess is None and self.whisker is None:
            remedy = "give guess, in Hz, or the whisker, and the posture if it touches something"
            raise MissingError("base signal", "must say about where its resonances lie", remedy=remedy)
        if not self.modes >= 1:
            raise RangeError("BaseSignal.modes", "must be at least 1", self.modes)
        if self.texture is None and self.damping is not None:
            raise ConflictError("base signal with a damping", "must come with a texture, as only predictions have it")
        if self.texture is not None:
            needed = {"whisker": self.whisker, "posture": self.posture, "scan_speed": self.scan_speed}
            missing = [name for name, part in needed.items() if part is None]
            if missing:
                raise ConflictError("base signal with a texture", f"must come with {', '.join(missing)}")

    @property
    def label(self) -> str:
        """Name in the report."""
        return self.name or Path(self.path).stem
