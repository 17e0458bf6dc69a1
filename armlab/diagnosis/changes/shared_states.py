"""How far the rows of recordings are in states that all recordings were in: elsewhere a model may lack other things."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax

from armlab.common.arrays import Array


def shared_weights(states: Array, members: NDArray[np.intp], independent: int) -> Array:
    """The weight of each row, (rows,): 1 where all recordings were alike often, 0 where only its own one was.

    states: (rows, features). members: (rows,), recordings from 0. independent: how many rows tell something new. A
    logistic regression on the states gives the probability p_k that a row is of recording k. The weights are overlap
    weights (Li, Morgan and Zaslavsky 2018; Li and Li 2019), at most 1:

        w_k = R / (p_k sum over recordings of 1 / p)
    """
    count = int(members.max()) + 1
    own = np.eye(count)[members]
    share = independent / count / own.sum(axis=0)[members]
    spread = np.maximum(np.std(states, axis=0), 1e-12)
    features = np.column_stack([np.ones(len(states)), (states - np.mean(states, axis=0)) / spread])

    def loss(flat: Array) -> tuple[float, Array]:
        slopes = flat.reshape(features.shape[1], count)
        logs = log_softmax(features @ slopes, axis=1)
        slope = slopes - features.T @ (share[:, None] * (own - np.exp(logs)))
        return float(0.5 * np.sum(slopes**2) - share @ np.sum(own * logs, axis=1)), slope.ravel()

    found = minimize(loss, np.zeros(features.shape[1] * count), jac=True, method="L-BFGS-B")
    logs = log_softmax(features @ found.x.reshape(features.shape[1], count), axis=1)
    others = np.sum(np.exp(np.sum(own * logs, axis=1)[:, None] - logs), axis=1)
    return np.asarray(np.minimum(count / others, 1.0))
