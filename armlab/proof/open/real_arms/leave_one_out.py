"""`armlab proof real --leave-one-out`: are the settings of the diagnosis made for these arms?

For each arm, settings are chosen on the other arms, by the error on a part of their identification runs that is held
out; the arm left out judges them on its runs that validate. An outcome is stored as soon as it is there, so that an
interrupted command continues.
"""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import pandas as pd
from pydantic import TypeAdapter, ValidationError

from armlab.common.errors import InputError
from armlab.common.files import write_texts, write_whole
from armlab.common.markdown import markdown_page, markdown_table
from armlab.diagnosis.settings import Settings, vary
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.predict.found_model import model_found
from armlab.diagnosis.tuning import find_number
from armlab.proof.open.real_arms.all_arms import chosen_recipes
from armlab.proof.open.real_arms.judged_run import Percent, common_cutoff, judged_run
from armlab.proof.open.real_arms.one_arm import Progress, progress_under
from armlab.proof.open.real_identification.looks import LOOKS_FILE, Looks
from armlab.proof.open.stored import code_digest, recording_digest
from armlab.recordings.public import open_public_recording
from armlab.recordings.recording import Recording, Role, Run

ARMS = ("emps", "staubli-tx40", "unisa-ur10", "unisa-panda", "kuka-kr300")
TRIED_VALUES: Mapping[str, tuple[float, ...]] = {  # beside the usual value of each number
    "noise.max_prediction_loss": (0.0, 0.1),
    "search.rounds": (1, 3),
    "solver.crowd_penalty": (2.0, 8.0),
    "pruning.level": (0.001, 0.05),
}
FITTED_SHARE = 2 / 3  # of each identification run; what follows is held out for the choice
OUTCOMES_FOLDER = ".leave-one-out"
PAGE_NAME, TABLE_NAME = "leave_one_out.md", "leave_one_out.csv"
Change = tuple[tuple[str, float], ...]  # tuning numbers with their values; empty for the usual settings
USUAL: Change = ()


@dataclass(frozen=True)
class ChosenOutcome:
    """Errors of the model of one diagnosis on the runs that took no part; None where it fitted nothing."""

    errors: dict[str, Percent] | None

    @property
    def log_error(self) -> float:
        """Mean logarithm of the percentages of filtered torque; infinite where there is no model."""
        if not self.errors:
            return math.inf
        return sum(math.log(max(each.filtered, 1e-9)) for each in self.errors.values()) / len(self.errors)


OUTCOME_ADAPTER = TypeAdapter(ChosenOutcome)


@dataclass(frozen=True)
class Diagnoses:
    """Diagnoses with changed settings: read where they are stored, else computed and stored."""

    folder: Path
    code: str

    def stored(self, recording: Recording, change: Change) -> ChosenOutcome | None:
        """The stored outcome; None where there is none or its file is damaged."""
        try:
            return OUTCOME_ADAPTER.validate_json(self._place(recording, change).read_bytes())
        except (FileNotFoundError, ValidationError):
            return None

    def outcome(self, recording: Recording, change: Change, progress: Progress) -> ChosenOutcome:
        """The errors of the model that is found with a change, on the runs of the recording that validate."""
        found = self.stored(recording, change)
        if found is None:
            found = examine(recording, change, progress)
            self.folder.mkdir(parents=True, exist_ok=True)
            write_whole(self._place(recording, change), OUTCOME_ADAPTER.dump_json(found))
        return found

    def _place(self, recording: Recording, change: Change) -> Path:
        key = hashlib.sha256(f"{self.code} {change!r} {recording_digest(recording)}".encode())
        return self.folder / f"{recording.name}-{key.hexdigest()[:20]}.json"


def examine(recording: Recording, change: Change, progress: Progress) -> ChosenOutcome:
    """Diagnoses a recording with a change of settings and judges the model found."""
    settings = Settings()
    for name, value in change:
        settings = vary(settings, name, value)
    diagnosis = diagnose(recording, settings=settings, progress=progress)
    if diagnosis.inertial is None:
        return ChosenOutcome(None)
    model, cutoff = model_found(diagnosis), common_cutoff(recording)
    validate = recording.with_role("validate")
    return ChosenOutcome({run.name: judged_run(run, cutoff).percent(model) for run in validate})


def inside_identification(recording: Recording) -> Recording:
    """A recording of the identification runs alone: their first parts identify, what follows validates."""
    runs: list[Run] = []
    for run in recording.with_role("identify"):
        cut = round(FITTED_SHARE * run.samples)
        parts: tuple[tuple[slice, Role], ...] = ((slice(0, cut), "identify"), (slice(cut, None), "validate"))
        runs += [replace(run.rows(rows), role=role, part=number) for number, (rows, role) in enumerate(parts, 1)]
    return replace(recording, runs=tuple(runs))


@dataclass(frozen=True)
class ChosenSettings:
    """For an arm that is left out: the change with the least error on the others, and what it does on this arm."""

    arm: str
    change: Change
    usual: ChosenOutcome
    chosen: ChosenOutcome


def single_changes(tried: Mapping[str, tuple[float, ...]]) -> tuple[Change, ...]:
    """The usual settings, and each tried value of each number alone."""
    return (USUAL, *(((name, value),) for name, values in tried.items() for value in values))


def choose_change(outcomes: Mapping[Change, Sequence[ChosenOutcome]]) -> Change:
    """The change with the least mean logarithm of the error over arms; the first of equals.

    outcomes: of each change on the same arms, the usual settings first.
    """
    return min(outcomes, key=lambda change: sum(each.log_error for each in outcomes[change]))


def joined_change(outcomes: Mapping[Change, Sequence[ChosenOutcome]]) -> Change:
    """The best value of every number at once, each as the single changes tell it."""
    joined: dict[str, float] = {}
    for name in {name for change in outcomes for name, _ in change}:
        of_name = {change: found for change, found in outcomes.items() if change == USUAL or change[0][0] == name}
        joined |= dict(choose_change(of_name))
    return tuple(sorted(joined.items()))


@dataclass(frozen=True, eq=False)
class LeaveOneOut:
    """The whole study of some arms."""

    recordings: Mapping[str, Recording]
    diagnoses: Diagnoses
    looks: Looks
    tried: Mapping[str, tuple[float, ...]]

    def inside(self, progress: Progress) -> dict[str, dict[Change, ChosenOutcome]]:
        """Outcomes inside the identification runs of each arm: of the usual settings and of each single change."""
        changes, out = single_changes(self.tried), {}
        number, count = 0, len(changes) * len(self.recordings)
        for name, recording in self.recordings.items():
            within, found = inside_identification(recording), {}
            for change in changes:
                number += 1
                heading = f"{number} of {count}: {name}, {change_in_words(change)}"
                progress(heading)
                found[change] = self.diagnoses.outcome(within, change, progress_under(heading, progress))
            out[name] = found
        return out

    def judge(self, arm: str, inside: dict[str, dict[Change, ChosenOutcome]], progress: Progress) -> ChosenSettings:
        """Chooses on the other arms, then looks at the runs of this arm that validate."""
        others = [name for name in self.recordings if name != arm]
        outcomes = {change: [inside[name][change] for name in others] for change in single_changes(self.tried)}
        joined = joined_change(outcomes)
        if joined not in outcomes:
            outcomes[joined] = []
            for name in others:
                heading = f"{arm} left out: {name}, {change_in_words(joined)}"
                progress(heading)
                within = inside_identification(self.recordings[name])
                outcomes[joined].append(self.diagnoses.outcome(within, joined, progress_under(heading, progress)))
        chosen = choose_change(outcomes)
        usual = self._look(arm, USUAL, progress)
        return ChosenSettings(arm, chosen, usual, usual if chosen == USUAL else self._look(arm, chosen, progress))

    def _look(self, arm: str, change: Change, progress: Progress) -> ChosenOutcome:
        recording, heading = self.recordings[arm], f"{arm} judges: {change_in_words(change)}"
        if self.diagnoses.stored(recording, change) is None:
            for run in recording.with_role("validate"):
                self.looks.note(arm, run.name, f"leave one out: {change_in_words(change)}")
        progress(heading)
        return self.diagnoses.outcome(recording, change, progress_under(heading, progress))


def change_in_words(change: Change) -> str:
    """A change of settings as it is typed."""
    return ", ".join(f"{name}={value:g}" for name, value in change) or "usual settings"


def leave_arms_out(
    results: Path, recordings: Path, only: Sequence[str] = (), progress: Progress = lambda message: None
) -> Iterator[str]:
    """Lines that tell what was chosen and written; InputError for an unknown name or fewer than two arms."""
    names = [recipe.name for recipe in chosen_recipes(only) if recipe.name in ARMS]
    if len(names) < 2:
        raise InputError(f"--leave-one-out needs at least two of {', '.join(ARMS)}")
    study = LeaveOneOut(
        {name: open_public_recording(name, recordings) for name in names},
        Diagnoses(recordings / OUTCOMES_FOLDER, code_digest(Path(__file__), Path(__file__).with_name("judged_run.py"))),
        Looks(results / LOOKS_FILE),
        TRIED_VALUES,
    )
    inside = study.inside(progress)
    chosen = []
    for name in names:
        chosen.append(study.judge(name, inside, progress))
        yield chosen_in_words(chosen[-1])
    texts = {PAGE_NAME: page(chosen, inside, study.tried), TABLE_NAME: errors_csv(chosen)}
    yield from (str(path) for path in write_texts(texts, results))


def chosen_in_words(chosen: ChosenSettings) -> str:
    """What was chosen without an arm, and its errors, for the terminal."""
    rows = errors_frame([chosen])
    errors = "; ".join(
        f"{row.run} {row.usual_filtered:.2f} % with usual settings, {row.chosen_filtered:.2f} % with these"
        for row in rows.itertuples()
    )
    return f"{chosen.arm} left out: {change_in_words(chosen.change)}; {errors or 'no model'}"


def errors_frame(chosen: Sequence[ChosenSettings]) -> pd.DataFrame:
    """A row for each arm and run that validates: errors in percent, by usual and by chosen settings."""
    rows = []
    for each in chosen:
        for run in sorted({*(each.usual.errors or {}), *(each.chosen.errors or {})}):
            row: dict[str, object] = {"arm": each.arm, "run": run, "chosen": change_in_words(each.change)}
            for name, outcome in (("usual", each.usual), ("chosen", each.chosen)):
                error = (outcome.errors or {}).get(run)
                row[f"{name}_recorded"] = math.nan if error is None else error.recorded
                row[f"{name}_filtered"] = math.nan if error is None else error.filtered
            rows.append(row)
    columns = ["arm", "run", "chosen", "usual_recorded", "usual_filtered", "chosen_recorded", "chosen_filtered"]
    return pd.DataFrame(rows, columns=columns)


def errors_csv(chosen: Sequence[ChosenSettings]) -> str:
    """The table as text."""
    out = StringIO()
    errors_frame(chosen).to_csv(out, index=False, float_format="%.4g", lineterminator="\n")
    return out.getvalue()


def page(
    chosen: Sequence[ChosenSettings],
    inside: Mapping[str, Mapping[Change, ChosenOutcome]],
    tried: Mapping[str, tuple[float, ...]],
) -> str:
    """The whole page."""
    numbers = "; ".join(
        f"`{name}` {', '.join(f'{value:g}' for value in (*values, find_number(name).value))} (the last is usual)"
        for name, values in tried.items()
    )
    introduction = (
        "Are the settings of the diagnosis made for these arms? For each arm, settings are chosen on the other arms "
        f"alone, and the arm judges them. Tried: {numbers}.\n\n"
        f"The choice sees identification runs only: their first {100 * FITTED_SHARE:.0f} % identify, the rest is held "
        "out. The change with the least mean logarithm of the error over arms is taken: of the usual settings, each "
        "value alone, and the best value of every number at once. Errors are those of `diagnose`'s whole model, "
        "percent of the torque as recorded / of the filtered torque, as in `arms.md`. The baseline is the usual one: "
        "links as given where there are any, else refitted ones."
    )
    judged = markdown_table(
        ["arm left out", "run", "chosen on the others", "usual settings", "chosen settings"],
        [
            (
                row.arm,
                row.run,
                row.chosen,
                f"{row.usual_recorded:.2f} / {row.usual_filtered:.2f}",
                f"{row.chosen_recorded:.2f} / {row.chosen_filtered:.2f}",
            )
            for row in errors_frame(chosen).itertuples()
        ],
    )
    held_out = markdown_table(
        ["settings", *inside],
        [
            (change_in_words(change), *(_outcome_text(found[change]) for found in inside.values()))
            for change in single_changes(tried)
        ],
    )
    return markdown_page(
        "Real arms, one left out",
        introduction,
        "## Judged on the arm left out",
        judged,
        "## Inside the identification runs",
        held_out,
    )


def _outcome_text(outcome: ChosenOutcome) -> str:
    if not outcome.errors:
        return "no model"
    return "; ".join(f"{each.recorded:.2f} / {each.filtered:.2f}" for each in outcome.errors.values())
