"""The public names, by the steps of the two chains; everything else is internal."""

__version__: str

# the whisker, and how it is held
from .api.geometry import atlas, curvature, fit_cone

# backward: movie, tracks, resonances
from .api.inverse import decompose, fit_posture, fit_resonances
from .api.kinematics import kinematics

# forward: modes, profile, vibration
from .api.mechanics import gap, modes, profile
from .api.motion import Motion, scan
from .api.movies import read_tracks, track

# to other libraries
from .api.objects.back import to_pynapple
from .api.objects.dataframes import to_dataframe
from .api.objects.tracks import to_movement

# to be looked at
from .api.plots import figure, plot_tracks, plot_unit

# spikes
from .api.quality import unit_quality

# whole studies
from .api.samples import sample_data
from .api.spikes import envelope_coupling, read_spikes, simulate_units
from .api.stimulus import envelope, replay
from .api.studies import Results, load, open_results, run, save

# the surface
from .api.surfaces import read_surface

# what can go wrong
from .errors import ConvergenceError, InputError
from .mechanics.rod.rod_settings import Rod
from .mechanics.statics.profile import Posture
from .mechanics.whisking.base_path import BasePath
from .mechanics.whisking.posture_path import PosturePath
from .texture.generators import self_affine
from .texture.relief import HeightProfile
from .texture.surface import Gaps, periodic_grating, random_grating
from .whisker.cone import Whisker

__all__ = [
    "BasePath",
    "ConvergenceError",
    "Gaps",
    "HeightProfile",
    "InputError",
    "Motion",
    "Posture",
    "PosturePath",
    "Results",
    "Rod",
    "Whisker",
    "atlas",
    "curvature",
    "decompose",
    "envelope",
    "envelope_coupling",
    "figure",
    "fit_cone",
    "fit_posture",
    "fit_resonances",
    "gap",
    "kinematics",
    "load",
    "modes",
    "open_results",
    "periodic_grating",
    "plot_tracks",
    "plot_unit",
    "profile",
    "random_grating",
    "read_spikes",
    "read_surface",
    "read_tracks",
    "replay",
    "run",
    "sample_data",
    "save",
    "scan",
    "self_affine",
    "simulate_units",
    "to_dataframe",
    "to_movement",
    "to_pynapple",
    "track",
    "unit_quality",
]
