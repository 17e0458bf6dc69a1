"""The second half of `armlab real`: diagnosis.md beside what identification wrote."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from armlab.diagnosis.verdict_files import write_texts
from diagnosis.real.study import NAMES, study
from diagnosis.real.tell import markdown
from diagnosis.report.words import verdict_sentences
from identification.real.command import LOG
from identification.real.looks import Looks

PAGE = "diagnosis.md"


def diagnose_public(
    results: Path, recordings: Path, only: Sequence[str] = (), progress: Callable[[str], None] = lambda message: None
) -> Iterator[str]:
    """Lines that tell what was found and written; the page holds the recordings of this call."""
    looks, studies = Looks(results / LOG), []
    for name in (each for each in NAMES if not only or each in only):
        progress(name)
        studies.append(study(name, recordings, looks, progress))
        yield f"{name}: {' '.join(verdict_sentences(studies[-1].diagnosis))}"
        for gain in studies[-1].gains:
            yield f"  {gain.run}: {gain.refitted:.1f} % refitted, {gain.found:.1f} % with what was found"
    if studies:
        write_texts({PAGE: markdown(studies)}, results)
        yield str(results / PAGE)
