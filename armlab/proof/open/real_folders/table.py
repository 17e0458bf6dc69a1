"""The table of recording folders: a row a folder, a row a joint, and what all rows add up to."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.open.real_folders.errors import MODELS, FolderErrors, JointErrors, Ratio
from armlab.proof.open.real_folders.facts_score import FolderScore
from armlab.proof.open.real_folders.recording_folders import RecordingFolder
from armlab.proof.open.real_folders.runs import FolderOutcome
from armlab.proof.open.real_folders.stated_names import FACT_RANKS, ToldVerdict
from armlab.recordings.plain_least_squares import SEEN_ERRORS

TITLES = {"folders": "Recording folders", "pieces": "Pieces of recording folders"}
FOLDER_HEADINGS = (
    "folder",
    "status",
    *FACT_RANKS,
    "wrong",
    "extra",
    "below 0.5",
    "contradictions",
    "words",
    "findings",
    "seconds",
    "processor s",
    "MB",
)
JOINT_HEADINGS = (
    "folder",
    "joint",
    "cut-off Hz",
    "torque rms",
    "plain %",
    *(f"{name} %" for name in MODELS),
    *(f"{name} / plain" for name in MODELS),
)
EXPLANATION = """*Named*, *class*, *cause*, *minor*, *missed*: how the known facts of a folder are told. *Wrong*: what
contradicts them; *extra*: what is told and neither known nor allowed; *below 0.5*: what is too improbable to be told.
*Contradictions*: of a verdict in itself: a finding without which the error falls, shares that do not add up, numbers
without a unit, a sentence that the table refutes.
*Words*: of the summary. *Findings*: those that are told. *Seconds*, *processor s*, *MB*: of the process that diagnoses
the folder. The words are explained in docs/recordings.md.

Held-out error, by joint, in percent of the filtered torque, on the same rows behind the same low-pass: *plain* least
squares (base parameters, rotor inertia, Coulomb and viscous friction, offset), `identify --as-read`, and the model of
`diagnose`. *Ratio*: over plain least squares, with a 95 % interval from a bootstrap of blocks of held-out time that are
the same for both. Torque in N m (N, or what the recording has); of motion only kp (command - position)."""


@dataclass(frozen=True)
class FolderRow:
    """Everything of one folder. verdict: None where there is none. score: None without facts about it.

    contradictions: what its verdict contradicts in itself.
    """

    folder: RecordingFolder
    licensed: bool
    outcome: FolderOutcome
    verdict: ToldVerdict | None
    score: FolderScore | None
    errors: FolderErrors
    contradictions: tuple[str, ...] = ()

    @property
    def cells(self) -> dict[str, str]:
        """The row of the table of folders, by heading; empty where there is nothing to say."""
        verdict, score, took = self.verdict, self.score, self.outcome
        cells = {
            "folder": self.folder.name,
            "status": "no verdict" if verdict is None else verdict.status,
            "words": "" if verdict is None else str(len(verdict.summary.split())),
            "findings": "" if verdict is None else str(sum(not each.minor for each in verdict.found)),
            "contradictions": "" if verdict is None or self.folder.pair else str(len(self.contradictions)),
            "seconds": f"{took.seconds:.0f}",
            "processor s": f"{took.processor_seconds:.0f}",
            "MB": f"{took.memory_mb:.0f}",
        }
        if score is not None:
            cells |= {rank: str(score.count(rank)) for rank in FACT_RANKS}
            cells |= {"wrong": str(len(score.wrong)), "extra": str(len(score.extra))}
            cells["below 0.5"] = str(len(score.below))
        return {heading: cells.get(heading, "") for heading in FOLDER_HEADINGS}

    @property
    def joint_cells(self) -> list[dict[str, str]]:
        """The rows of the table of joints, by heading."""
        return [self._joint_cells(each) for each in self.errors.joints]

    def _joint_cells(self, joint: JointErrors) -> dict[str, str]:
        cells = {
            "folder": self.folder.name,
            "joint": str(joint.joint),
            "cut-off Hz": f"{self.errors.cutoff_hz or 0:.3g}",
            "torque rms": f"{joint.torque:.3g}",
            "plain %": f"{joint.plain:.1f}",
        }
        cells |= {f"{name} %": f"{percent:.1f}" for name, percent in joint.percent.items()}
        cells |= {f"{name} / plain": _ratio_text(ratio) for name, ratio in joint.ratio.items()}
        return {heading: cells.get(heading, "") for heading in JOINT_HEADINGS}

    @property
    def remarks(self) -> Iterator[str]:
        """What the numbers of its row stand for, in a line each."""
        if self.outcome.failure is not None:
            yield f"no verdict: {self.outcome.failure}"
        if self.score is not None:
            for name, items in (("wrong", self.score.wrong), ("extra", self.score.extra), ("below", self.score.below)):
                if items:
                    yield f"{name}: {', '.join(items)}"
        yield from (f"contradiction: {each}" for each in self.contradictions)
        yield from self.errors.notes

    @property
    def line(self) -> str:
        """The row for the terminal."""
        told = ", ".join(
            f"{key} {value}" for key, value in self.cells.items() if key != "folder" and value not in ("", "0")
        )
        return f"{self.folder.name}: {told}"


def _ratio_text(ratio: Ratio) -> str:
    if ratio.interval is None:
        return f"{ratio.value:.2f}"
    return f"{ratio.value:.2f} ({ratio.interval[0]:.2f} to {ratio.interval[1]:.2f})"


def total_lines(rows: Sequence[FolderRow]) -> list[str]:
    """What has no verdict, and the sums over single recordings and over pairs; only the first line without facts."""
    lost = [each.folder.name for each in rows if each.verdict is None]
    lines = [f"no verdict: {', '.join(lost) or 'none'}"]
    singles = [each.score for each in rows if each.score is not None and not each.folder.pair]
    pairs = [each.score for each in rows if each.score is not None and each.folder.pair]
    lines += [_singles_line(singles)] if singles else []
    return [*lines, *([_pairs_line(pairs), _plain_line(rows)] if pairs else [])]


def _singles_line(scores: Sequence[FolderScore]) -> str:
    words = [each.words for each in scores if each.words is not None]
    causes = [each.causes for each in scores if each.causes is not None]
    return (
        f"singles: facts {_ranks_text(scores)}; strong {_ranks_text(scores, strong=True)}; "
        f"WRONG {_sum(len(each.wrong) for each in scores)}, extra {_sum(len(each.extra) for each in scores)}, "
        f"below 0.5 {_sum(len(each.below) for each in scores)}; "
        f"summary {max(words, default=0)} words at most, median {_middle(words)}; "
        f"causes {max(causes, default=0)} at most, median {_middle(causes)}"
    )


def _pairs_line(scores: Sequence[FolderScore]) -> str:
    facts = [fact for each in scores for fact in each.facts]
    widths = ", ".join(f"{fact.width:.1f}" for fact in facts if fact.width is not None)
    return (
        f"pairs: {_ranks_text(scores)}; size right {sum(bool(fact.size_right) for fact in facts)} of {len(facts)}; "
        f"intervals over those of plain least squares {widths or '–'}; "
        f"WRONG {_sum(len(each.wrong) for each in scores)}, extra {_sum(len(each.extra) for each in scores)}"
    )


def _plain_line(rows: Sequence[FolderRow]) -> str:
    """Whether a comparison says "same" where plain least squares sees a change, and whether that is a yardstick."""
    measured = [each for each in rows if each.errors.plain_change is not None]
    beyond = [each for each in measured if (each.errors.plain_change or 0.0) > SEEN_ERRORS]
    same = sum(each.verdict is not None and each.verdict.status == "same" for each in beyond)
    nulls = [each for each in measured if each.score is not None and not each.score.facts]
    return (
        f"pairs: plain least squares sees a change beyond {SEEN_ERRORS:g} standard errors in {len(beyond)} of "
        f'{len(measured)}; "same" is said of {same} of these; of {len(nulls)} with nothing changed it sees one in '
        f"{sum(each in nulls for each in beyond)}"
    )


def _ranks_text(scores: Sequence[FolderScore], strong: bool = False) -> str:
    return ", ".join(f"{_sum(each.count(rank, strong) for each in scores)} {rank}" for rank in FACT_RANKS)


def _sum(counts: Iterable[int]) -> int:
    return sum(counts)


def _middle(counts: Sequence[int]) -> int:
    """The middle one, the upper of two."""
    return sorted(counts)[len(counts) // 2] if counts else 0


def folders_markdown(title: str, rows: Sequence[FolderRow], note: str) -> str:
    """The page of these rows. note: which folders it holds."""
    joints = [cells for each in rows for cells in each.joint_cells]
    remarks = [f"- {each.folder.name}: {remark}" for each in rows for remark in each.remarks]
    return markdown_page(
        title,
        note,
        EXPLANATION,
        _markdown(FOLDER_HEADINGS, [each.cells for each in rows]),
        "\n".join(total_lines(rows)).replace("\n", "\n\n"),
        "## Held-out errors",
        _markdown(JOINT_HEADINGS, joints) if joints else "No folder has held-out torque.",
        "## What the rows stand for",
        "\n".join(remarks) or "Nothing is wrong or extra.",
    )


def _markdown(headings: Sequence[str], rows: Sequence[dict[str, str]]) -> str:
    return markdown_table(headings, [[row[key] or "–" for key in headings] for row in rows], range(2, len(headings)))


def csv_text(headings: Sequence[str], rows: Iterable[dict[str, str]]) -> str:
    """Rows as CSV."""
    out = io.StringIO()
    writer = csv.DictWriter(out, headings, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()


def table_texts(pages: str, rows: Sequence[FolderRow], note: str) -> dict[str, str]:
    """Page and tables by the names of their files. pages: that name without its suffix, of `TITLES`."""
    return {
        f"{pages}.md": folders_markdown(TITLES[pages], rows, note),
        f"{pages}.csv": csv_text(FOLDER_HEADINGS, (each.cells for each in rows)),
        f"{pages}_joints.csv": csv_text(JOINT_HEADINGS, (cells for each in rows for cells in each.joint_cells)),
    }
