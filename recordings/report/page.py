"""One HTML page about a recording: findings first, then each run with its pictures."""

from collections.abc import Iterator
from html import escape
from pathlib import Path

from problem.errors import InputError
from recordings.check import Check
from recordings.differentiate import differentiate
from recordings.recording import Recording
from recordings.report.pictures import cutoff_figure, png, signals_figure, stamps_figure
from recordings.run import ROLES, Run

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 1060px; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; width: 100%; } th, td { text-align: left; padding: 4px 10px; vertical-align: top; }
th { border-bottom: 2px solid #888; } td { border-bottom: 1px solid #e4e4e4; }
img { max-width: 100%; display: block; margin: 0.6em 0; }
.refused { color: #b00020; font-weight: 600; } .warning { color: #a85400; font-weight: 600; }
td:nth-child(2) { white-space: nowrap; }
.repaired { color: #00589b; } .note { color: #666; }
"""


def write_page(check: Check, path: Path) -> Path:
    """Writes the page of a check and returns its path; InputError where it cannot be written."""
    body = "".join(_body(check))
    name = escape(check.recording.name)
    head = (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{name}</title><style>{STYLE}</style></head>'
    )
    try:
        path.write_text(f"{head}<body>{body}</body></html>\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    return path


def _body(check: Check) -> Iterator[str]:
    recording = check.recording
    yield f"<h1>Recording {escape(recording.name)}</h1><p>{escape(_summary(recording))}</p>"
    yield "<h2>Findings</h2>"
    yield _findings_table(check)
    for run in recording.runs:
        yield from _run_section(run, recording)


def _summary(recording: Recording) -> str:
    roles = [f"{len(recording.with_role(role))} to {role}" for role in ROLES]
    seconds = sum(run.time[-1] - run.time[0] for run in recording.runs)
    arm = recording.arm
    nominal = "with" if arm.links is not None else "without"
    return (
        f"Robot {arm.name}, {len(arm)} joint(s), {nominal} nominal inertial parameters. "
        f"{len(recording.runs)} run(s), {seconds:.3g} s: {', '.join(roles)}."
    )


def _findings_table(check: Check) -> str:
    rows = [("refused", file, "", reason) for file, reason in check.refused]
    for run, finding in check.findings:
        rows.append((finding.severity, run, str(finding.joint or ""), finding.text))
    if not rows:
        return "<p>Nothing was repaired and nothing looks wrong.</p>"
    order = ("refused", "warning", "repaired", "note")
    rows.sort(key=lambda row: order.index(row[0]))
    cells = "".join(
        f'<tr><td class="{kind}">{kind}</td><td>{escape(run)}</td><td>{joint}</td><td>{escape(text)}</td></tr>'
        for kind, run, joint, text in rows
    )
    return f"<table><tr><th></th><th>run</th><th>joint</th><th>what</th></tr>{cells}</table>"


def _run_section(run: Run, recording: Recording) -> Iterator[str]:
    signals = differentiate(run)
    yield f"<h2>{escape(run.name)} ({run.role})</h2>"
    yield f"<p>{run.samples} samples at {run.rate_hz:.5g} Hz, {run.time[-1] - run.time[0]:.4g} s.</p>"
    yield _picture(png(signals_figure(signals, recording.arm)), f"position and torque of {run.name}")
    if signals.cutoff is not None:
        choice = signals.cutoff
        yield (
            f"<p>Cut-off {choice.cutoff_hz:.3g} Hz: the least estimated error of the acceleration, at most ten times "
            f"the bandwidth of the motion ({choice.motion_hz:.2g} Hz).</p>"
        )
        yield _picture(png(cutoff_figure(choice, recording.arm)), f"choice of the cut-off for {run.name}")
    if not run.even:
        yield _picture(png(stamps_figure(run)), f"time between the samples of {run.name}")


def _picture(address: str, text: str) -> str:
    return f'<img alt="{escape(text)}" src="{address}">'
