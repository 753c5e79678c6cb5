"""Names, dimensions and units of everything that crosses a room: the one table.

Public model functions return ``dataset(...)``; entry points call ``require(...)``. Whisker, sweep, trial
and parameter dimensions may lead the core dimensions listed here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vibrissa import __version__
from vibrissa.errors import InputError

if TYPE_CHECKING:
    import xarray as xr


class Quantity(NamedTuple):
    """One variable: its core dimensions, SI unit ("1" if adimensional) and long name."""

    dims: tuple[str, ...]
    unit: str
    long_name: str


QUANTITIES: dict[str, Quantity] = {
    # coordinates
    "time": Quantity(("time",), "s", "time"),
    "node": Quantity(("node",), "1", "node along the shaft, from the skin"),
    "mode": Quantity(("mode",), "1", "mode number"),
    "whisker": Quantity(("whisker",), "1", "whisker"),
    "frequency": Quantity(("frequency",), "Hz", "frequency"),
    "s": Quantity(("s",), "1", "arc length over L, 0 at the cone's tip, 1 at the base"),
    "trial": Quantity(("trial",), "1", "trial"),
    "bin": Quantity(("bin",), "s", "start of the time bin"),
    # tracked and rendered centrelines
    "x": Quantity(("time", "node"), "m", "position of the centreline, x"),
    "y": Quantity(("time", "node"), "m", "position of the centreline, y"),
    "x_sd": Quantity(("time", "node"), "m", "standard deviation of x"),
    "y_sd": Quantity(("time", "node"), "m", "standard deviation of y"),
    "arc_length": Quantity(("node",), "m", "arc length from the skin"),
    "point_displacement": Quantity(("time",), "m", "transverse displacement of one point of the shaft"),
    "displacement": Quantity(("time", "node"), "m", "transverse displacement about the mean profile"),
    "frames": Quantity(("whisker",), "1", "frames in the movie"),
    "frames_followed": Quantity(("whisker",), "1", "frames in which the whisker was followed"),
    "median_length": Quantity(("whisker",), "m", "arc length followed, median over frames"),
    # the ends that the camera does not show, extrapolated
    "contact_x": Quantity((), "m", "position of the contact, x"),
    "contact_y": Quantity((), "m", "position of the contact, y"),
    "contact_arc_length": Quantity((), "m", "arc length of the contact from the skin"),
    "contact_height": Quantity((), "m", "height of the extrapolated contact above the substrate line"),
    "contact_x_sd": Quantity((), "m", "standard deviation of the contact's x"),
    "contact_y_sd": Quantity((), "m", "standard deviation of the contact's y"),
    "contact_arc_length_sd": Quantity((), "m", "standard deviation of the contact's arc length"),
    "contact_height_sd": Quantity((), "m", "standard deviation of the contact's height"),
    "contact_accepted": Quantity((), "1", "whether the contact lies on the substrate line, within its uncertainty"),
    "skin_x": Quantity((), "m", "where the whisker leaves the skin, x"),
    "skin_y": Quantity((), "m", "where the whisker leaves the skin, y"),
    "skin_arc_length": Quantity((), "m", "where the whisker leaves the skin, arc length"),
    "skin_x_sd": Quantity((), "m", "standard deviation of the skin's x"),
    "skin_y_sd": Quantity((), "m", "standard deviation of the skin's y"),
    "skin_arc_length_sd": Quantity((), "m", "standard deviation of the skin's arc length"),
    # modes
    "contact": Quantity((), "1", "position ε of the contact or free end, over L, 0 at the tip of the cone"),
    "kappa": Quantity(("mode",), "1", "adimensional resonant angular frequency κ"),
    "resonant_frequency": Quantity(("mode",), "Hz", "resonant frequency κ/(2πk)"),
    "mode_shape": Quantity(("mode", "s"), "1", "mode shape V, orthonormal under s²"),
    "mode_curvature": Quantity(("mode", "s"), "1", "second derivative of the mode shape V''"),
    # modes about the curved profile
    "contact_law": Quantity(("contact_law",), "1", "what holds the contact: a point of the shaft, an edge, the flat"),
    "kappa_straight": Quantity(("mode",), "1", "κ of the straight shaft, pinned"),
    "resonance_shift": Quantity(("mode",), "1", "κ about the curved profile over κ of the straight shaft"),
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
    "free_end_depth": Quantity(("time",), "m", "depth of the free end below the ground at worst; not resolved"),
    "mode_amplitude": Quantity(("mode", "time"), "1", "vibration amplitude q of a mode, over L"),
    "mode_displacement": Quantity(("mode", "time"), "1", "amplitude a movie shows, q + Q(d), over L"),
    "mode_sd": Quantity(("mode",), "1", "standard deviation of the mode's displacement over the record, over L"),
    "mode_displacement_sd": Quantity(("mode", "time"), "1", "standard deviation of the mode displacement"),
    "variance_explained": Quantity(("mode",), "1", "share of the displacement's variance in this mode"),
    "envelope": Quantity(("mode", "time"), "1", "envelope A of the mode displacement, over L"),
    "phase": Quantity(("mode", "time"), "rad", "phase of a mode"),
    # spectra and resonance; `fit` tells which signal and which forcing
    "fit": Quantity(("fit",), "1", "signal and forcing of the fit"),
    "power": Quantity(("mode", "frequency"), "1/Hz", "one-sided power spectral density, over L²"),
    "power_fit": Quantity(("mode", "frequency"), "1/Hz", "fitted power spectral density, over L²"),
    "resonant_frequency_low": Quantity(("mode",), "Hz", "resonant frequency, lower end of the 95 % interval"),
    "resonant_frequency_high": Quantity(("mode",), "Hz", "resonant frequency, upper end of the 95 % interval"),
    "damping": Quantity(("mode",), "1", "damping ratio ζ"),
    "damping_low": Quantity(("mode",), "1", "damping ratio, lower end of the 95 % interval"),
    "damping_high": Quantity(("mode",), "1", "damping ratio, upper end of the 95 % interval"),
    # the follicle
    "base_curvature": Quantity(("time",), "1/m", "curvature at the base"),
    "base_curvature_quasi_static": Quantity(("time",), "1/m", "curvature at the base, quasi-static part"),
    "base_curvature_vibration": Quantity(("time",), "1/m", "curvature at the base, vibration"),
    "base_curvature_rate": Quantity(("time",), "1/(m s)", "rate of the curvature at the base"),
    "base_curvature_quasi_static_rate": Quantity(
        ("time",), "1/(m s)", "rate of the curvature at the base, quasi-static part"
    ),
    "base_curvature_vibration_rate": Quantity(("time",), "1/(m s)", "rate of the curvature at the base, vibration"),
    "base_moment": Quantity(("time",), "N m", "bending moment at the base"),
    "base_moment_quasi_static": Quantity(("time",), "N m", "bending moment at the base, quasi-static part"),
    "base_moment_vibration": Quantity(("time",), "N m", "bending moment at the base, vibration"),
    "base_moment_rate": Quantity(("time",), "N m/s", "rate of the bending moment at the base"),
    "base_moment_quasi_static_rate": Quantity(
        ("time",), "N m/s", "rate of the bending moment at the base, quasi-static part"
    ),
    "base_moment_vibration_rate": Quantity(("time",), "N m/s", "rate of the bending moment at the base, vibration"),
    "transverse_force": Quantity(("time",), "N", "force on the follicle along the normal of the shaft"),
    "transverse_force_quasi_static": Quantity(
        ("time",), "N", "force on the follicle along the normal of the shaft, quasi-static part"
    ),
    "transverse_force_vibration": Quantity(
        ("time",), "N", "force on the follicle along the normal of the shaft, vibration"
    ),
    "transverse_force_rate": Quantity(
        ("time",), "N/s", "rate of the force on the follicle along the normal of the shaft"
    ),
    "transverse_force_quasi_static_rate": Quantity(
        ("time",), "N/s", "rate of the force on the follicle along the normal of the shaft, quasi-static part"
    ),
    "transverse_force_vibration_rate": Quantity(
        ("time",), "N/s", "rate of the force on the follicle along the normal of the shaft, vibration"
    ),
    "axial_force": Quantity(("time",), "N", "force along the shaft into the follicle; not modelled, NaN"),
    "axial_force_quasi_static": Quantity(("time",), "N", "force along the shaft into the follicle, quasi-static part"),
    "axial_force_vibration": Quantity(
        ("time",), "N", "force along the shaft into the follicle, vibration; not modelled, NaN"
    ),
    "axial_force_rate": Quantity(
        ("time",), "N/s", "rate of the force along the shaft into the follicle; not modelled, NaN"
    ),
    "axial_force_quasi_static_rate": Quantity(
        ("time",), "N/s", "rate of the force along the shaft into the follicle, quasi-static part"
    ),
    "axial_force_vibration_rate": Quantity(
        ("time",), "N/s", "rate of the force along the shaft into the follicle, vibration"
    ),
    # a signal measured at the base
    "base_moment_envelope": Quantity(("mode", "time"), "N m", "envelope of the moment about a resonance"),
    "base_curvature_envelope": Quantity(("mode", "time"), "1/m", "envelope of the curvature about a resonance"),
    "transverse_force_envelope": Quantity(("mode", "time"), "N", "envelope of the force about a resonance"),
    "base_power": Quantity(("frequency",), "1/Hz", "one-sided power spectral density, over the signal's variance"),
    "base_power_fit": Quantity(("mode", "frequency"), "1/Hz", "fit with the texture's forcing, over the variance"),
    "base_power_white_fit": Quantity(("mode", "frequency"), "1/Hz", "fit with white forcing, over the variance"),
    "best_lag": Quantity(("mode",), "s", "lag of measurement behind prediction at which their envelopes agree best"),
    "rms_ratio": Quantity(("mode",), "1", "rms about a resonance, predicted over measured"),
    # pictures
    "row": Quantity(("row",), "1", "row of the image, down"),
    "column": Quantity(("column",), "1", "column of the image"),
    "image": Quantity(("row", "column"), "1", "grey level"),
    # what figures draw
    "line_column": Quantity(("node",), "1", "column of the centreline [pixel]"),
    "line_row": Quantity(("node",), "1", "row of the centreline [pixel]"),
    "node_motion": Quantity(("time", "trace"), "m", "y of a node about its mean"),
    "node_motion_true": Quantity(("time", "trace"), "m", "true y of a node about its mean"),
    "trace_arc": Quantity(("trace",), "m", "arc length of the node"),
    "shaft_x": Quantity(("shaft",), "m", "position along the substrate from the contact, at rest"),
    "shaft_y": Quantity(("shaft",), "m", "height above the substrate, at rest"),
    "field_x": Quantity(("corner",), "m", "corner of the field of view, along the substrate from the contact"),
    "field_y": Quantity(("corner",), "m", "corner of the field of view, above the substrate"),
    "trough_start": Quantity(("trough",), "m", "edge of a gap that meets the contact first"),
    "trough_width": Quantity(("trough",), "m", "width of a gap"),
    "field_arc": Quantity(("field_node",), "m", "arc length of the node from the skin"),
    "mean_x": Quantity(("field_node",), "m", "mean position, x"),
    "mean_y": Quantity(("field_node",), "m", "mean position, y"),
    "motion_x": Quantity(("instant", "field_node"), "m", "displacement about the mean position, x"),
    "motion_y": Quantity(("instant", "field_node"), "m", "displacement about the mean position, y"),
    "along_share": Quantity(("field_node",), "1", "share of the motion's power along the shaft, of tracked nodes"),
    "along_share_unstretched": Quantity(
        ("field_node",), "1", "share along the shaft that follows from the motion across it, without stretch"
    ),
    "along_share_true": Quantity(("field_node",), "1", "true share of the motion's power along the shaft"),
    "run": Quantity(("run",), "1", "run of the same scan"),
    "repetition": Quantity(("repetition",), "1", "repetition of the experiment"),
    "run_time": Quantity(("run_time",), "s", "time of one run"),
    "run_motion": Quantity(("repetition", "run", "run_time"), "m", "y of one node about its mean"),
    "run_motion_true": Quantity(("repetition", "run", "run_time"), "m", "true y of one node about its mean"),
    "run_correlation": Quantity(("repetition", "run"), "1", "correlation with the mean of all runs"),
    "run_correlation_others": Quantity(("repetition", "run"), "1", "correlation with the mean of the other runs"),
    "run_correlation_true": Quantity(("repetition", "run"), "1", "correlation of true motion with the mean"),
    "deformation": Quantity(("s",), "m", "transverse displacement at one instant"),
    "mode_part": Quantity(("mode", "s"), "m", "share of a mode in the deformation"),
    "mode_displacement_true": Quantity(("mode", "time"), "1", "true mode displacement, over L"),
    "power_true": Quantity(("mode", "frequency"), "1/Hz", "power spectral density of the true signal, over L²"),
    "power_white_fit": Quantity(("mode", "frequency"), "1/Hz", "fit with white forcing (Eq. 5), over L²"),
    "envelope_found": Quantity(("mode", "time"), "1", "envelope found, over its mean"),
    "envelope_predicted": Quantity(("mode", "time"), "1", "envelope predicted, over the mean of the one found"),
    "correlation": Quantity(("mode",), "1", "correlation of the two envelopes"),
    # what the model's figures draw: a gap crossed (2), gaps and gratings compared (6)
    "stage": Quantity(("stage",), "1", "profile U₁ on the flat, U₂ before the jump, U₃ after it"),
    "stage_contact": Quantity(("stage",), "1", "position ε of the contact along the shaft, over L"),
    "stage_excursion": Quantity(("stage",), "1", "excursion d, over L"),
    "stage_x": Quantity(("stage", "s"), "m", "position along the substrate from the far edge of the gap"),
    "stage_height": Quantity(("stage", "s"), "m", "height above the substrate"),
    "stage_displacement": Quantity(("stage", "s"), "1", "transverse displacement U − U₁, over L"),
    "stage_response": Quantity(("stage", "s"), "1", "transverse displacement per unit of excursion (U − U₁)/d"),
    "event": Quantity(("event",), "1", "number of the event: an edge taken (1), the jump (2), the flat again (3)"),
    "event_time": Quantity(("event",), "s", "time of the event"),
    "mode_jump": Quantity(("mode",), "1", "jump of the vibration amplitude, over L"),
    "form": Quantity(("form",), "1", "form of the quasi-static response"),
    "gap": Quantity(("gap",), "m", "width λ of the gap"),
    "signal": Quantity(("signal",), "1", "name of the signal"),
    "signal_unit": Quantity(("signal",), "1", "unit of the signal's peak over λ"),
    "peak_over_width": Quantity(("form", "signal", "gap"), "1", "largest value over λ, unit in signal_unit"),
    "collapse_spread": Quantity(("form", "signal"), "1", "range of peak over λ among the gaps, over its mean"),
    "jump_response": Quantity(("mode", "time"), "1", "vibration amplitude after the jump alone, over L"),
    "reading": Quantity(("reading",), "1", "reading of the random grating"),
    "speed": Quantity(("speed",), "m/s", "scanning speed"),
    "gain_displacement": Quantity(("form", "reading", "speed"), "1", "rms of the displacement of mode 1, over L"),
    "gain_displacement_se": Quantity(("form", "reading", "speed"), "1", "standard error over textures, over L"),
    "gain_vibration": Quantity(("form", "reading", "speed"), "1", "rms of the vibration of mode 1, over L"),
    "gain_vibration_se": Quantity(("form", "reading", "speed"), "1", "standard error over textures, over L"),
    # maps over the context of a scan
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
    # posture from the mean profile
    "contact_low": Quantity((), "1", "contact ε over L, lower end of the 95 % interval"),
    "contact_high": Quantity((), "1", "contact ε over L, upper end of the 95 % interval"),
    "base_angle_low": Quantity((), "rad", "base angle, lower end of the 95 % interval"),
    "base_angle_high": Quantity((), "rad", "base angle, upper end of the 95 % interval"),
    "base_height_se": Quantity((), "m", "standard error of the base's distance from the substrate"),
    "base_height_low": Quantity((), "m", "base's distance from the substrate, lower end of the 95 % interval"),
    "base_height_high": Quantity((), "m", "base's distance from the substrate, upper end of the 95 % interval"),
    "friction_found": Quantity((), "1", "coefficient of friction μ, given or found"),
    "friction_low": Quantity((), "1", "μ, lower end of the 95 % interval within [0, 2]"),
    "friction_high": Quantity((), "1", "μ, upper end of the 95 % interval within [0, 2]"),
    "friction_identified": Quantity((), "1", "whether the profile tells μ"),
    "bend_r2": Quantity((), "1", "share of the mean profile's distance from a straight line that Eq. 1 explains"),
    "fitted_x": Quantity(("s",), "m", "curve of Eq. 1 laid on the mean profile, x"),
    "fitted_y": Quantity(("s",), "m", "curve of Eq. 1 laid on the mean profile, y"),
    # a whisker told by its own tracks
    "length_low": Quantity((), "m", "length L, lower end of the 95 % interval; NaN if open"),
    "length_high": Quantity((), "m", "length L, upper end of the 95 % interval; NaN if open"),
    "timescale_low": Quantity((), "s", "timescale k, lower end of the 95 % interval"),
    "timescale_high": Quantity((), "s", "timescale k, upper end of the 95 % interval"),
    "youngs_modulus_low": Quantity((), "Pa", "Young's modulus, lower end of the 95 % interval"),
    "youngs_modulus_high": Quantity((), "Pa", "Young's modulus, upper end of the 95 % interval"),
    "damping_all": Quantity((), "1", "damping ratio ζ, one for all modes"),
    "damping_all_low": Quantity((), "1", "damping ratio of all modes, lower end of the 95 % interval"),
    "damping_all_high": Quantity((), "1", "damping ratio of all modes, upper end of the 95 % interval"),
    "damping_spread": Quantity((), "1", "χ² of the modes' own damping about it, over its degrees of freedom"),
    "tried_length": Quantity(("tried_length",), "m", "length L tried"),
    "deviance": Quantity(("tried_length",), "1", "deviance of a length tried, 0 at the likeliest"),
    # geometry and stationary profile, drawn (1)
    "cone": Quantity(("cone",), "1", "name of a whisker whose diameters are shown"),
    "cone_distance": Quantity(("cone", "cone_point"), "m", "distance from the base along the shaft"),
    "cone_diameter": Quantity(("cone", "cone_point"), "m", "diameter of the shaft"),
    "cone_length": Quantity(("cone",), "m", "length L at which the straight line through the diameters vanishes"),
    "cone_base": Quantity(("cone",), "m", "diameter at the base, of the straight line"),
    "course_x": Quantity(("course_node",), "m", "mean place of a node, x"),
    "course_y": Quantity(("course_node",), "m", "mean place of a node, y"),
    "course_s": Quantity(("course_node",), "1", "arc length of a node over L, from the tip of the cone"),
    "course_angle": Quantity(("course_node",), "rad", "angle of the mean profile to the substrate, by chords"),
    "course_residual": Quantity(("course_node",), "m", "distance of a node across the curve of Eq. 1"),
    "parabola_x": Quantity(("parabola_point",), "m", "second-degree polynomial through the visible end, x"),
    "parabola_y": Quantity(("parabola_point",), "m", "second-degree polynomial through the visible end, y"),
    "parabola_s": Quantity(("parabola_point",), "1", "arc length on the polynomial over L"),
    "parabola_angle": Quantity(("parabola_point",), "rad", "angle of the polynomial to the substrate"),
    # the table of sweeps; `length`, `contact`, `friction`, `run`, `mode_rms`, `resonant_frequency` … lead with `sweep`
    "sweep": Quantity(("sweep",), "1", "sweep: one whisker drawn once over one texture"),
    "animal": Quantity((), "1", "name of the animal"),
    "whisker_name": Quantity((), "1", "name of the whisker"),
    "texture": Quantity((), "1", "number of the texture"),
    "condition": Quantity((), "1", "number of the whisker's condition: posture and speed, whatever the texture"),
    "scan_speed": Quantity((), "m/s", "scanning speed v"),
    "base_height": Quantity((), "m", "distance H from base to substrate"),
    "contact_se": Quantity((), "1", "standard error of the contact's position, over L"),
    "base_angle_se": Quantity((), "rad", "standard error of the base angle"),
    "friction_se": Quantity((), "1", "standard error of the coefficient of friction"),
    "profile_r2": Quantity((), "1", "share of the mean profile's variance in the angle that Eq. 1 explains"),
    "fit_r2": Quantity(("mode",), "1", "share of the spectrum's variance that the fitted line explains"),
    "resonant_frequency_white": Quantity(("mode",), "Hz", "resonant frequency, forcing taken for white"),
    "resonant_frequency_white_low": Quantity(("mode",), "Hz", "the same, lower end of the 95 % interval"),
    "resonant_frequency_white_high": Quantity(("mode",), "Hz", "the same, upper end of the 95 % interval"),
    "damping_white": Quantity(("mode",), "1", "damping ratio, forcing taken for white"),
    "damping_white_low": Quantity(("mode",), "1", "the same, lower end of the 95 % interval"),
    "damping_white_high": Quantity(("mode",), "1", "the same, upper end of the 95 % interval"),
    "fit_r2_white": Quantity(("mode",), "1", "share of the spectrum's variance on the line of white forcing"),
    "contact_true": Quantity((), "1", "true position ε of the contact, over L"),
    "base_angle_true": Quantity((), "rad", "true base angle θ_b"),
    "friction_true": Quantity((), "1", "true coefficient of friction"),
    "resonant_frequency_true": Quantity(("mode",), "Hz", "true resonant frequency"),
    "damping_true": Quantity(("mode",), "1", "true damping ratio"),
    "youngs_modulus_true": Quantity((), "Pa", "true Young's modulus"),
    "mode_rms_true": Quantity(("mode",), "1", "rms of the true displacement of a mode about its mean, over L"),
    "mode_rms_model": Quantity(("mode",), "1", "rms of a mode's displacement as predicted from what was found, over L"),
    "mode_displacement_model": Quantity(
        ("mode", "time"), "1", "mode displacement predicted from what was found, over L"
    ),
    "envelope_model": Quantity(("mode", "time"), "1", "envelope of the predicted mode displacement, over L"),
    "phase_jitter": Quantity((), "m", "rms of the tip's motion along the texture beside the steady scan"),
    "accepted": Quantity((), "1", "whether the sweep was analysed to the end"),
    "rejected": Quantity((), "1", "why a sweep was not analysed; nothing where it was"),
    # prediction against measurement, and the gain
    "unlagged_correlation": Quantity(("mode",), "1", "correlation of the two envelopes without lag"),
    "pearson_p": Quantity(("mode",), "1", "p-value of the correlation, every sample taken for an independent draw"),
    "pseudo_p": Quantity(("mode",), "1", "share of correlations with other textures' predictions at least as large"),
    "pseudo_count": Quantity((), "1", "other textures whose predictions were held against the measurement"),
    "chance_mean": Quantity(("mode",), "1", "mean correlation with other textures' predictions, each at its best lag"),
    "chance_sd": Quantity(("mode",), "1", "standard deviation of the same"),
    "jitter": Quantity(("jitter",), "m", "standard deviation of the tip's motion along the texture"),
    "jitter_time": Quantity(("jitter_time",), "s", "shortest period of that motion"),
    "jittered_correlation": Quantity(("jitter_time", "jitter"), "1", "correlation of envelopes without and with it"),
    "jittered_correlation_sd": Quantity(("jitter_time", "jitter"), "1", "standard deviation over draws"),
    "jittered_repeat": Quantity(
        ("jitter_time", "jitter"), "1", "correlation of the motion of one run with the mean of five, each with its own"
    ),
    "sweep_gain": Quantity(("source", "sweep"), "1", "rms of mode 1 about its mean, over L"),
    "term": Quantity(("term",), "1", "what an effect is of"),
    "subset": Quantity(("subset",), "1", "which sweeps"),
    "effect_slope": Quantity(("term",), "1", "slope per standard deviation of the term"),
    "effect_low": Quantity(("term",), "1", "the same, lower end of the 95 % interval, by cluster"),
    "effect_high": Quantity(("term",), "1", "the same, upper end of the 95 % interval, by cluster"),
    "effect_p": Quantity(("term",), "1", "p-value, every sweep taken for an independent draw"),
    "effect_p_clustered": Quantity(("term",), "1", "p-value, whiskers of animals taken for the independent draws"),
    "effect_n": Quantity(("term",), "1", "sweeps used"),
    "example": Quantity(("example",), "1", "number of the sweep shown"),
    "distance_scanned": Quantity(("distance_scanned",), "m", "distance scanned"),
    "example_speed": Quantity(("example",), "m/s", "scanning speed v"),
    "example_contact": Quantity(("example",), "1", "contact ε, over L"),
    "example_angle": Quantity(("example",), "rad", "base angle θ_b"),
    "example_frequency": Quantity(("example",), "Hz", "resonant frequency of mode 1 found"),
    "example_correlation": Quantity(("example",), "1", "correlation of predicted and measured envelope of mode 1"),
    "example_mode": Quantity(("example", "distance_scanned"), "1", "displacement of mode 1, over L"),
    "example_envelope": Quantity(("example", "distance_scanned"), "1", "envelope of mode 1 found, over L"),
    "example_predicted": Quantity(
        ("example", "distance_scanned"), "1", "envelope of mode 1 predicted, of the mean of the one found, over L"
    ),
    "pair": Quantity(("pair",), "1", "pair of sweeps"),
    "pair_same_texture": Quantity(("pair",), "1", "whether both sweeps of a pair had the same texture"),
    "offset": Quantity(("offset",), "m", "offset in the distance scanned"),
    "pair_correlogram": Quantity(("pair", "offset"), "1", "correlation of two envelopes as functions of distance"),
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
    "share_told": Quantity(("draw", "channel", "cause"), "1", "held-out share of the cause's variance that is told"),
    "separation": Quantity(("draw",), "1", "separation of the channels: 1 perfect, 0 none"),
    "incline": Quantity(("incline",), "1", "slope of the shape at x = v t"),
    "envelope_gain": Quantity(("incline",), "1", "envelope on the shape over that on level ground"),
    "envelope_gain_se": Quantity(("incline",), "1", "standard error over textures"),
    # geometry
    "length": Quantity((), "m", "length L of the nontruncated cone"),
    "cone_angle": Quantity((), "rad", "cone angle α, base radius over L"),
    "tip": Quantity((), "1", "position of the physical tip, over L"),
    "base_radius": Quantity((), "m", "radius at the base"),
    "physical_length": Quantity((), "m", "length of the whisker itself"),
    "timescale": Quantity((), "s", "timescale k = (2L/α)√(ρ/E)"),
    "youngs_modulus": Quantity((), "Pa", "Young's modulus E"),
    "density": Quantity((), "kg/m³", "density ρ"),
    "length_se": Quantity((), "m", "standard error of L"),
    "cone_angle_se": Quantity((), "rad", "standard error of α"),
    "base_radius_se": Quantity((), "m", "standard error of the base radius"),
    "tip_se": Quantity((), "1", "standard error of the tip's position"),
    "timescale_se": Quantity((), "s", "standard error of k"),
    "residual_sd": Quantity((), "m", "standard deviation of the diameters about the line"),
    "r_squared": Quantity((), "1", "share of the diameters' variance on the line"),
    "points": Quantity((), "1", "number of diameters"),
    # the atlas: means over the whiskers of one position
    "position": Quantity(("position",), "1", "row and column on the snout"),
    "n_whiskers": Quantity(("position",), "1", "whiskers with length and base diameter"),
    "n_cones": Quantity(("position",), "1", "whiskers whose cone is known"),
    "mean_arc_length": Quantity(("position",), "m", "arc length from skin to tip"),
    "mean_length": Quantity(("position",), "m", "length L of the nontruncated cone"),
    "sd_length": Quantity(("position",), "m", "standard deviation of L"),
    "mean_base_diameter": Quantity(("position",), "m", "base diameter"),
    "mean_cone_angle": Quantity(("position",), "rad", "cone angle α"),
    "sd_cone_angle": Quantity(("position",), "rad", "standard deviation of α"),
    "mean_tip": Quantity(("position",), "1", "position of the physical tip, over L"),
    "first_resonance_in_air": Quantity(("position",), "Hz", "first resonance of the mean cone, free tip"),
    "measured_first": Quantity(("position",), "Hz", "first resonance, measured"),
    "predicted_first": Quantity(("position",), "Hz", "first resonance, predicted"),
    "measured_second": Quantity(("position",), "Hz", "second resonance, measured"),
    "predicted_second": Quantity(("position",), "Hz", "second resonance, predicted"),
    "measured_third": Quantity(("position",), "Hz", "third resonance, measured"),
    "predicted_third": Quantity(("position",), "Hz", "third resonance, predicted"),
    "measured_first_impulse": Quantity(("position",), "Hz", "first resonance, measured after an impulse"),
    "measured_damping": Quantity(("position",), "1", "damping ratio of the first mode, measured"),
    "distance": Quantity(("point",), "m", "distance from the base along the shaft"),
    "diameter": Quantity(("point",), "m", "diameter of the shaft"),
    # neurons
    "spike_time": Quantity(("spike",), "s", "time of a spike in its trial"),
    "spike_trial": Quantity(("spike",), "1", "trial of a spike"),
    "firing_rate": Quantity(("bin",), "Hz", "firing rate averaged over trials"),
    "bin_envelope": Quantity(("bin",), "m", "envelope averaged over the bin"),
    "bin_envelope_true": Quantity(("bin",), "m", "true envelope averaged over the bin"),
    # units, trials and quality
    "spike_unit": Quantity(("spike",), "1", "unit of a spike, index into the names"),
    "unit_name": Quantity(("unit",), "1", "name of a unit"),
    "unit_whisker": Quantity(("unit",), "1", "principal whisker of a unit"),
    "unit_quality": Quantity(("unit",), "1", "single unit SU or multi-unit MU"),
    "unit_observed": Quantity(("unit", "trial"), "1", "whether the unit was observed throughout the trial's window"),
    "interval_start": Quantity(("interval",), "s", "start of an interval in which a unit was observed"),
    "interval_stop": Quantity(("interval",), "s", "end of an interval in which a unit was observed"),
    "interval_unit": Quantity(("interval",), "1", "unit of an interval of observation"),
    "trial_start": Quantity(("trial",), "s", "onset of a trial on the session's clock"),
    "trial_stop": Quantity(("trial",), "s", "end of a trial on the session's clock"),
    "trial_stimulus": Quantity(("trial",), "1", "stimulus of a trial"),
    "bin_stop": Quantity(("bin",), "s", "end of the time bin"),
    "marker_time": Quantity(("marker",), "s", "time of a recorded event on the session's clock"),
    "marker_label": Quantity(("marker",), "1", "label of a recorded event"),
    "unit_id": Quantity(("unit",), "1", "number of a unit in its file"),
    "unit_electrode": Quantity(("unit",), "1", "electrode nearest to a unit, from 0 along the shanks"),
    "unit_waveform": Quantity(("unit", "sample"), "V", "mean waveform of a unit"),
    "replayed_envelope": Quantity(("whisker", "time"), "m", "envelope of the command"),
    "spike_count": Quantity(("trial", "bin"), "1", "spikes of a trial in a bin"),
    "firing_rate_se": Quantity(("bin",), "Hz", "standard error of the firing rate over trials"),
    "trials_observed": Quantity((), "1", "trials over which the firing rate is averaged"),
    "snr_smallest": Quantity(("unit",), "1", "peak-to-peak of the smallest waveform over the noise's rms"),
    "snr_mean": Quantity(("unit",), "1", "peak-to-peak of the mean waveform over the noise's MAD/0.6745"),
    "unit_rate": Quantity(("unit",), "Hz", "firing rate of a unit over the window stated"),
    "refractory_violations": Quantity(("unit",), "1", "share of intervals below the refractory period"),
    "contamination": Quantity(("unit",), "1", "share of foreign spikes expected from the refractory violations"),
    "kept": Quantity(("unit",), "1", "whether a unit meets the rules of inclusion"),
    "reason": Quantity(("unit",), "1", "why a unit is left out"),
    # the stimulator: commands, what the filter does to resonances, command against motion
    "command": Quantity(("whisker", "time"), "m", "displacement commanded, 0 at rest"),
    "delay": Quantity(("whisker",), "s", "delay of the copy, circular"),
    "start_value": Quantity(("whisker",), "m", "displacement commanded at the first sample"),
    "copy_correlation": Quantity(("whisker",), "1", "largest |r| with any other copy"),
    "largest_correlation": Quantity((), "1", "largest |r| between two copies"),
    "rms_correlation": Quantity((), "1", "rms of the loop's circular autocorrelation over all lags"),
    "peak_travel": Quantity((), "m", "largest displacement from rest"),
    "peak_speed": Quantity((), "m/s", "largest speed commanded"),
    "peak_acceleration": Quantity((), "m/s²", "largest acceleration commanded"),
    "band_gain": Quantity(("frequency",), "1", "gain of the stimulator's band"),
    "band_phase": Quantity(("frequency",), "rad", "phase of the stimulator's band"),
    "band_group_delay": Quantity(("frequency",), "s", "group delay of the stimulator's band"),
    "seam": Quantity(("seam",), "1", "seam between textures; the last goes over into the first at 1"),
    "seam_time": Quantity(("seam",), "s", "start of the overlap, before delays"),
    "seam_step": Quantity(("seam",), "1", "largest step in value at the seam, over the largest elsewhere"),
    "seam_bend": Quantity(("seam",), "1", "largest step in slope at the seam, over the largest elsewhere"),
    "seam_step_unfiltered": Quantity(
        ("seam",), "1", "largest step in value before the filter, over the largest elsewhere"
    ),
    "seam_bend_unfiltered": Quantity(
        ("seam",), "1", "largest step in slope before the filter, over the largest elsewhere"
    ),
    "replay_correlation": Quantity((), "1", "correlation of command and motion as recorded"),
    "replay_correlation_aligned": Quantity((), "1", "correlation of command and motion at the lag"),
    "replay_lag": Quantity((), "s", "lag of the motion behind the command"),
    "replay_gain": Quantity((), "1", "gain from command to motion at the lag"),
    "replay_error": Quantity((), "m", "rms of motion less command as recorded"),
    "replay_residual": Quantity((), "m", "rms of motion less command after lag and gain"),
    "coherence_frequency": Quantity(("coherence_frequency",), "Hz", "frequency of the coherence"),
    "replay_coherence": Quantity(("coherence_frequency",), "1", "coherence of command and motion"),
    "replay_coherence_mean": Quantity((), "1", "coherence over the band, weighted by the command's power"),
    # simulated populations
    "unit_session": Quantity(("unit",), "1", "session in which a unit was recorded"),
    "unit_rat": Quantity(("unit",), "1", "rat in which a unit was recorded"),
    "driven_by": Quantity(("unit",), "1", "what drives a simulated unit"),
    "driving_whisker": Quantity(("unit",), "1", "whisker that drives a simulated unit"),
    "true_threshold": Quantity(("unit",), "m", "true threshold of the envelope"),
    "true_slope": Quantity(("unit",), "1/(s m)", "true slope of the rate above the threshold"),
    "true_latency": Quantity(("unit",), "s", "true delay from envelope to rate"),
    "true_baseline": Quantity(("unit",), "Hz", "true rate below the threshold"),
    "surround_gain": Quantity(("unit",), "1", "gain of each surrounding whisker over the principal one's"),
    # does the envelope drive the units, and how: intervals of 95 % by resampled trials
    "envelope_correlation": Quantity(("unit",), "1", "largest correlation of rate and envelope over the lags tried"),
    "envelope_lag": Quantity(("unit",), "s", "lag of the largest correlation, positive where the rate comes later"),
    "p_value": Quantity(("unit",), "1", "share of chance correlations at least as large"),
    "adjusted_p_value": Quantity(("unit",), "1", "p-value adjusted over units, Benjamini and Hochberg"),
    "significant": Quantity(("unit",), "1", "whether the envelope drives the unit"),
    "identified": Quantity(("unit",), "1", "whether the trials tell threshold and slope"),
    "threshold": Quantity(("unit",), "m", "envelope above which the rate rises"),
    "threshold_low": Quantity(("unit",), "m", "threshold, lower end of the 95 % interval"),
    "threshold_high": Quantity(("unit",), "m", "threshold, upper end of the 95 % interval"),
    "slope": Quantity(("unit",), "1/(s m)", "rise of the rate above the threshold"),
    "slope_low": Quantity(("unit",), "1/(s m)", "slope, lower end of the 95 % interval"),
    "slope_high": Quantity(("unit",), "1/(s m)", "slope, upper end of the 95 % interval"),
    "latency": Quantity(("unit",), "s", "delay from envelope to rate"),
    "latency_low": Quantity(("unit",), "s", "latency, lower end of the 95 % interval"),
    "latency_high": Quantity(("unit",), "s", "latency, upper end of the 95 % interval"),
    "baseline": Quantity(("unit",), "Hz", "rate below the threshold"),
    "baseline_low": Quantity(("unit",), "Hz", "baseline, lower end of the 95 % interval"),
    "baseline_high": Quantity(("unit",), "Hz", "baseline, upper end of the 95 % interval"),
    "tuning_r_squared": Quantity(("unit",), "1", "share of the rate's variance over bins that the fit explains"),
    "tuning_r_squared_unseen": Quantity(("unit",), "1", "the same on trials not used for the fit"),
    "noise_ceiling": Quantity(("unit",), "1", "correlation of the rates of odd and even trials"),
    "sub_threshold_rate": Quantity(("unit",), "Hz", "rate in bins whose envelope stays below the threshold"),
    "spontaneous_rate": Quantity(("unit",), "Hz", "rate in the spontaneous window"),
    # what the figures of cortex draw (8, 9)
    "unit_driven": Quantity(("unit",), "1", "whether the envelope drives the unit"),
    "unit_fitted": Quantity(("unit",), "1", "whether the unit is driven and its hinge identified"),
    "fitted_threshold": Quantity(("unit",), "m", "threshold of the envelope, fitted"),
    "fitted_slope": Quantity(("unit",), "1/(s m)", "slope of the rate above the threshold, fitted"),
    "fitted_latency": Quantity(("unit",), "s", "delay from envelope to rate, fitted"),
    "fitted_baseline": Quantity(("unit",), "Hz", "rate below the threshold, fitted"),
    "unit_correlation": Quantity(("unit",), "1", "largest correlation of rate and envelope"),
    "source": Quantity(("source",), "1", "where a number is from"),
    "quality": Quantity(("quality",), "1", "single units SU or multi-units MU"),
    "units_kept": Quantity(("source", "quality"), "1", "units kept"),
    "units_driven": Quantity(("source", "quality"), "1", "units that the envelope drives"),
    "share_driven": Quantity(("source", "quality"), "1", "share of units that the envelope drives"),
    "share_driven_low": Quantity(("source", "quality"), "1", "share driven, lower end of the 95 % Wilson interval"),
    "share_driven_high": Quantity(("source", "quality"), "1", "share driven, upper end of the 95 % Wilson interval"),
    "threshold_mean": Quantity(("source", "quality"), "m", "mean threshold"),
    "threshold_sem": Quantity(("source", "quality"), "m", "standard error of the mean threshold"),
    "slope_mean": Quantity(("source", "quality"), "1/(s m)", "mean slope"),
    "slope_sem": Quantity(("source", "quality"), "1/(s m)", "standard error of the mean slope"),
    "table_text": Quantity(
        ("table_row", "table_column"), "1", "what, SU in the paper, SU here, MU in the paper, MU here"
    ),
    "correlogram_lag": Quantity(("correlogram_lag",), "s", "lag of the rate behind the envelope"),
    "correlogram": Quantity(("correlogram_lag",), "1", "correlation of rate and envelope"),
    "level_envelope": Quantity(("level",), "m", "mean envelope of a class of bins"),
    "level_rate": Quantity(("level",), "Hz", "mean rate in a class of bins"),
    "level_rate_se": Quantity(("level",), "Hz", "standard error of the mean rate in a class of bins"),
    # truth against found; the unit stands in quantity_unit
    "quantity": Quantity(("entry",), "1", "name of the quantity"),
    "quantity_unit": Quantity(("entry",), "1", "unit of the quantity"),
    "truth": Quantity(("entry",), "1", "true value"),
    "found": Quantity(("entry",), "1", "value found"),
    "found_low": Quantity(("entry",), "1", "lower end of the 95 % interval"),
    "found_high": Quantity(("entry",), "1", "upper end of the 95 % interval"),
}


def _dims(name: str, values: np.ndarray, lead: tuple[str, ...]) -> tuple[str, ...]:
    if name not in QUANTITIES:
        raise InputError(name, "must stand in quantities.QUANTITIES")
    core = QUANTITIES[name].dims
    if values.ndim == len(core):
        return core
    if values.ndim == len(core) + len(lead):
        return lead + core
    raise InputError(name, f"must have dimensions {core} or {lead + core}", f"shape {values.shape}")


def dataset(attrs: Mapping[str, Any] | None = None, *, lead: tuple[str, ...] = (), **variables: Any) -> xr.Dataset:
    """Label arrays with the dimensions, units and long names of the one table.

    Parameters
    ----------
    attrs : mapping, optional
        Parameters that made the data: numbers and strings (no clock: equal inputs give equal files).
    lead : tuple of str
        Dimensions that lead the core dimensions where an array has that many more.
    **variables
        Arrays by name; every name stands in ``QUANTITIES``.

    Raises
    ------
    InputError
        If a name is not in the table, or an array has another number of dimensions.
    """
    import xarray as xr

    arrays = {}
    for name, values in variables.items():
        array = np.asarray(values)
        dims = _dims(name, array, lead)
        arrays[name] = (
            dims,
            array,
            {"units": QUANTITIES[name].unit, "long_name": QUANTITIES[name].long_name},
        )
    coordinates = {name: arrays.pop(name) for name in list(arrays) if arrays[name][0] == (name,)}
    return xr.Dataset(arrays, coordinates, {**(attrs or {}), "vibrissa_version": __version__})


def require(data: xr.Dataset, *names: str) -> None:
    """Check that a dataset holds these variables, with their dimensions and units.

    Raises
    ------
    InputError
        Names the first variable that is missing, or has other dimensions or another unit.
    """
    for name in names:
        quantity = QUANTITIES[name]
        if name not in data.variables:
            raise InputError(
                f"variable {name!r}",
                "is missing from the dataset",
                f"only {sorted(map(str, data.variables))}",
            )
        found = data[name]
        if not set(quantity.dims) <= set(found.dims):
            raise InputError(f"variable {name!r}", f"must have dimensions {quantity.dims}", str(found.dims))
        if found.attrs.get("units", quantity.unit) != quantity.unit:
            raise InputError(f"variable {name!r}", f"must be in {quantity.unit!r}", repr(found.attrs["units"]))


def measured(profile: xr.Dataset) -> NDArray[np.bool_]:
    """Whether each node was measured, and not extrapolated or lost, in the shape of ``x``.

    Profiles of other programs tell no standard deviation: what has a position there was measured.
    """
    sd = next((name for name in ("y_sd", "x_sd") if name in profile), "x")
    return np.asarray(np.isfinite(profile[sd].values))


def measured_sd(profile: xr.Dataset) -> xr.DataArray:
    """Standard deviation of a tracked profile in the direction it was measured in: ``y_sd``, or ``x_sd``.

    Whiskers that run along the rows of the image are measured in y, those along its columns in x. NaN where a node
    was not measured.

    Raises
    ------
    InputError
        If the profile has neither.
    """
    name = "x_sd" if "x_sd" in profile and "y_sd" not in profile else "y_sd"
    require(profile, name)
    return profile[name]
