"""A scan of the whole whisker that is wanted, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vibrissa.mechanics.scan.scan_settings import Scan
    from vibrissa.mechanics.statics.profile import Posture
    from vibrissa.page.panel.state import Choice
    from vibrissa.page.signals import ScanRecord
    from vibrissa.texture.relief import HeightProfile
    from vibrissa.texture.surface import Gaps
    from vibrissa.whisker import Whisker

CUT = 1e-3  # [L] of free end that the whisker keeps which is cut at its contact: the rod needs some


@dataclass(frozen=True)
class WholeJob:
    """A scan that is wanted.

    Attributes
    ----------
    whisker, posture, scan
        What is drawn past the surface, and how.
    choice : Choice
        The texture, as its controls say.
    sampled : bool
        Whether the dataset at 20 kHz is wanted, or what is drawn.
    surface : Gaps or HeightProfile
        The texture.
    """

    whisker: Whisker
    posture: Posture
    scan: Scan
    choice: Choice
    sampled: bool = False
    surface: Gaps | HeightProfile = field(compare=False, kw_only=True)

    def cut(self) -> WholeJob:
        """The same of a whisker that ends at its contact, but for 0.001 L.

        Returns
        -------
        WholeJob
            With another tip; the same one if it ends there already.
        """
        tip = max(self.whisker.tip, self.posture.contact - CUT)
        return replace(self, whisker=replace(self.whisker, tip=tip))


@dataclass(frozen=True)
class WholeScan:
    """A scan of the whole whisker.

    Attributes
    ----------
    record : ScanRecord
        What is drawn.
    facts : dict
        Numbers that the page shows, see :func:`vibrissa.page.answer.answers.facts`.
    verdict : str
        Of the rod on itself.
    """

    record: ScanRecord
    facts: dict[str, Any]
    verdict: str
