"""A worker of loky that dies while it writes a report."""

import subprocess
import sys

SWEEP = """\
import os, signal, struct, threading, time
from bench.executors.local import local_engine

def half_a_report(engine):
    while engine.present is None or not engine.present._processes:
        time.sleep(0.05)
    pool = engine.present
    time.sleep(1.0)  # until the workers stand and the pool waits for reports
    os.write(pool._result_queue._writer.fileno(), struct.pack("!i", 10_000) + b"x")
    os.kill(next(iter(pool._processes)), signal.SIGKILL)

if __name__ == "__main__":
    with local_engine(2, None) as engine:
        futures = [engine.pool().submit(time.sleep, 3.0) for _ in range(2)]
        threading.Thread(target=half_a_report, args=(engine,), daemon=True).start()
        for future in futures:
            try:
                future.result(timeout=60)
            except engine.crashes as error:
                print("crashed")
        print(engine.pool().submit(abs, -3).result(timeout=60))
"""


def test_half_a_report_of_a_dead_worker_does_not_stop_the_driver() -> None:
    done = subprocess.run([sys.executable, "-c", SWEEP], capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.split() == ["crashed", "crashed", "3"], done.stderr
