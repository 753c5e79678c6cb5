"""Draw docs/slow.png, a texture met while the base whisks, and print the remarks on it (half a minute).

python docs/make_slow.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from vibrissa.exact import cone_kappa, cone_modes, shaft_quadrature
from vibrissa.figures.canvas import house_style, new_figure
from vibrissa.figures.colours import KINDS, PREDICTED, TRUTH
from vibrissa.mechanics.quasi_static.response import quasi_static
from vibrissa.mechanics.scan.scan_settings import Scan
from vibrissa.mechanics.statics.edge_contact import on_the_flat
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.mechanics.vibration.dynamics import amplitudes
from vibrissa.mechanics.whisking.active_whisking import BLURRED, predict_slow, remarks
from vibrissa.mechanics.whisking.advance import TERMS
from vibrissa.mechanics.whisking.panels import fit
from vibrissa.mechanics.whisking.posture_path import PosturePath
from vibrissa.mechanics.whisking.slow_prediction import DRIFTING, FAST
from vibrissa.signals.envelope import analytic_envelope
from vibrissa.texture.surface import random_grating
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.040, cone_angle=1.5e-3, tip=0.05)
HEIGHT, ANGLE, SWING, RATE, DURATION = 0.45, 1.1, 0.1, 8.0, 0.5  # over L, rad, rad, Hz, s
SCAN = Scan(speed=0.15, damping=0.11)


def whisking():
    """A base at constant height whose angle swings."""
    t = np.linspace(0, DURATION, 201)
    angle = ANGLE + SWING * np.sin(2 * np.pi * RATE * t)
    return PosturePath(time=t, base_distance=np.full(t.size, HEIGHT), base_angle=angle)


def at_rest(slow, t):
    """Resonance and displacement of mode 1 in the mean posture, under the same history of the contact."""
    low, high = slow.table.borders[[0, -1]]
    response = quasi_static(Posture.at_height(HEIGHT, ANGLE), (float(low), float(high)), n_modes=1)
    borders = np.append(slow.advance.drive.time, slow.path.time[-1])
    drive = fit(lambda when: response(slow.excursion(when))[:1], borders, TERMS)
    omega = response.kappa / WHISKER.timescale
    return omega[0], (amplitudes(t, drive, omega, SCAN.damping) + drive(t))[0]


def own_inertia(path):
    """Amplitude of mode 1 that the inertia of the slow motion of the whole whisker makes, over L: left out."""
    t = np.linspace(0, 1 / RATE, 41)
    rest = on_the_flat(path.at(0.0))
    kappa = cone_kappa(rest.contact, 1)
    s, weights = shaft_quadrature(rest.contact, 100)
    shape = cone_modes(kappa, rest.contact, s)[0] * weights * s**2
    slow = np.array([shape @ rest.displaced(*on_the_flat(path.at(one)).position(s), s) for one in t])
    return float(np.abs(np.gradient(np.gradient(slow, t), t)[4:-4]).max() * (WHISKER.timescale / kappa[0]) ** 2)


BEHIND = {"facecolor": "white", "edgecolor": "none", "pad": 1}


@house_style
def draw(data):
    """Posture and resonance, the first mode, and the condition."""
    slow, omega, rest, t = data
    figure, axes = new_figure(7.2, 6.6, 3, 1, sharex=True)
    top, middle, bottom = axes[:, 0]
    top.plot(t, slow.omega(t)[0] / (2 * np.pi), color=PREDICTED)
    top.axhline(omega / (2 * np.pi), color="k", ls="--", lw=1)
    top.set(
        ylabel="resonance of mode 1 [Hz]", title="The base swings by ±0.1 rad, 8 times a second, at constant height"
    )
    twin = top.twinx()
    twin.plot(t[1:], np.diff(slow.travel(t)) / np.diff(t), color=KINDS[0])
    twin.set_ylabel("pace of the contact [m/s]", color=KINDS[0])
    twin.set_ylim(0, None)
    middle.plot(t, 1e3 * rest, color=TRUTH, lw=2.5, label="mean posture, contact's history the same")
    middle.plot(t, 1e3 * slow.mode_displacement(t)[0], color=PREDICTED, lw=0.9, label="moving posture")
    middle.set(ylabel="mode 1 [10⁻³ L]", ylim=(None, 1.35e3 * rest.max()))
    middle.legend(loc="upper right", ncols=2)
    condition = slow.condition
    for name, label in (
        ("frequency_rate", "frequency, per radian"),
        ("gain_rate", "gain, per radian"),
        ("mode_mixing", "to other modes"),
        ("ring_down_change", "mode 1, per ring-down"),
    ):
        bottom.semilogy(
            condition.time, condition[name], label=label, color="0.4" if name == "ring_down_change" else None
        )
    for limit, label in ((DRIFTING, "remark"), (FAST, "refused (remark, per ring-down)")):
        bottom.axhline(limit, color="k", ls=":", lw=1)
        bottom.text(0.002, limit * 1.12, label, va="bottom", fontsize="small", bbox=BEHIND)
    bottom.set(xlabel="time [s]", ylabel="relative change", ylim=(3e-4, 4), xlim=(0, DURATION))
    bottom.legend(loc="upper right", ncols=4, columnspacing=1.2, handlelength=1.2)
    return figure


def report(slow, rest, t):
    """Print the numbers of the page."""
    data = slow.condition
    for name in ("frequency_rate", "gain_rate", "mode_mixing", "ring_down_change"):
        print(f"{name}: largest {float(data[name].max()):.2g}")
    pace = np.diff(slow.travel(t)) / np.diff(t)
    print(f"contact {slow.contact(t).min():.3f} to {slow.contact(t).max():.3f} L")
    print(f"pace {pace.min():.3f} to {pace.max():.3f} m/s")
    print(f"resonance {slow.omega(t)[0].min() / 6.2832:.1f} to {slow.omega(t)[0].max() / 6.2832:.1f} Hz")
    print(f"gain {np.abs(slow.gain(t)[0]).min():.4f} to {np.abs(slow.gain(t)[0]).max():.4f}")
    one, two = slow.mode_displacement(t)[0], rest
    envelopes = analytic_envelope(np.stack([one - one.mean(), two - two.mean()]))[0]
    print(f"mean posture: rms {two.std() / one.std():.3f}; r {np.corrcoef(one, two)[0, 1]:.3f}")
    print(f"envelope r {np.corrcoef(envelopes)[0, 1]:.3f}")
    print(f"rms of q {slow.amplitudes(t)[0].std():.2g}, own inertia {own_inertia(slow.path):.2g}")
    print(f"table error {slow.table.error:.1g}; gaps met {slow.advance.meetings.start.size}")
    print(*remarks(slow, t), sep="\n")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    texture = random_grating(0.09, rng=np.random.default_rng(5))
    slow = predict_slow(WHISKER, whisking(), texture, SCAN)
    t = np.linspace(0, DURATION, 10_001)
    omega, rest = at_rest(slow, t)
    report(slow, rest, t)
    assert BLURRED == FAST  # one line in the picture
    draw((slow, omega, rest, t)).savefig(folder / "slow.png", metadata={"Software": None})
