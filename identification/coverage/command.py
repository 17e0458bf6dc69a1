"""`armlab coverage`: the share of intervals that hold the truth, for noise of several colours."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.stats import norm

from identification.coverage.experiment import Noise, three_joint_experiment
from problem.errors import InputError

KINDS = {
    "as an arm's": Noise(),
    "slow torque noise": Noise(0.2, 0.97, 2e-5),
    "coarse encoder": Noise(0.2, 0.5, 1e-4),
}


def write_coverage(experiments: int, seed: int, results: Path) -> Iterator[str]:
    """Runs the experiments, shared among the kinds of noise, and writes `coverage.json`; tells lines."""
    rows = {}
    for number, (name, noise) in enumerate(KINDS.items()):
        count = experiments // len(KINDS) + (number < experiments % len(KINDS))
        experiment = three_joint_experiment(noise)
        seeds = np.random.SeedSequence((seed, number)).generate_state(count)
        held = np.array([experiment.held(int(each))[0] for each in seeds])
        rows[name] = _row(held)
        yield f"{name}: {100 * rows[name]['coverage']:.1f} % of {held.size} intervals in {count} experiments"
    total = float(
        np.average([row["coverage"] for row in rows.values()], weights=[row["experiments"] for row in rows.values()])
    )
    yield f"all: {100 * total:.1f} % in {experiments} experiments"
    path = results / "coverage.json"
    try:
        results.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({"seed": seed, "coverage": total, "kinds": rows}, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    yield str(path)


def _row(held: np.ndarray) -> dict[str, float]:
    """Coverage over parameters and experiments; its error from the scatter between experiments."""
    each = held.mean(axis=1)
    half = float(norm.ppf(0.975) * each.std(ddof=1) / np.sqrt(len(each)))
    worst, best = float(held.mean(axis=0).min()), float(held.mean(axis=0).max())
    return {
        "experiments": len(held), "coverage": float(each.mean()), "half_width": half,
        "least_parameter": worst, "most_parameter": best,
    }  # fmt: skip
