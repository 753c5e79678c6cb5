"""Plans of a study: its parts, the work and cost of a run, and the parts that failed."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity

PLANS: dict[str, Quantity] = {
    "part": Quantity(("part",), "1", "key of a part of a study file"),
    "part_given": Quantity(("part",), "1", "whether the study has the part"),
    "part_gives": Quantity(("part",), "1", "what the part adds to the results"),
    "input_file": Quantity(("input_file",), "1", "file that a study reads, relative to the study file"),
    "input_size": Quantity(("input_file",), "byte", "size of a file that a study reads"),
    "input_problem": Quantity(("input_file",), "1", "what is wrong with the file; nothing where it is there"),
    "work": Quantity(("work",), "1", "stage of a run"),
    "work_tasks": Quantity(("work",), "1", "tasks of a stage"),
    "work_frames": Quantity(("work",), "1", "frames of movies that pass through a stage"),
    "processor_time": Quantity(("work",), "s", "processor time of a stage, estimated"),
    "memory_needed": Quantity(("work",), "byte", "memory of one process in a stage, estimated"),
    "bytes_written": Quantity(("work",), "byte", "what a stage leaves on disk, estimated"),
    "planned_figure": Quantity(("planned_figure",), "1", "figure of the report"),
    "left_out": Quantity(("planned_figure",), "1", "why a figure is left out; nothing where it is made"),
    "wall_time": Quantity((), "s", "time that a run takes by the clock, estimated"),
    "peak_memory": Quantity((), "byte", "memory of all processes of a run at once, estimated"),
    "disk_space": Quantity((), "byte", "what a run leaves on disk, estimated"),
    "n_workers": Quantity((), "1", "processes that share the work"),
    "sweeps_kept": Quantity((), "1", "sweeps that are there already"),
    "failed": Quantity(("failed",), "1", "part of a study that could not be analysed"),
    "failed_reason": Quantity(("failed",), "1", "why it could not be analysed"),
}
