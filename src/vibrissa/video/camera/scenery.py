"""What else a camera sees above a back-lit animal: drifting light, head and fur, the substrate's shadow, an LED.

Places are in the frame ``image``: x along the columns, y down the rows, [m], zero at the centre of the first pixel.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from vibrissa.video.camera.camera import FINITE, NOT_NEGATIVE, PLACE, POSITIVE, SHARE, Rule, check, counted


@dataclass(frozen=True, kw_only=True)
class Light:
    """Unevenness of the light beyond the plane of ``Camera.gradient``, and its drift; by default neither.

    Attributes
    ----------
    vignette : float
        Share of the light that the corners lack, below 1; it grows as the square of the distance from the middle.
    drift : float
        Standard deviation over time of the light's level, and likewise of its change from the middle to the right and
        to the lower edge, over the level; at most 0.08, so that the light never fails.
    drift_time : float
        Period of the fastest part of the drift [s].
    seed : int
        Seed of the drift.
    """

    vignette: float = 0.0
    drift: float = 0.0
    drift_time: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        check(self, Rule(lambda share: 0 <= share < 1, "must lie between 0 and 1, below 1"), vignette="")
        check(self, Rule(lambda share: 0 <= share <= 0.08, "must lie between 0 and 0.08"), drift="")
        check(self, POSITIVE, drift_time="s")
        counted("Light.seed", self.seed, least=0)


@dataclass(frozen=True, kw_only=True)
class Fur:
    """The head's silhouette at one side of the image, and the fur along its skin; it does not move.

    Hairs grow at random along the skin; their lengths are exponential, so that the hairs that reach a distance fall
    off as exp(−distance/length). A hair darkens as an infinitely thin whisker does, less and less towards its tip.

    Attributes
    ----------
    skin : float
        Distance of the skin from that side of the image, halfway down [m].
    side : {"left", "right"}
        Side of the image at which the head is.
    bulge : float
        How much farther the skin bulges halfway down than at the upper and lower edge [m]; a parabola.
    density : float
        Hairs per length of skin [1/m].
    length : float
        Mean length of a hair [m].
    spread : float
        Standard deviation of a hair's angle at its root about the normal of the side [rad].
    curvature : float
        Standard deviation of a hair's curvature [1/m].
    opacity : float
        Share of the light that a hair takes at its root, on its centreline.
    head : float
        Share of the light that the head takes.
    seed : int
        Seed of the hairs.
    """

    skin: float
    side: Literal["left", "right"] = "left"
    bulge: float = 0.0
    density: float = 2.5e4
    length: float = 0.8e-3
    spread: float = 0.4
    curvature: float = 150.0
    opacity: float = 0.7
    head: float = 1.0
    seed: int = 0

    def __post_init__(self) -> None:
        check(self, Rule(lambda side: side in ("left", "right"), "must be 'left' or 'right'"), side="")
        check(self, FINITE, skin="m", bulge="m")
        check(self, NOT_NEGATIVE, density="1/m", length="m", spread="rad", curvature="1/m")
        check(self, SHARE, opacity="", head="")
        counted("Fur.seed", self.seed, least=0)


@dataclass(frozen=True, kw_only=True)
class Shadow:
    """The substrate, whose straight border hides the contact, and the band of shadow before it.

    Attributes
    ----------
    substrate : (float, float)
        A point of the substrate's border, x and y [m].
    facing : float
        Direction from the border to the whiskers [rad]: 0 to the right, π/2 down, π to the left, −π/2 up.
    depth : float
        How far the shadow reaches from the border [m]; there half of its darkness is left. A whisker that comes in at a
        slant is hidden over a longer stretch: the paper's 3 mm are of the whisker.
    penumbra : float
        Standard deviation of the shadow's Gaussian edge [m].
    opacity : float
        Share of the light that substrate and shadow take.
    """

    substrate: tuple[float, float]
    facing: float
    depth: float
    penumbra: float = 0.1e-3
    opacity: float = 0.95

    def __post_init__(self) -> None:
        check(self, PLACE, substrate="m")
        check(self, FINITE, facing="rad")
        check(self, NOT_NEGATIVE, depth="m")
        check(self, POSITIVE, penumbra="m")
        check(self, SHARE, opacity="")


@dataclass(frozen=True, kw_only=True)
class Led:
    """A small lamp that tags the frame in which the texture starts; it does not move and stays lit.

    Attributes
    ----------
    position : (float, float)
        Its centre, x and y [m].
    start : float
        When it is switched on [s]; frame n is centred on n/frame_rate, and the frame then exposed shows it in part.
    radius : float
        Radius of its disc [m].
    brightness : float
        Grey levels that it adds.
    """

    position: tuple[float, float]
    start: float
    radius: float = 1e-3
    brightness: float = 255.0

    def __post_init__(self) -> None:
        check(self, PLACE, position="m")
        check(self, FINITE, start="s")
        check(self, POSITIVE, radius="m")
        check(self, NOT_NEGATIVE, brightness="")


@dataclass(frozen=True, kw_only=True)
class Scenery:
    """What is in the field beside the whiskers; by default nothing, in even and steady light.

    Attributes
    ----------
    light : Light
        Unevenness and drift.
    fur, shadow, led
        Absent if None.
    """

    light: Light = field(default_factory=Light)
    fur: Fur | None = None
    shadow: Shadow | None = None
    led: Led | None = None
