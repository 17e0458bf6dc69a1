"""From each foreign log to a verdict with the commands that a user types; writes the table of `docs/recordings.md`."""

import shlex
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from click.testing import CliRunner
from foreign_logs import LOGS, ForeignLog

from armlab.cli.import_form import command_of
from armlab.cli.main import main
from armlab.common.markdown import markdown_table
from armlab.diagnosis.formats import FindingEntry, read_verdict_file
from armlab.recordings.imports.plan import plan_import

PAGE = Path(__file__).parents[2] / "docs" / "recordings.md"
BEGIN = "<!-- Written by tests/recordings/foreign_trial.py: do not edit. -->\n"
END = "\n<!-- End of what is written. -->"
HEADINGS = ("log", "proposals taken", "typed", "commands", "hidden", "found", "named beside")
NOT_GIVEN = ("time", "position", "torque", "reference_position", "gains", "joints", "separator", "decimal", "topic")
MAX_ERROR = 0.05  # of a number, relative


@dataclass(frozen=True)
class Outcome:
    """What a trial took, and what came of it. found: a finding for each hidden effect, None for one that is missed."""

    name: str
    log: ForeignLog
    proposals: Sequence[str]
    typed: Sequence[str]
    commands: int
    found: Sequence[FindingEntry | None]
    others: Sequence[FindingEntry]

    @property
    def cells(self) -> tuple[str, ...]:
        """The row of the table."""
        hidden = [_describe(effect, joint, next(iter(each.items()))) for effect, joint, each in self.log.hidden]
        found = [
            "missed" if each is None else _describe(each.effect, each.joint, _telling_number(each, hidden_numbers))
            for each, (_, _, hidden_numbers) in zip(self.found, self.log.hidden, strict=True)
        ]
        others = [f"{each.effect} at {each.joint}" for each in self.others]
        listed = (self.proposals, self.typed, [str(self.commands)], hidden, found, others)
        return (self.name, *("; ".join(each) or "none" for each in listed))

    @property
    def errors(self) -> list[float]:
        """Relative errors of the numbers found; infinite for an effect that is missed."""
        return [
            float("inf") if each is None else abs(_telling_number(each, numbers)[1] / next(iter(numbers.values())) - 1)
            for each, (_, _, numbers) in zip(self.found, self.log.hidden, strict=True)
        ]


def _describe(effect: str, joint: int | None, number: tuple[str, Any]) -> str:
    return f"{effect} at {joint}: {number[0]} {number[1]:.2g}"


def _telling_number(finding: FindingEntry, hidden: dict[str, Any]) -> tuple[str, Any]:
    name = next(iter(hidden))
    return name, finding.parameters[name].value


def run_trial(name: str, folder: Path) -> Outcome:
    """The trial of one log in an empty folder.

    A user gives files and robot, takes the proposals, types what only a user knows, and diagnoses.
    """
    log = LOGS[name](folder)
    options: dict[str, Any] = {**dict.fromkeys(NOT_GIVEN), "units": (), "validate": (), "out": str(folder / "new")}
    plan = plan_import(log.files, {**options, "robot": str(log.robot)})
    proposals, typed = [], []
    while plan.questions:
        question = plan.questions[0]
        answer = log.known.get(question.option) or question.proposal
        if answer is None:
            raise AssertionError(f"{name}: nobody can answer: {question.missing}")
        asked = f"unit of {question.signal}" if question.signal else question.option
        (typed if question.option in log.known else proposals).append(asked)
        plan = plan_import(log.files, question.with_answer(plan.options, answer))
    lines = [
        shlex.split(command_of(log.files, plan.options))[1:],
        ["diagnose", str(folder / "new"), "--out", str(folder / "out")],
    ]
    for words in lines:
        result = CliRunner().invoke(main, words)
        if result.exit_code != 0:
            raise AssertionError(f"{' '.join(words)}: {result.output}{result.exception or ''}")
    findings = read_verdict_file(folder / "out" / "verdict.json").findings
    places = [(effect, joint) for effect, joint, _ in log.hidden]
    found = [next((each for each in findings if (each.effect, each.joint) == place), None) for place in places]
    others = [each for each in findings if (each.effect, each.joint) not in places]
    return Outcome(name, log, proposals, typed, len(lines), found, others)


def shown_rows() -> list[list[str]]:
    """Cells of the table on the page, without the headings."""
    table = PAGE.read_text().split(BEGIN)[1].split(END)[0]
    return [line.strip("| ").split(" | ") for line in table.strip().splitlines()[2:]]


if __name__ == "__main__":
    outcomes = []
    for each in LOGS:
        with tempfile.TemporaryDirectory() as folder:
            outcomes.append(run_trial(each, Path(folder)))
    before, rest = PAGE.read_text().split(BEGIN)
    table = markdown_table(HEADINGS, [outcome.cells for outcome in outcomes])
    PAGE.write_text(f"{before}{BEGIN}\n{table}\n{END}{rest.split(END)[1]}")
