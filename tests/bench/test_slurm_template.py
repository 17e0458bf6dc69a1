"""The sweep on a Slurm cluster, as the template sends it, with local processes in place of the jobs; and simulated
workers.
"""

import os
import subprocess
import sys
from pathlib import Path

from bench.run import load_experiment
from bench.store import open_store
from bench.studies.scale.cluster import simulate_clusters
from bench.studies.scale.scale_page import cluster_page

ROOT = Path(__file__).parents[2]
CONFIG = """\
name: sweep
problem: [{preset: sphere, dimension: 3}]
algorithms: [spso, random-search]
swarm_size: 10
iterations: 4
repetitions: 3
seed: 1
"""
LOCAL_JOBS = """\
from distributed import LocalCluster


class SLURMCluster(LocalCluster):
    \"\"\"Jobs of `processes` workers each, on this machine.\"\"\"

    def __init__(self, *, queue, account, cores, processes, memory, walltime):
        assert cores == processes  # workers of one thread
        self.a_job = 2
        super().__init__(n_workers=0, threads_per_worker=cores // processes, dashboard_address=None)

    def scale(self, jobs):
        super().scale(self.a_job * min(jobs, 1))
"""


def test_the_template_runs_a_sweep_on_the_workers_of_its_jobs(tmp_path: Path) -> None:
    (tmp_path / "dask_jobqueue.py").write_text(LOCAL_JOBS)
    (tmp_path / "sweep.yaml").write_text(CONFIG)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    words = [sys.executable, str(ROOT / "templates" / "slurm" / "sweep.py"), "sweep.yaml", "--store", "runs.sqlite"]
    done = subprocess.run(
        words, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    with open_store(tmp_path / "runs.sqlite") as store:
        assert all(store.has(entry.key) for entry in load_experiment(tmp_path / "sweep.yaml").entries)
    assert (tmp_path / "results" / "sweep.csv").exists()


def test_simulated_workers_cost_something_and_break_nothing() -> None:
    told: list[str] = []
    (found,) = simulate_clusters(ROOT / "configs" / "scale.yaml", [2], told.append)
    assert found.failure == ""
    assert found.dask_ms > found.dispatch_ms > 0
    assert found.files > 0
    assert len(told) == 1
    page = cluster_page([found])
    assert "| what broke | nothing |" in page
    assert "2 workers" in page
