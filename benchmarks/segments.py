"""All lines in every frame: time of a frame on one core, against the finder of seeds and WHISK [Clack2012].

.venv/bin/python benchmarks/segments.py [MOVIE] [TRACE]

Without a movie: 30 frames of 640 × 480 pixels, rendered by the virtual camera, with five whiskers each. TRACE is WHISK's program
``trace`` (PyPI: whisk-janelia 1.2.5), beside which ``default.parameters`` must stand. Times are of the processor; the
movie is decoded beforehand.
"""
