"""What is measured of whiskers in movies: angle, whisking cycle, curvature at the base, touches."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity

KINEMATICS: dict[str, Quantity] = {
    "whisker_label": Quantity(("whisker",), "1", "name of the whisker, by its place on the face"),
    "mean_base_x": Quantity(("whisker",), "m", "mean place of the whisker's base, x"),
    "mean_base_y": Quantity(("whisker",), "m", "mean place of the whisker's base, y"),
    "whisker_angle": Quantity(
        ("time",), "rad", "angle of the whisker at its base to the face, 0 caudal, π rostral, π/2 across"
    ),
    "whisker_angle_sd": Quantity(("time",), "rad", "standard deviation of the whisker's angle"),
    "image_angle": Quantity(("time",), "rad", "angle of the whisker at its base to the x axis, towards the y axis"),
    "whisking_phase": Quantity(("time",), "rad", "phase in the whisk cycle: 0 most protracted, ±π most retracted"),
    "whisking_amplitude": Quantity(("time",), "rad", "half of the difference of the angle at phases 0 and ±π"),
    "set_point": Quantity(("time",), "rad", "set point of whisking, mean of the angle at phases 0 and ±π"),
    "whisking_frequency": Quantity(("time",), "Hz", "instantaneous frequency of whisking"),
    "whisker_curvature": Quantity(
        ("time",), "1/m", "curvature of the shaft at its base, positive where it bends to the nose"
    ),
    "whisker_curvature_sd": Quantity(("time",), "1/m", "standard deviation of the whisker's curvature"),
    "base_misfit": Quantity(("time",), "m", "rms distance of the nodes to the arc from which angle and curvature are"),
    "rest_curvature": Quantity(("time",), "1/m", "curvature of the free whisker at the same angle"),
    "rest_held": Quantity(("time",), "1", "whether the angle lies beyond those of the free whisker, whose end is held"),
    "curvature_change": Quantity(("time",), "1/m", "change Δκ of the curvature against the free whisker"),
    "object_distance": Quantity(("time",), "m", "distance of the whisker to the surface of the object"),
    "touching": Quantity(("time",), "1", "whether the whisker touches: 1 or 0"),
    "object_x": Quantity(("whisker",), "m", "place at which the whisker is held in touches, found, x"),
    "object_y": Quantity(("whisker",), "m", "place at which the whisker is held in touches, found, y"),
    "touch_whisker": Quantity(("touch",), "1", "label of the whisker that touches"),
    "touch_whisker_number": Quantity(("touch",), "1", "number of that whisker among the tracks"),
    "touch_onset": Quantity(("touch",), "s", "time of the first frame of a touch"),
    "touch_offset": Quantity(("touch",), "s", "time of the last frame of a touch"),
    "touch_duration": Quantity(("touch",), "s", "duration of a touch, from first to last frame, both counted"),
    "touch_angle": Quantity(("touch",), "rad", "angle of the whisker at the onset"),
    "touch_phase": Quantity(("touch",), "rad", "phase in the whisk cycle at the onset"),
    "touch_curvature_change": Quantity(("touch",), "1/m", "Δκ at its largest magnitude in a touch, with its sign"),
    "touch_onset_seen": Quantity(("touch",), "1", "whether the whisker was seen free in the frame before the onset"),
    "touch_offset_seen": Quantity(("touch",), "1", "whether the whisker was seen free in the frame after the offset"),
    # of each whisker
    "frames_measured": Quantity(("whisker",), "1", "frames in which the angle was measured"),
    "median_angle": Quantity(("whisker",), "rad", "median angle to the face"),
    "median_amplitude": Quantity(("whisker",), "rad", "median amplitude of whisking"),
    "median_set_point": Quantity(("whisker",), "rad", "median set point of whisking"),
    "median_frequency": Quantity(("whisker",), "Hz", "median frequency of whisking"),
    "median_curvature": Quantity(("whisker",), "1/m", "median curvature at the base"),
    "touches": Quantity(("whisker",), "1", "number of touches"),
}
