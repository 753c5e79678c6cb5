"""What the pieces of a study cost: processor time, memory and disk.

Times are those of one machine: seconds of processor time (``time.process_time`` around the stages of runs, compiled
code at hand, one core of 2.6 GHz) of the built-in experiment's film in images of 440 × 140 and of 880 × 280 pixels; of
four virtual sweeps of 3,500 frames over gratings of 0.35 m; of ``examples/robot.csv``; of surfaces of 0.35 and 1 m; of
13 and 26 simulated units with 40 trials, 26 with 100. Sixty virtual sweeps of 3,500 frames took 8 min 34 s, which
the plan meets within 3 %. Memory is the largest resident set of the same processes, sizes are those of their files.
"""

from __future__ import annotations

# What things cost, in seconds of processor time.
START = 2.0  # to load the program
TRACK_FRAME, TRACK_PIXEL = 0.35e-3, 16e-9  # decode and follow, per frame and per pixel of it
FILM_FRAME, FILM_PIXEL = 0.85e-3, 23e-9  # render and encode
FIT_FRAME = 0.5e-3  # decompose a profile and fit its modes
SWEEP_FRAME = 7.8 / 3500  # a virtual sweep: filmed, tracked, fitted by both forcings, posture and its errors
ROD_SECOND = 1.2  # one second of the rod, its free end on the ground
COMPARE = 0.5  # one sweep against its prediction and those of 39 new gratings
JITTER = 2.8  # one sweep whose prediction is disturbed
REPEAT_FRAME = 1.3e-3  # one more run of a sweep: filmed and tracked
SHOWN = 7.0  # the sweep that the figures show
MODEL = 3.0  # the figures of the model
BASE = 0.4  # one base signal
UNIT, UNIT_TRIAL = 0.125, 0.9e-3  # a simulated unit recorded and analysed, and each of its trials
SESSION = 5.0  # the motion that a simulated population is given
RECORDING = 5.0  # a recording of some twenty units
SCAN_SAMPLE = 2.2e-6  # one sample of a surface's scan
FIGURE = 0.9  # one figure of the report

# Sizes in bytes, of the same runs.
LOADED = 360e6  # a process with the program in it, at work
HELD_FRAME = 20e3  # a process holds per frame
MOVIE_PIXEL = 0.5  # of a lossless movie, with noise of 3 grey levels
PROFILE_FRAME = 8e3  # profile and modes of one whisker
SERIES_FRAME = 165.0  # the time series kept of a sweep
COMPARED = 20e3  # a comparison
SAMPLE = 281.0  # one sample of a surface's scan
REPORT_FIGURE = 0.2e6
UNITS, UNIT_SIZE = 0.15e6, 12e3  # a population, and each of its units

TRACKS = 3500  # frames that a track file is taken to have: only a movie holds its number


def tracking_time(frames: int, pixels: int) -> float:
    """Processor time of tracking one whisker [s]; 0 where the movie cannot be read.

    Parameters
    ----------
    frames, pixels : int
        Of the movie, and of one frame.
    """
    return frames * (TRACK_FRAME + TRACK_PIXEL * pixels) if pixels else 0.0
