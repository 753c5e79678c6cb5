"""Mechanics of the whisker: postures, modes, vibration, the follicle, maps."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity, ends, ranged

_NONE = "; NaN with straight modes, which carry none"


def _at_the_base(name: str, unit: str, rate_unit: str, long_name: str) -> dict[str, Quantity]:
    """A signal of the follicle and its rate, each whole and in its two parts."""
    return {
        f"{name}{part}{rate}": Quantity(("time",), of_unit, f"{of}{long_name}{which}")
        for rate, of_unit, of in (("", unit, ""), ("_rate", rate_unit, "rate of the "))
        for part, which in (("", ""), ("_quasi_static", ", quasi-static part"), ("_vibration", ", vibration"))
    }


MECHANICS: dict[str, Quantity] = {
    # modes
    "contact": Quantity((), "1", "position ε of the contact or free end, over L, 0 at the tip of the cone"),
    "kappa": Quantity(("mode",), "1", "adimensional resonant angular frequency κ"),
    "resonant_frequency": Quantity(("mode",), "Hz", "resonant frequency κ/(2πk)"),
    "mode_shape": Quantity(("mode", "s"), "1", "mode shape V, orthonormal under s²"),
    "mode_curvature": Quantity(("mode", "s"), "1", "second derivative of the mode shape V''"),
    # modes about the curved profile
    "contact_law": Quantity(("contact_law",), "1", "what holds the contact: a point of the shaft, an edge, the flat"),
    "kappa_straight": Quantity(("mode",), "1", "κ of the straight shaft, pinned"),
    "resonance_ratio": Quantity(("mode",), "1", "κ about the curved profile over κ of the straight shaft"),
    "growth_rate": Quantity(("mode",), "1", "rate at which an unstable mode grows, times the timescale k; 0 if stable"),
    "mode_across": Quantity(("mode", "s"), "1", "mode about the curved profile, displacement along its normal"),
    "mode_along": Quantity(("mode", "s"), "1", "mode about the curved profile, displacement along the shaft"),
    "mode_rotation": Quantity(("mode", "s"), "1", "mode about the curved profile, rotation"),
    # statics, adimensional
    "angle": Quantity(("s",), "rad", "angle θ of the tangent to the substrate"),
    "base_angle": Quantity((), "rad", "angle θ_b at the base"),
    "contact_force": Quantity((), "1", "contact force Λ over πEα⁴L²/4"),
    "base_distance": Quantity((), "1", "distance H from base to substrate, over L"),
    "contact_distance": Quantity((), "1", "distance D from contact to base along the substrate, over L"),
    "profile_x": Quantity(("s",), "1", "position along the substrate from the contact, over L"),
    "profile_y": Quantity(("s",), "1", "height above the substrate, over L"),
    "unit_response": Quantity(("s",), "1", "quasi-static displacement per unit of excursion Ū"),
    "coupling": Quantity(("mode",), "1", "coupling of a mode to the excursion c"),
    "gap_width": Quantity((), "1", "width λ of the gap, over L"),
    "contact_angle": Quantity((), "rad", "angle θ_ε of the shaft at the contact"),
    "held_excursion": Quantity((), "1", "excursion d at which an edge holds the contact, over L"),
    "moment_scaled": Quantity((), "1", "bending moment at the base over πEα⁴L³/4"),
    "transverse_force_scaled": Quantity((), "1", "transverse force on the follicle over πEα⁴L²/4"),
    "axial_force_scaled": Quantity((), "1", "axial force into the follicle over πEα⁴L²/4"),
    "fold_determinant": Quantity((), "1", "determinant ∂(θ_b, D, H)/∂(ε, θ_ε, Λ), negative before the fold, 0 on it"),
    "static_contact_force": Quantity((), "N", "contact force"),
    "static_moment": Quantity((), "N m", "bending moment at the base, at rest"),
    "static_transverse_force": Quantity((), "N", "transverse force on the follicle, at rest"),
    "static_axial_force": Quantity((), "N", "axial force into the follicle, at rest"),
    "weight_ratio": Quantity((), "1", "own weight over contact force"),
    "trough": Quantity(("trough",), "1", "gap of the texture, in order of arrival"),
    "travel": Quantity((), "1", "travel of the texture since the far edge took the contact along, over L"),
    "jump_exact": Quantity(("mode",), "1", "jump of the mode's vibration, exact, over L"),
    "jump_linear": Quantity(("mode",), "1", "jump of the mode's vibration, linear c λ, over L"),
    "linearity": Quantity(
        ("mode",), "1", "exact over linear jump of the mode; of a texture, root mean square over its gaps"
    ),
    "mechanism": Quantity(("mode",), "1", "λω/v, λ the mean width: above 1 jumps drive the mode, below 1 ramps"),
    "free_end_length": Quantity((), "m", "length of the free end beyond the contact"),
    "free_end_dip": Quantity(("trough",), "m", "depth of the free end below the land behind the gap after the jump"),
    "jump_count": Quantity((), "1", "jumps of the contact"),
    "jumps_allowed": Quantity((), "1", "jumps that the free end allows: after them it clears the ground"),
    "jumps_allowed_share": Quantity((), "1", "share of the jumps of the contact that the free end allows"),
    "held_contact": Quantity(("trough",), "1", "where an edge holds the contact after the jump, mean of ε"),
    "held_shift": Quantity(("trough", "mode"), "1", "resonance while an edge holds the contact over that at ε, mean"),
    "held_share": Quantity(("trough",), "1", "share of t₂ to t₃ before the vibration lays the shaft on the land"),
    "sag_height": Quantity(("trough",), "m", "λ sin θ_ε, by which the shaft is off the land after the jump"),
    "single_contact": Quantity(("trough",), "1", "whether the free end clears the land and the bottom of the gap"),
    "least_contact_load": Quantity((), "1", "least vertical load on the contact over its value at rest"),
    "lift_off": Quantity((), "1", "share of the time at which the load on the contact is not positive"),
    "least_slip": Quantity((), "1", "least speed at which the contact slips over the ground, over the scanning speed"),
    "slip_reversed": Quantity((), "1", "share of the time at which the contact does not slip forwards: it would stick"),
    "frequency_rate": Quantity(
        ("time",), "1", "change of the frequency per radian of ringing |dω/dt|/ω², largest of modes"
    ),
    "gain_rate": Quantity(
        ("time",), "1", "change of the coupling per radian of ringing |dc/dt|/(ω|c|), largest of modes"
    ),
    "mode_mixing": Quantity(("time",), "1", "share of a mode's ringing that a moving contact sends to others, largest"),
    "ring_down_change": Quantity(("time",), "1", "relative change of frequency or coupling of mode 1 within 1/(ζω)"),
    "moment_contact": Quantity(("time",), "1", "position ε of a contact that moves along the shaft, over L"),
    "moment_base_angle": Quantity(("time",), "rad", "angle θ_b at a base that turns"),
    "moment_frequency": Quantity(("mode", "time"), "Hz", "resonant frequency of the moment's contact"),
    "moment_coupling": Quantity(("mode", "time"), "1", "coupling c of a mode, of the moment's posture"),
    "contact_advance": Quantity(("time",), "m", "place of the contact's ground on the texture"),
    "excursion_at_jump": Quantity((), "1", "excursion d₂ at which the contact jumps, over L"),
    # dynamics
    "excursion": Quantity(("time",), "1", "horizontal excursion d of the contact, over L"),
    "contact_ground": Quantity(("time",), "m", "point of the ground that the contact touches, along the scan"),
    "contact_rise": Quantity(("time",), "m", "height of the contact above the substrate line"),
    "valley_steps": Quantity((), "1", "jumps of the contact that are steps through smooth valleys: an artefact"),
    "longest_valley_step": Quantity((), "m", "longest step of the contact through a smooth valley"),
    "free_end_depth": Quantity(("time",), "m", "depth of the free end below the ground at worst; not resolved"),
    "mode_amplitude": Quantity(("mode", "time"), "1", "vibration amplitude q of a mode, over L"),
    "mode_displacement": Quantity(("mode", "time"), "1", "amplitude a movie shows, q + Q(d), over L"),
    "mode_sd": Quantity(("mode",), "1", "standard deviation of the mode's displacement over the record, over L"),
    "mode_displacement_sd": Quantity(("mode", "time"), "1", "standard deviation of the mode displacement"),
    "variance_explained": Quantity(("mode",), "1", "share of the displacement's variance in this mode"),
    "envelope": Quantity(("mode", "time"), "m", "envelope A of the mode displacement"),
    "expected_frequency": Quantity(("mode",), "Hz", "resonant frequency expected of the cone"),
    "phase": Quantity(("mode", "time"), "rad", "phase of a mode"),
    # spectra and resonance; `fit` names the signal and the forcing
    "fit": Quantity(("fit",), "1", "signal and forcing of the fit"),
    "power": Quantity(("mode", "frequency"), "1/Hz", "one-sided power spectral density, over L²"),
    "power_fit": Quantity(("mode", "frequency"), "1/Hz", "fitted power spectral density, over L²"),
    **ends("resonant_frequency", ("mode",), "Hz", "resonant frequency"),
    **ranged("damping", ("mode",), "1", "damping ratio ζ", "damping ratio"),
    # the follicle
    **_at_the_base("base_curvature", "1/m", "1/(m s)", "curvature at the base"),
    **_at_the_base("base_moment", "N m", "N m/s", "bending moment at the base"),
    **_at_the_base("transverse_force", "N", "N/s", "force on the follicle along the normal of the shaft"),
    **_at_the_base("axial_force", "N", "N/s", "force along the shaft into the follicle"),
    "axial_force": Quantity(("time",), "N", f"force along the shaft into the follicle{_NONE}"),
    "axial_force_vibration": Quantity(("time",), "N", f"force along the shaft into the follicle, vibration{_NONE}"),
    "axial_force_rate": Quantity(("time",), "N/s", f"rate of the force along the shaft into the follicle{_NONE}"),
    # the rod
    "largest_mode_displacement": Quantity(("mode",), "1", "largest amplitude that a movie shows, |q + Q(d)|, over L"),
    "rod_frequency": Quantity(("mode",), "Hz", "resonant frequency of the rod that slides and rolls on the flat"),
    "contact_state": Quantity(("time",), "1", "0 detached, 1 slip, 2 stick, 3 bridge"),
    "contact_count": Quantity(("time",), "1", "points at which the shaft touches the ground"),
    "first_contact": Quantity(("time",), "m", "contact that is nearest to the base, from the base along the shaft"),
    "last_contact": Quantity(("time",), "m", "contact that is nearest to the tip, from the base along the shaft"),
    "contact_load": Quantity(("time",), "N", "normal force of all contacts together"),
    "detached_share": Quantity((), "1", "share of the time without contact"),
    "slip_share": Quantity((), "1", "share of the time in which the contact slips"),
    "stick_share": Quantity((), "1", "share of the time in which every contact sticks"),
    "bridge_share": Quantity((), "1", "share of the time in which the shaft bridges a gap"),
    "unconverged_share": Quantity((), "1", "share of the steps whose iterations did not end"),
    "redone_share": Quantity((), "1", "share of the steps that were redone in parts"),
    "free_frequency": Quantity(("mode",), "Hz", "resonant frequency of the rod in the air"),
    "free_damping": Quantity(("mode",), "1", "damping ratio of the rod in the air"),
    "moment_base_height": Quantity(("time",), "m", "height of a base that moves above the substrate line"),
    "moment_base_travel": Quantity(("time",), "m", "way of the base along the substrate since the start"),
    "tip_ground": Quantity(("time",), "m", "place of the ground under the tip, along the scan"),
    "tip_height": Quantity(("time",), "m", "height of the tip above the substrate line"),
    "contact_event": Quantity(("contact_event",), "1", "number of the change of the contacts"),
    "contact_event_time": Quantity(("contact_event",), "s", "first sample after the change"),
    "contact_event_kind": Quantity(("contact_event",), "1", "attach, detach, slip, stick or bridge"),
    "contact_event_moment": Quantity(("contact_event",), "N m", "bending moment at the base at the change"),
    "surface_distance": Quantity((), "m", "distance from the base to x = 0 of the surface at the start"),
    # a signal measured at the base
    "base_moment_envelope": Quantity(("mode", "time"), "N m", "envelope of the moment about a resonance"),
    "base_curvature_envelope": Quantity(("mode", "time"), "1/m", "envelope of the curvature about a resonance"),
    "transverse_force_envelope": Quantity(("mode", "time"), "N", "envelope of the force about a resonance"),
    "base_moment_model": Quantity(("time",), "N m", "bending moment at the base, predicted"),
    "base_curvature_model": Quantity(("time",), "1/m", "curvature at the base, predicted"),
    "transverse_force_model": Quantity(("time",), "N", "force on the follicle along the normal, predicted"),
    "base_moment_envelope_model": Quantity(("mode", "time"), "N m", "envelope of the moment predicted"),
    "base_curvature_envelope_model": Quantity(("mode", "time"), "1/m", "envelope of the curvature predicted"),
    "transverse_force_envelope_model": Quantity(("mode", "time"), "N", "envelope of the force predicted"),
    "base_power": Quantity(("frequency",), "1/Hz", "one-sided power spectral density, over the signal's variance"),
    "base_power_fit": Quantity(("mode", "frequency"), "1/Hz", "fit with the texture's forcing, over the variance"),
    "base_power_white_fit": Quantity(("mode", "frequency"), "1/Hz", "fit with white forcing, over the variance"),
    "best_lag": Quantity(("mode",), "s", "lag of measurement behind prediction at which their envelopes agree best"),
    "rms_ratio": Quantity(("mode",), "1", "rms about a resonance, predicted over measured"),
    # maps over the context of a scan; led by the seeds where random gratings are drawn
    "seed": Quantity(("seed",), "1", "seed of the random grating"),
    "friction": Quantity(("friction",), "1", "coefficient of friction μ of the substrate"),
    "peak_displacement": Quantity(
        ("friction", "speed", "contact", "base_angle"), "1", "largest transverse displacement of a point, over L"
    ),
    "mode_rms": Quantity(
        ("friction", "speed", "contact", "base_angle"),
        "1",
        "rms of the displacement of a mode about its mean, over L; of a map, of mode 1",
    ),
    "jump_linearity": Quantity(
        ("friction", "contact", "base_angle"), "1", "exact over linear jump of mode 1 at the widest gap"
    ),
    "cell_reason": Quantity(("friction", "contact", "base_angle"), "1", "why a cell has no value; 0: it has one"),
    "exact_over_linear": Quantity(("contact", "base_angle"), "1", "largest displacement, exact over linear response"),
    "line_contact": Quantity(("line",), "1", "contact ε of a line, over L"),
    "line_angle": Quantity(("line",), "rad", "base angle of a line"),
    "line_gain_angle": Quantity(("line", "base_angle"), "1", "largest displacement at the contact of a line, over L"),
    "line_gain_contact": Quantity(("line", "contact"), "1", "largest displacement at the angle of a line, over L"),
    "cells_with_value": Quantity((), "1", "cells of the map that have a value"),
    "least_gain": Quantity((), "1", "least value of the map, over L"),
    "largest_gain": Quantity((), "1", "largest value of the map, over L"),
    # a texture on a curved surface: two channels
    "surface": Quantity(("surface",), "1", "shape and texture of the surface"),
    "surface_height": Quantity(("surface", "time"), "m", "height of the surface at x = v t"),
    "slow_moment": Quantity(("surface", "time"), "N m", "moment at the base below half the first resonance"),
    "slow_moment_alone": Quantity(("surface", "time"), "N m", "the same of the shape without texture"),
    "fast_envelope": Quantity(("surface", "time"), "1", "envelope of mode 1 above half its resonance, over L"),
    "fast_envelope_alone": Quantity(("surface", "time"), "1", "the same of the texture on level ground, over L"),
    "channel": Quantity(("channel",), "1", "what is read"),
    "cause": Quantity(("cause",), "1", "what it is read for"),
    "draw": Quantity(("draw",), "1", "texture drawn"),
    "share_told": Quantity(("draw", "channel", "cause"), "1", "held-out share of the cause's variance that is decoded"),
    "separation": Quantity(("draw",), "1", "separation of the channels: 1 perfect, 0 none"),
    "incline": Quantity(("incline",), "1", "slope of the shape at x = v t"),
    "envelope_gain": Quantity(("incline",), "1", "envelope on the shape over that on level ground"),
    "envelope_gain_se": Quantity(("incline",), "1", "standard error over textures"),
}
