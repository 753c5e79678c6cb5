"""Draw what the profile's curvature does to modes and resonances.

python docs/make_curved.py [OUT.png]
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.exact import cone_kappa
from vibrissa.figures.canvas import house_style, new_figure
from vibrissa.figures.colours import KINDS
from vibrissa.mechanics.modes.basis import basis
from vibrissa.mechanics.modes.curved import curved_modes
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.scan.texture_prediction import predict
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.texture.surface import Gaps
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.040, cone_angle=1.5e-3)
POSTURE = Posture(contact=0.29, base_angle=1.2)
STRAIGHT, (CONSTANT, COULOMB, EDGE, FLAT) = "0.7", KINDS[:4]
EXUDYN = [(0.1, 1.2, 10.682), (0.3, 0.4, 23.323), (0.3, 0.8, 22.061), (0.3, 1.2, 19.932), (0.3, 1.4, 18.587)]
LINKS = [(0.3, 0.3, 23.6093), (0.3, 0.8, 21.4097), (0.3, 1.2, 17.5691), (0.3, 1.4, 14.7421)]  # benchmarks/peers/edge.py
WAYS = [
    ("flat ground", "flat", "coulomb", FLAT),
    ("a point, friction follows load", "slide", "coulomb", COULOMB),
    ("a point, friction constant", "slide", "constant", CONSTANT),
    ("an edge", "edge", "coulomb", EDGE),
]
SWING = 0.018  # of mode 1 as drawn, over L: far more than it moves


def draw_shapes(axes):
    """Mode 1 at both ends of its swing: straight, on an edge, on the flat."""
    flat, s = on_the_flat(POSTURE), np.linspace(0.29, 1, 200)
    x0, y0 = flat.position(s)
    foot_x, foot_y = flat.base
    edge = curved_modes(flat, 1, condition="edge")
    lying = curved_modes(flat, 1, condition="flat", law="coulomb")
    straight = basis("straight", flat, 1)
    for name, colour, modes in (("straight", STRAIGHT, straight), ("on an edge", EDGE, edge), ("on flat", FLAT, lying)):
        x, y = SWING * modes.displacement(s)[:, 0]
        for sign, label in ((1, name), (-1, None)):
            width = 3.5 if name == "straight" else 1.2
            axes.plot(x0 + foot_x + sign * x, y0 + foot_y + sign * y, color=colour, label=label, lw=width)
    axes.plot(x0 + foot_x, y0 + foot_y, color="black", lw=1.6)
    axes.axhline(0, color="0.8", zorder=0)
    axes.set(aspect="equal", xlabel="along the substrate / L", ylabel="height / L")
    axes.set_title("A  mode 1 about the profile (black)")
    axes.legend(loc="upper left")


def draw_resonances(axes):
    """κ₁ over that of the straight shaft, against the base angle."""
    angles = np.linspace(0.02, 1.5, 60)
    for contact, dashes in ((0.1, (3, 2)), (0.3, ())):
        straight = cone_kappa(contact, 1)[0]
        for name, condition, law, colour in WAYS:
            found = [
                curved_modes(Posture(contact=contact, base_angle=a), 1, condition=condition, law=law) for a in angles
            ]
            label = name if contact == 0.3 else None
            ratio = [modes.kappa[0] / straight if modes.growth[0] == 0 else np.nan for modes in found]
            axes.plot(angles, ratio, color=colour, dashes=dashes, label=label)
    for others, marker, label in ((EXUDYN, "o", "Exudyn"), (LINKS, "s", "chain of links")):
        dots = [(angle, kappa / cone_kappa(contact, 1)[0]) for contact, angle, kappa in others]
        axes.plot(*np.transpose(dots), marker, ls="", mfc="none", color="black", ms=5, label=label)
    axes.axhline(1, color=STRAIGHT, lw=0.8)
    axes.set(xlabel="base angle θ_b [rad]", ylabel="κ₁ / κ₁ straight", ylim=(0, 1.25))
    axes.set_title("B  first resonance, ε = 0.3 (dashed: 0.1)")
    axes.legend(loc="lower left", fontsize=7)


def draw_motion(axes):
    """One point of the shaft over the same gaps, by straight and by curved modes."""
    rng = np.random.default_rng(3)
    gaps, lands = rng.uniform(1e-4, 6e-4, 60), rng.uniform(1e-4, 6e-4, 60)
    position = 1e-3 + np.cumsum(lands) + np.concatenate([[0.0], np.cumsum(gaps)[:-1]])
    texture, t = Gaps(position=position, width=gaps), np.arange(0.05, 0.13, 5e-5)
    for modes, colour in (("straight", STRAIGHT), ("curved-coulomb", COULOMB), ("curved-edge", EDGE)):
        scan = Scan(speed=0.12, damping=0.11, modes=modes)
        prediction = predict(WHISKER, POSTURE, texture, scan)
        motion = 1e6 * WHISKER.length * prediction.displacement(t, np.array([0.6]))[:, 0]
        hertz = prediction.omega[0] / (2 * np.pi)
        axes.plot(1e3 * t, motion, color=colour, label=f"{modes}, {hertz:.0f} Hz")
    axes.set(xlabel="time [ms]", ylabel="displacement at s = 0.6 [µm]")
    axes.set_ylim(top=axes.get_ylim()[1] * 1.35)
    axes.set_title("C  the same gaps, 0.12 m/s")
    axes.legend(loc="upper left", ncols=2, columnspacing=0.8, handlelength=1.0, fontsize=7)


@house_style
def draw(_):
    """All three."""
    figure, axes = new_figure(11, 3.4, 1, 3, width_ratios=(1, 1, 1.35))
    for axis, panel in zip(axes[0], (draw_shapes, draw_resonances, draw_motion), strict=True):
        panel(axis)
    return figure


if __name__ == "__main__":
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "curved-modes.png"
    draw(None).savefig(out, metadata={"Software": None})
