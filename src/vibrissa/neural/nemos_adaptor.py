"""The same Poisson model handed to NeMoS, for who wants its solvers, other likelihoods or coupled populations."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibrissa.errors import InputError
from vibrissa.neural.poisson import TrialDesign

Array = NDArray[np.float64]


def flat_design(design: TrialDesign, counts: Array) -> tuple[Array, Array]:
    """Lay the columns out as one row for each trial and bin, the constant left out: NeMoS adds its own.

    Parameters
    ----------
    design : TrialDesign
        Columns; the first of those shared is the constant.
    counts : (N, K) array
        Counts.

    Returns
    -------
    columns : (N·K, P + Q − 1) array
        Trial after trial.
    counts : (N·K,) array
        In the same order.

    Raises
    ------
    InputError
        If the first column is no constant, or counts and columns differ in shape.
    """
    n, k, q = design.own.shape
    if counts.shape != (n, k):
        raise InputError("counts", f"must be (trials, bins) = {(n, k)}", counts.shape)
    if np.ptp(design.shared[:, 0]) > 0:
        raise InputError("first column", "must be the constant")
    shared = np.tile(design.shared[:, 1:], (n, 1))
    return np.hstack([shared, design.own.reshape(n * k, q)]), counts.ravel()


def nemos_fit(design: TrialDesign, counts: Array, width: float, *, penalty: float = 0.0) -> tuple[Array, Any]:
    """Fit by NeMoS, in double precision.

    Parameters
    ----------
    design, counts, width
        As in :func:`vibrissa.neural.poisson.poisson_regression`.
    penalty : float
        On all squared coefficients but the constant, as there; NeMoS counts it for each row, which is seen to.

    Returns
    -------
    coefficients : (P + Q,) array
        In the order shared, own, with the constant as ln of a rate in Hz.
    model : nemos.glm.GLM
        The model fitted, for whatever else NeMoS does.

    Raises
    ------
    InputError
        If NeMoS is not installed.
    """
    try:
        jax, nemos = (import_module(name) for name in ("jax", "nemos"))
    except ImportError as error:
        remedy = "python -m pip install nemos (about 1 GB with JAX); poisson_regression gives the same fit without it"
        raise InputError("NeMoS", "must be installed for nemos_fit", remedy=remedy) from error
    jax.config.update("jax_enable_x64", True)  # in single precision coefficients are off by 1e-3
    columns, spikes = flat_design(design, counts)
    options: dict[str, Any] = {"solver_name": "LBFGS", "solver_kwargs": {"tol": 1e-12, "maxiter": 5000}}
    if penalty > 0:
        # NeMoS: mean log-likelihood − strength·½Σb²; here: sum − penalty·½Σb²
        options |= {"regularizer": "Ridge", "regularizer_strength": penalty / len(spikes)}
    model = nemos.glm.GLM(observation_model="Poisson", **options).fit(columns, spikes)
    constant = float(np.asarray(model.intercept_)[0]) - np.log(width)
    found = np.concatenate([[constant / design.shared[0, 0]], np.asarray(model.coef_)])
    return found, model
