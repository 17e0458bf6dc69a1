"""Run an experiment on a Slurm cluster: `python sweep.py sweep.yaml`, in a job of its own or on the login node.

Dask starts its scheduler in this process and sends one job for each `jobs` below; their workers report to it as they
begin. Needs `pip install 'armlab[cluster]' dask-jobqueue`.
"""

import subprocess
import sys

from dask_jobqueue import SLURMCluster

JOBS, CORES = 32, 32  # 1,024 workers of one thread each

if __name__ == "__main__":
    with SLURMCluster(
        queue="compute",  # the partition of your cluster
        account="my-account",
        cores=CORES,
        processes=CORES,  # processor time is counted by process, so each worker has one thread
        memory="64GB",
        walltime="04:00:00",
    ) as cluster:
        cluster.scale(jobs=JOBS)
        cluster.get_client().wait_for_workers(1)  # the others join as their jobs begin
        command = [sys.executable, "-m", "armlab.cli.main", "run", *sys.argv[1:]]
        address = ["--executor", "dask", "--address", cluster.scheduler_address]
        sys.exit(subprocess.run([*command, *address], check=False).returncode)
