"""`armlab proof real` with recording folders or pieces of them: diagnose, measure errors, hold against facts, report.

Rows about a folder without a licence, or of which nothing is known, stand on a page in the work folder alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from joblib import Parallel, delayed

from armlab.common.errors import InputError, describe_failure
from armlab.common.files import write_texts
from armlab.diagnosis.formats import read_verdict_file
from armlab.proof.open.real_folders.consistency import contradictions
from armlab.proof.open.real_folders.errors import FolderErrors, measure_change, measure_errors
from armlab.proof.open.real_folders.facts import FactsFile, PairFacts, SingleFacts, read_facts
from armlab.proof.open.real_folders.facts_score import FolderScore, score_missing, score_pair, score_single
from armlab.proof.open.real_folders.pieces import facts_of_pieces, write_pieces
from armlab.proof.open.real_folders.recording_folders import (
    NEW,
    OLD,
    RecordingFolder,
    check_facts,
    choose_folders,
    find_folders,
)
from armlab.proof.open.real_folders.runs import FolderOutcome, FolderRun, plan_runs, run_missing
from armlab.proof.open.real_folders.stated_names import ToldVerdict, read_told
from armlab.proof.open.real_folders.table import FolderRow, table_texts, total_lines
from armlab.recordings.public import LOCAL_COPIES_VARIABLE

IGNORED = "*\n"  # .gitignore of the work folder: nothing in it is committed


@dataclass(frozen=True)
class FolderProof:
    """root: the folder below which recordings are, None where none is named. facts: a facts file, None without.

    results: folder of the pages that may be published. work: of verdicts, and of the page of all folders.
    """

    root: Path | None
    facts: Path | None
    results: Path
    work: Path
    jobs: int

    def find(self) -> tuple[RecordingFolder, ...]:
        """All folders; InputError where there is none."""
        if self.root is None:
            raise InputError(f"set {LOCAL_COPIES_VARIABLE} to the folder that holds the recordings")
        return find_folders(self.root)

    def read_facts(self, folders: Sequence[RecordingFolder]) -> FactsFile | None:
        """What is known of these folders; InputError for a wrong file, and for facts about another folder."""
        if self.facts is None:
            return None
        facts = read_facts(self.facts)
        check_facts(facts, self.facts, folders)
        return facts


def prove_folders(settings: FolderProof, only: Sequence[str] = ()) -> Iterator[str]:
    """Lines on each folder, the totals, and what is written; an interrupted run continues.

    only: names of folders, all if it is empty. Raises InputError for a wrong facts file and unknown names.
    """
    every = settings.find()
    yield from _prove(choose_folders(every, only), settings.read_facts(every), settings, "folders")


def prove_pieces(settings: FolderProof, only: Sequence[str] = ()) -> Iterator[str]:
    """The same of pieces of the single recordings of which something is known; raises InputError without facts, too."""
    every = settings.find()
    facts = settings.read_facts(every)
    if facts is None:
        raise InputError("--part pieces needs --facts FILE: what is known of the whole judges its pieces")
    known = [each for each in choose_folders(every, only) if each.name in facts.singles]
    pieces = list(write_pieces(known, settings.work / "cut"))
    yield from _prove(pieces, facts_of_pieces(facts), settings, "pieces")


def _prove(
    folders: Sequence[RecordingFolder], facts: FactsFile | None, settings: FolderProof, pages: str
) -> Iterator[str]:
    """pages: the name of the pages without their suffix."""
    runs = plan_runs(folders, settings.work)
    write_texts({".gitignore": IGNORED}, settings.work)
    yield from run_missing(runs, settings.jobs)
    measured = Parallel(n_jobs=settings.jobs, return_as="generator")(
        delayed(_measure)(run, None if facts is None else facts.of(run.folder.name)) for run in runs
    )
    rows = list[FolderRow]()
    for run, errors in zip(runs, measured, strict=True):
        rows.append(_row(run, errors, facts))
        yield rows[-1].line
        yield from (f"  {remark}" for remark in rows[-1].remarks)
    yield from total_lines(rows)
    yield from _write(rows, settings, pages)


def _measure(run: FolderRun, known: SingleFacts | PairFacts | None) -> FolderErrors:
    if run.folder.pair:
        return measure_change(run.folder.path / OLD, run.folder.path / NEW)
    if isinstance(known, SingleFacts) and known.percent == "none":
        return FolderErrors(notes=("plain least squares is no yardstick here",))
    try:
        return measure_errors(run.folder.path, run.verdict_folder, None if known is None else known.low_pass)
    except Exception as error:  # one folder never ends the command
        return FolderErrors(notes=(f"errors: {describe_failure(error)}",))


def _row(run: FolderRun, errors: FolderErrors, facts: FactsFile | None) -> FolderRow:
    outcome = run.outcome() or FolderOutcome(0.0, 0.0, 0.0, "stopped before its end")
    verdict = None
    try:
        verdict = read_told(run.verdict_file) if run.verdict_file.is_file() else None
    except InputError as error:
        outcome = replace(outcome, failure=str(error))
    known = None if facts is None else facts.of(run.folder.name)
    score = None if facts is None or known is None else _score(known, verdict, facts)
    licensed = known is not None and known.licensed
    return FolderRow(run.folder, licensed, outcome, verdict, score, errors, _contradictions(run))


def _contradictions(run: FolderRun) -> tuple[str, ...]:
    """Of the verdict of one recording; none of a comparison, or where there is none."""
    if run.folder.pair or not run.verdict_file.is_file():
        return ()
    try:
        return contradictions(read_verdict_file(run.verdict_file))
    except InputError as error:
        return (str(error),)


def _score(known: SingleFacts | PairFacts, verdict: ToldVerdict | None, facts: FactsFile) -> FolderScore:
    if verdict is None:
        return score_missing(known)
    if isinstance(known, SingleFacts):
        return score_single(known, verdict, facts)
    return score_pair(known, verdict, facts)


def _write(rows: Sequence[FolderRow], settings: FolderProof, pages: str) -> Iterator[str]:
    """The pages: licensed folders among the results, all of them in the work folder."""
    licensed = [each for each in rows if each.licensed]
    if licensed:
        note = f"{len(licensed)} {pages} that may be published, of {len(rows)} that were diagnosed."
        all_totals = "\n\n".join(f"Over all {len(rows)}: {line}" for line in total_lines(rows)[1:])
        texts = table_texts(pages, licensed, f"{note}\n\n{all_totals}" if len(licensed) < len(rows) else note)
        yield from (f"wrote {path}" for path in write_texts(texts, settings.results))
    local = table_texts(pages, rows, f"All {len(rows)} {pages} that were diagnosed. Not to be published.")
    yield from (f"wrote {path} (local: all {pages})" for path in write_texts(local, settings.work))
