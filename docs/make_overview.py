"""Draw the README's picture from the results of the built-in experiment.

python docs/make_overview.py RESULTS_FOLDER OUT.png
"""

import sys
from pathlib import Path

from vibrissa.figures.canvas import house_style, key_above, new_figure
from vibrissa.figures.colours import ENVELOPE, MEASURED, SINGLE, TRUTH
from vibrissa.figures.paper import fig3, fig4, fig5, fig8
from vibrissa.netcdf import load


@house_style
def draw(results):
    """Four panels along the chain: movie, mode, spectrum, neuron."""
    figure, axes = new_figure(9.0, 4.6, 2, 2, width_ratios=[1.25, 1])
    frame, mode = fig3.compute(results), fig4.compute(results)
    spectra, unit = fig5.compute(results), fig8.compute(results)

    axes[0, 0].imshow(frame.image, vmin=0)
    axes[0, 0].plot(frame.line_column[0], frame.line_row[0], ":", color=MEASURED, lw=1.6)
    axes[0, 0].set(title="1  A virtual movie, tracked", xlabel="column [pixel]", ylabel="row [pixel]")

    axes[1, 0].plot(mode.time, 1e3 * mode.mode_displacement_true[0], color=TRUTH, lw=3, label="truth")
    axes[1, 0].plot(mode.time, 1e3 * mode.mode_displacement[0], color=MEASURED, label="measured")
    axes[1, 0].set(title="2  First mode of the whisker", xlabel="time [s]", ylabel="displacement [10⁻³ L]")
    key_above(axes[1, 0])

    axes[0, 1].semilogy(spectra.frequency, spectra.power[0], color=MEASURED, label="measured")
    axes[0, 1].semilogy(spectra.frequency, spectra.power_fit[0], "k--", label="fit, texture known")
    f, zeta = float(spectra.resonant_frequency[0]), float(spectra.damping[0])
    axes[0, 1].set(title=f"3  Its resonance: {f:.1f} Hz, ζ = {zeta:.3f}", xlabel="frequency [Hz]", xlim=(0, 400))
    axes[0, 1].set(ylabel="power density [L²/Hz]", ylim=(1e-13, None))
    key_above(axes[0, 1])

    lag = 1e3 * unit.attrs["lag"] * unit.attrs["bin_width"]
    centre = unit.bin + unit.attrs["bin_width"] / 2
    axes[1, 1].plot(centre, unit.firing_rate / unit.firing_rate.max(), color=SINGLE, label="firing rate of one unit")
    axes[1, 1].plot(centre, unit.bin_envelope / unit.bin_envelope.max(), color=ENVELOPE, label="envelope near the base")
    axes[1, 1].set(
        title=f"4  A neuron follows the envelope, {lag:.0f} ms later: r = {unit.attrs['correlation']:.2f}",
        xlabel="time [s]",
    )
    axes[1, 1].set(ylabel="over its maximum", ylim=(0, 1.05), xlim=(0, 1))
    key_above(axes[1, 1])
    return figure


if __name__ == "__main__":
    folder, out = map(Path, sys.argv[1:])
    draw({path.stem: load(path) for path in folder.glob("*.nc")}).savefig(out, metadata={"Software": None})
