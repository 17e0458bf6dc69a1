"""A worker of loky that dies while it writes a report."""

import subprocess
import sys

SWEEP = """\
import os, signal, struct, threading, time
from bench.executors.local import local_executor

def half_a_report(executor):
    while not executor.pool._processes:
        time.sleep(0.05)
    pool = executor.pool
    time.sleep(1.0)  # until the workers stand and the pool waits for reports
    os.write(pool._result_queue._writer.fileno(), struct.pack("!i", 10_000) + b"x")
    os.kill(next(iter(pool._processes)), signal.SIGKILL)

if __name__ == "__main__":
    with local_executor(2, None) as executor:
        futures = [executor.pool.submit(time.sleep, 3.0) for _ in range(2)]
        threading.Thread(target=half_a_report, args=(executor,), daemon=True).start()
        for future in futures:
            try:
                future.result(timeout=60)
            except executor.crashes as error:
                print("crashed")
        print(len(executor.submit([]).result(timeout=60).results))
"""


def test_half_a_report_of_a_dead_worker_does_not_stop_the_driver() -> None:
    done = subprocess.run([sys.executable, "-c", SWEEP], capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.split() == ["crashed", "crashed", "0"], done.stderr
