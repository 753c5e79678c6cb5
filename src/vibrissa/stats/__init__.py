"""Statistics of many tests and few animals: estimates whose intervals take whole clusters for the draws.

Internal: the public names are those of ``vibrissa`` itself.
"""

from vibrissa.stats.intervals import RANGES as RANGES
from vibrissa.stats.intervals import Scale as Scale
from vibrissa.stats.intervals import adjusted_p_values as adjusted_p_values
from vibrissa.stats.intervals import jackknife_half_width as jackknife_half_width
from vibrissa.stats.intervals import jackknife_interval as jackknife_interval
from vibrissa.stats.intervals import share_interval as share_interval
from vibrissa.stats.intervals import wilson_interval as wilson_interval
from vibrissa.stats.linear import Effect as Effect
from vibrissa.stats.linear import clustered_model as clustered_model
from vibrissa.stats.linear import linear_model as linear_model
from vibrissa.stats.significance import LEVEL as LEVEL
from vibrissa.stats.significance import fewest_draws as fewest_draws
from vibrissa.stats.significance import hotelling_p_value as hotelling_p_value
from vibrissa.stats.significance import least_p as least_p
from vibrissa.stats.significance import reaches as reaches
from vibrissa.stats.significance import significant as significant
