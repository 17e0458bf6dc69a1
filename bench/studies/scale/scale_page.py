"""`armlab tools scale`: measure, and write `scale.md` and `kills.md`."""

import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from bench.provenance import provenance
from bench.result_sets.formats import make_folder
from bench.studies.scale.kills import KillResult, Victim, kill_repeatedly
from bench.studies.scale.sweeps import ReportProgress, ScaleCost, SweepCost, measure_scale

if TYPE_CHECKING:  # it needs the extra `cluster`
    from bench.studies.scale.cluster import SimulatedCluster

_SCALE_READING = """\
Small trials on purpose: 50 evaluations of a function that costs microseconds, so that everything beside the searches
shows. Memory: resident, of the command itself without its workers. Trials: seconds by the clock, without start and
table, which the same command takes on the finished store. Searches: their processor time in sum. Overhead: what a trial
costs beside its search, of one core: its key, its way to a worker and back, the store."""
_UNKNOWN = ("until all are there, s", "a batch through Dask, ms", "memory, MB", "open files")  # where something broke
_CLUSTER_READING = """\
Simulated: workers of `distributed` in one process with the scheduler and the command, each with its own connections
by TCP and its heartbeat; what a worker does to watch itself (profile, event loop, memory) is off, since all share one
interpreter. Not simulated: processors of their own, a network, Slurm. Batches are 400, of one trial of
50 evaluations each; a real batch has 20,000 evaluations, 400 such trials. *Dispatch*: what the command itself does
for a batch, with twice as many batches under way as there are workers. *Through Dask*: the whole way of a batch, the
trial included, on the one core that all workers share here: an upper bound of what scheduler and messages take.
*Memory*, *open files*: of scheduler and all workers together, both ends of each connection."""
_KILLS_READING = """\
SIGKILL when a random share of the trials is kept, to the command (the driver, which is then started again) or to one
of its two workers (which the command replaces). Lost: trials that were in the store when the kill was over and at the
end were not, or not the same. Exact: the restart ran those trials that were missing and no other; the table has the
bytes of a run that nobody kills; SQLite finds no fault in the store."""


def scale_page(scale: ScaleCost) -> str:
    """The measured sweeps as a Markdown page."""
    return markdown_page(
        "Large sweeps",
        _machine_text(),
        _SCALE_READING,
        _sweep_table([scale.tenth_sweep, scale.whole_sweep]),
        _scale_verdict(scale),
    )


def cluster_page(clusters: "Sequence[SimulatedCluster]") -> str:
    """The simulated clusters as a Markdown page."""
    headings = ["", *(f"{each.workers:,} workers" for each in clusters)]
    rows: dict[str, Callable[[SimulatedCluster], str]] = {
        "until all are there, s": lambda each: f"{each.start_s:.1f}",
        "the trial alone, ms": lambda each: f"{each.search_ms:.2f}",
        "dispatch of a batch, ms": lambda each: f"{each.dispatch_ms:.2f}",
        "a batch through Dask, ms": lambda each: f"{each.dask_ms:.1f}",
        "memory, MB": lambda each: f"{each.memory_mb:.0f}",
        "open files": lambda each: f"{each.files:,}",
        "what broke": lambda each: each.failure or "nothing",
    }
    table = markdown_table(
        headings,
        [
            [name, *("-" if each.failure and name in _UNKNOWN else show(each) for each in clusters)]
            for name, show in rows.items()
        ],
    )
    return markdown_page("A cluster, simulated", _machine_text(), _CLUSTER_READING, table)


def kills_page(kills: Mapping[str, Sequence[KillResult]]) -> str:
    """The kills, by victim, as a Markdown page."""
    return markdown_page("Kills", _machine_text(), _KILLS_READING, _kill_table(kills))


def _machine_text() -> str:
    facts = json.loads(provenance())
    return f"{facts['processor']}, {facts['system']}, Python {facts['python']}."


def _sweep_table(sweeps: Sequence[SweepCost]) -> str:
    headings = ["", *(f"{sweep.trials:,} trials" for sweep in sweeps)]
    rows = {
        "trials, s": lambda sweep: f"{sweep.trial_seconds:.0f}",
        "searches, s": lambda sweep: f"{sweep.search_seconds:.0f}",
        "overhead of a trial, ms": lambda sweep: f"{sweep.overhead_ms:.2f}",
        "start and table, s": lambda sweep: f"{sweep.repeated.seconds:.1f}",
        "memory after a quarter, MB": lambda sweep: f"{sweep.run.after(0.25):.0f}",
        "after a half": lambda sweep: f"{sweep.run.after(0.5):.0f}",
        "after three quarters": lambda sweep: f"{sweep.run.after(0.75):.0f}",
        "peak, table included": lambda sweep: f"{sweep.run.peak:.0f}",
        "report, s": lambda sweep: f"{sweep.report.seconds:.0f}" if sweep.report else "-",
        "peak of the report, MB": lambda sweep: f"{sweep.report.peak:.0f}" if sweep.report else "-",
    }
    return markdown_table(headings, [[name, *map(show, sweeps)] for name, show in rows.items()])


def _scale_verdict(scale: ScaleCost) -> str:
    growth = scale.whole_sweep.run.peak - scale.tenth_sweep.run.peak
    return (
        f"Ten times the trials take {growth:.0f} MB more at the peak. {scale.tenth_sweep.trials:,} trials on "
        "one worker and "
        f"on two, in turns, medians: {scale.alone:.1f} s and {scale.together:.1f} s, an efficiency of "
        f"{scale.efficiency:.0%} while the machine had an average load of {scale.load:.1f} on {os.cpu_count()} cores, "
        "these runs included."
    )


def _kill_table(kills: Mapping[str, Sequence[KillResult]]) -> str:
    headings = ["victim", "kills", "kept at the kill", "lost", "computed by the restart", "exact"]
    rows = [
        [
            victim,
            len(found),
            f"{sum(kill.kept for kill in found):,}",
            sum(kill.lost for kill in found),
            f"{sum(kill.computed for kill in found):,}" if victim == "driver" else "no restart",
            f"{sum(kill.exact for kill in found)} of {len(found)}",
        ]
        for victim, found in kills.items()
    ]
    return markdown_table(headings, rows)


_VICTIMS: tuple[Victim, ...] = ("driver", "worker")


def write_scale(configs: Path, trials: int, results: Path, tell: ReportProgress) -> Path:
    """Measure a sweep of that many trials, and one of a tenth, as `scale.yaml` in `configs` says; write `scale.md`.

    Raises InputError for a number of trials that does not fit the configuration.
    """
    make_folder(results)
    write_whole(results / "scale.md", scale_page(measure_scale(configs / "scale.yaml", trials, tell)))
    return results / "scale.md"


def write_cluster(configs: Path, workers: int, results: Path, tell: ReportProgress) -> Path:
    """Simulate a hundredth, a tenth and the whole of that many Dask workers; write and return `cluster.md`."""
    from bench.studies.scale.cluster import simulate_clusters  # needs the extra `cluster`

    make_folder(results)
    sizes = sorted({max(workers // share, 1) for share in (100, 10, 1)})
    found = simulate_clusters(configs / "scale.yaml", sizes, tell)
    write_whole(results / "cluster.md", cluster_page(found))
    return results / "cluster.md"


def write_kills(configs: Path, count: int, results: Path, tell: ReportProgress) -> tuple[Path, bool]:
    """Kill the command, and its workers, that often while they run `scale_kills.yaml`; write `kills.md`.

    Returns the page, and whether no kill lost a trial.
    """
    make_folder(results)
    kills: dict[str, list[KillResult]] = {
        victim: kill_repeatedly(configs / "scale_kills.yaml", count, victim, tell) for victim in _VICTIMS
    }
    write_whole(results / "kills.md", kills_page(kills))
    return results / "kills.md", all(kill.exact for some in kills.values() for kill in some)
