"""Performance profiles (Dolan and Moré 2002, doi 10.1007/s101070100263)."""

import numpy as np
import pandas as pd

from algorithms.contract import Array


def performance_ratios(costs: pd.DataFrame) -> pd.DataFrame:
    """Costs, positive, a row a problem and a column an algorithm, over the least of the row.

    An infinite cost is a failure; where all fail, all ratios are infinite.
    """
    least = costs.min(axis=1)
    ratios = costs.div(least.where(np.isfinite(least), 1.0), axis=0)
    return ratios.astype(float)


def performance_profile(costs: pd.DataFrame, factors: Array) -> pd.DataFrame:
    """For each algorithm (column) the share of problems that it solves within each factor of the least cost (row)."""
    ratios = performance_ratios(costs)
    shares = {name: (ratios[name].to_numpy()[None, :] <= factors[:, None]).mean(axis=1) for name in ratios}
    return pd.DataFrame(shares, index=pd.Index(factors, name="factor"))
