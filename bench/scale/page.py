"""`scale.md` and `kills.md`: what was measured, in words and tables."""

import json
import os
from collections.abc import Mapping, Sequence

from bench.page import markdown_table, page
from bench.provenance import provenance
from bench.scale.kills import Kill
from bench.scale.sweep import Scale, Sweep

_READING = """\
Small trials on purpose: 50 evaluations of a function that costs microseconds, so that everything beside the searches
shows. Memory: resident, of the command itself without its workers. Trials: seconds by the clock, without start and
table, which the same command takes on the finished store. Searches: their processor time in sum. Overhead: what a trial
costs beside its search, of one core: its key, its way to a worker and back, the store."""
_KILLS = """\
SIGKILL when a random share of the trials is kept, to the command (the driver, which is then started again) or to one
of its two workers (which the command replaces). Lost: trials that were in the store when the kill was over and at the
end were not, or not the same. Exact: the restart ran those trials that were missing and no other; the table has the
bytes of a run that nobody kills; SQLite finds no fault in the store."""


def scale_page(scale: Scale) -> str:
    """Markdown text about sweeps."""
    return page("Large sweeps", _machine(), _READING, _sweeps([scale.tenth, scale.whole]), _verdict(scale))


def kills_page(kills: Mapping[str, Sequence[Kill]]) -> str:
    """Markdown text about kills, by victim."""
    return page("Kills", _machine(), _KILLS, _kill_table(kills))


def _machine() -> str:
    facts = json.loads(provenance())
    return f"{facts['processor']}, {facts['system']}, Python {facts['python']}."


def _sweeps(sweeps: Sequence[Sweep]) -> str:
    headings = ["", *(f"{sweep.trials:,} trials" for sweep in sweeps)]
    rows = {
        "trials, s": lambda sweep: f"{sweep.working:.0f}",
        "searches, s": lambda sweep: f"{sweep.search_seconds:.0f}",
        "overhead of a trial, ms": lambda sweep: f"{sweep.overhead_ms:.2f}",
        "start and table, s": lambda sweep: f"{sweep.again.seconds:.1f}",
        "memory after a quarter, MB": lambda sweep: f"{sweep.run.after(0.25):.0f}",
        "after a half": lambda sweep: f"{sweep.run.after(0.5):.0f}",
        "after three quarters": lambda sweep: f"{sweep.run.after(0.75):.0f}",
        "peak, table included": lambda sweep: f"{sweep.run.peak:.0f}",
        "report, s": lambda sweep: f"{sweep.report.seconds:.0f}" if sweep.report else "-",
        "peak of the report, MB": lambda sweep: f"{sweep.report.peak:.0f}" if sweep.report else "-",
    }
    return markdown_table(headings, [[name, *map(show, sweeps)] for name, show in rows.items()])


def _verdict(scale: Scale) -> str:
    growth = scale.whole.run.peak - scale.tenth.run.peak
    return (
        f"Ten times the trials take {growth:.0f} MB more at the peak. {scale.tenth.trials:,} trials on one worker and "
        f"on two, in turns, medians: {scale.alone:.1f} s and {scale.together:.1f} s, an efficiency of "
        f"{scale.efficiency:.0%} while the machine had an average load of {scale.load:.1f} on {os.cpu_count()} cores, "
        "these runs included."
    )


def _kill_table(kills: Mapping[str, Sequence[Kill]]) -> str:
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
