"""Series summed in compiled loops are NumPy's, number for number."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from vibrissa.mechanics.statics.chebyshev import chebyshev_sum

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("count", [2, 3, 40])
@pytest.mark.parametrize("shape", [(), (1,), (7, 5), (1300,)])
def test_one_series_at_many_places(count, shape):
    z, c = RNG.uniform(-1, 1, shape), RNG.normal(size=count)
    np.testing.assert_array_equal(chebyshev_sum(z, c), chebyshev.chebval(z, c))


@pytest.mark.parametrize("count", [2, 3, 40])
@pytest.mark.parametrize("places", [0, 1, 511, 1300])
def test_a_series_for_each_place(count, places):
    z, c = RNG.uniform(-1, 1, places), RNG.normal(size=(places, count)).T
    np.testing.assert_array_equal(chebyshev_sum(z, c), chebyshev.chebval(z, c, tensor=False))
