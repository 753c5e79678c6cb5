"""Movies and rulers: coordinates, centrelines, pictures, the whisker's geometry."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from vibrissa.quantities.quantity import Quantity

if TYPE_CHECKING:
    import xarray as xr

TRACKS: dict[str, Quantity] = {
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
    # of a head that moves
    "head_column": Quantity(("time",), "1", "column of the head, NaN where it is not known [pixel]"),
    "head_row": Quantity(("time",), "1", "row of the head, NaN where it is not known [pixel]"),
    "head_angle": Quantity(("time",), "deg", "direction of the head, 0 to the right, 90 down"),
    "point_displacement": Quantity(("time",), "m", "transverse displacement of one point of the shaft"),
    "displacement": Quantity(("time", "node"), "m", "transverse displacement about the mean profile"),
    "tracked_motion": Quantity(("time",), "m", "motion of one node across the image, about its mean"),
    "frames": Quantity(("whisker",), "1", "frames in the movie"),
    "frames_followed": Quantity(("whisker",), "1", "frames in which the whisker was followed"),
    "median_length": Quantity(("whisker",), "m", "arc length followed, median over frames"),
    # the truth of a filmed whisking scene
    "node_visible": Quantity(("time", "node"), "1", "whether the camera shows this part of the shaft"),
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
    # pictures
    "image_row": Quantity(("image_row",), "1", "row of the image, down"),
    "image_column": Quantity(("image_column",), "1", "column of the image"),
    "image": Quantity(("image_row", "image_column"), "1", "grey level"),
    # geometry and stationary profile, drawn (1)
    "cone": Quantity(("cone",), "1", "name of a whisker whose diameters are shown"),
    "cone_distance": Quantity(("cone", "cone_point"), "m", "distance from the base along the shaft"),
    "cone_diameter": Quantity(("cone", "cone_point"), "m", "diameter of the shaft"),
    "cone_length": Quantity(("cone",), "m", "length L at which the straight line through the diameters vanishes"),
    "cone_base": Quantity(("cone",), "m", "diameter at the base, of the straight line"),
    "course_x": Quantity(("course_node",), "m", "mean place of a node, x"),
    "course_y": Quantity(("course_node",), "m", "mean place of a node, y"),
    "course_along": Quantity(("course_node",), "m", "mean place of a node, along the substrate from the contact found"),
    "course_height": Quantity(("course_node",), "m", "mean place of a node, above the substrate"),
    "course_s": Quantity(("course_node",), "1", "arc length of a node over L, from the tip of the cone"),
    "course_angle": Quantity(("course_node",), "rad", "angle of the mean profile to the substrate, by chords"),
    "course_residual": Quantity(("course_node",), "m", "distance of a node across the curve of Eq. 1"),
    "parabola_x": Quantity(("parabola_point",), "m", "second-degree polynomial through the visible end, x"),
    "parabola_y": Quantity(("parabola_point",), "m", "second-degree polynomial through the visible end, y"),
    "parabola_s": Quantity(("parabola_point",), "1", "arc length on the polynomial over L"),
    "parabola_angle": Quantity(("parabola_point",), "rad", "angle of the polynomial to the substrate"),
    "other": Quantity(("other",), "1", "name of a whisker of the sweeps"),
    "other_course_x": Quantity(("other", "other_node"), "m", "mean place of its nodes, along the substrate"),
    "other_course_y": Quantity(("other", "other_node"), "m", "mean place of its nodes, above the substrate"),
    "other_fitted_x": Quantity(("other", "other_s"), "m", "its profile by Eq. 1, along the substrate"),
    "other_fitted_y": Quantity(("other", "other_s"), "m", "its profile by Eq. 1, above the substrate"),
    "other_contact": Quantity(("other",), "1", "its contact ε, over L"),
    "other_r2": Quantity(("other",), "1", "share of the variance of its angle that Eq. 1 explains"),
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
    "air_modulus": Quantity(
        ("position",), "Pa", "Young's modulus that brings the predicted resonances on the measured"
    ),
    "distance": Quantity(("point",), "m", "distance from the base along the shaft"),
    "diameter": Quantity(("point",), "m", "diameter of the shaft"),
}


def stored_names(profile: xr.Dataset) -> list[str]:
    """Names of the whiskers of a profile, or of some of them, which have theirs by number.

    Parameters
    ----------
    profile : Dataset
        Nodes by ``whisker``; its attribute ``names`` (JSON) is read.

    Returns
    -------
    list of str
        One for each whisker; none where no names are kept, or it is not known whose they are. Where whiskers are not
        numbered from 0, names are in order.
    """
    stored: list[str] = json.loads(profile.attrs.get("names", "[]"))
    numbers = profile["whisker"].values.tolist()
    if "whisker" not in profile.coords and len(stored) != len(numbers):
        return []
    if all(number in range(len(stored)) for number in numbers):
        return [stored[number] for number in numbers]
    return stored if len(stored) == len(numbers) else []
