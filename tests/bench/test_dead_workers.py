"""Workers of loky that end at a bad moment: in the middle of a report, when all is done, just after a submission."""

import subprocess
import sys

HALF_A_REPORT = """\
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

KILLED_AT_THE_END = """\
import os, signal
from contextlib import suppress
from bench.executors.local import local_executor

if __name__ == "__main__":
    for _ in range(5):  # the moment is short: nearly every one hits it
        with local_executor(2, None) as executor:
            for future in [executor.submit([]) for _ in range(4)]:
                future.result(timeout=60)
            idle = next(iter(executor.pool._processes))
            with suppress(ProcessLookupError):
                os.kill(idle, signal.SIGKILL)
    print("ended")
"""

STOPPED_AFTER_SUBMITTING = """\
from bench.executors.local import local_executor

if __name__ == "__main__":
    for _ in range(5):  # the moment is short: nearly every one hits it
        with local_executor(2, None) as executor:
            executor.submit([]).result(timeout=60)
            for _ in range(3):
                executor.submit([])
    print("ended")
"""


def test_half_a_report_of_a_dead_worker_does_not_stop_the_driver() -> None:
    command = [sys.executable, "-c", HALF_A_REPORT]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.split() == ["crashed", "crashed", "0"], done.stderr


def test_a_worker_that_dies_when_the_work_is_done_does_not_stop_the_driver() -> None:
    command = [sys.executable, "-c", KILLED_AT_THE_END]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.split() == ["ended"], done.stderr


def test_a_driver_that_stops_just_after_it_submitted_work_prints_nothing() -> None:
    command = [sys.executable, "-c", STOPPED_AFTER_SUBMITTING]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.stdout.split() == ["ended"], done.stderr
    assert not done.stderr
