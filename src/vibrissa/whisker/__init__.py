"""The whisker: a cone, its fit from measured diameters, and the measured rat whiskers.

Internal: the public names are those of ``vibrissa`` itself.
"""

from vibrissa.whisker.cone import DAMPING as DAMPING
from vibrissa.whisker.cone import DENSITY as DENSITY
from vibrissa.whisker.cone import YOUNGS_MODULUS as YOUNGS_MODULUS
from vibrissa.whisker.cone import Whisker as Whisker
from vibrissa.whisker.curvature import IntrinsicCurvature as IntrinsicCurvature
from vibrissa.whisker.curvature import atlas_curvature as atlas_curvature
from vibrissa.whisker.curvature import curvature_of as curvature_of
from vibrissa.whisker.curvature import curvature_of_shape as curvature_of_shape
from vibrissa.whisker.curvature import read_curvature as read_curvature
from vibrissa.whisker.diameters import WhiskerFit as WhiskerFit
from vibrissa.whisker.diameters import diameters_of as diameters_of
from vibrissa.whisker.diameters import from_diameters as from_diameters
from vibrissa.whisker.diameters import read_diameters as read_diameters
from vibrissa.whisker.measured import AtlasEntry as AtlasEntry
from vibrissa.whisker.measured import IsolatedWhisker as IsolatedWhisker
from vibrissa.whisker.measured import atlas as atlas
from vibrissa.whisker.measured import atlas_whisker as atlas_whisker
from vibrissa.whisker.measured import isolated_whiskers as isolated_whiskers
