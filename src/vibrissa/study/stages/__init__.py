"""What a study does, as data.

`STAGES` in `stages` is the one table of the work: name, inputs, outputs, function, cost, figures. The run, the plan,
the provenance, the report and the gallery read it; a new stage or figure is one entry there and one file.
"""
