"""Searches of code that has a defect, on as many processes as asked; nothing of them is ever kept."""

from collections.abc import Sequence

from joblib import Parallel, delayed, parallel_config

from bench.execute import run_trial
from bench.outcome import Outcome
from bench.plan import Entry
from bench.regression.defects import DEFECTS
from bench.regression.sweep import Ends, Progress, ends_of
from bench.trial import Trial


def defective_ends(name: str, entries: Sequence[Entry], workers: int, progress: Progress) -> Ends:
    """Ends of those of the trials that the defect concerns, by cell."""
    concerned = [entry for entry in entries if entry.trial.algorithm in DEFECTS[name].algorithms]
    shares = [concerned[worker::workers] for worker in range(workers)]
    with parallel_config(backend="loky", inner_max_num_threads=1):
        results = Parallel(n_jobs=workers)(
            delayed(defective_outcomes)(name, [entry.trial for entry in share]) for share in shares
        )
    progress(len(concerned))
    outcomes = {
        entry.key: outcome
        for share, done in zip(shares, results, strict=True)
        for entry, outcome in zip(share, done, strict=True)
    }
    return ends_of((entry, outcomes[entry.key]) for entry in concerned)


def defective_outcomes(name: str, trials: Sequence[Trial]) -> list[Outcome]:
    """Run trials, one after the other, under a defect."""
    with DEFECTS[name].inject():
        return [run_trial(trial) for trial in trials]
