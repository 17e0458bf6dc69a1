"""`armlab real-concealed`: real recordings with something concealed, diagnosed and judged."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from armlab.diagnosis.verdict_files import write_texts
from diagnosis.real_concealed.kept import kept_in
from diagnosis.real_concealed.page import PICTURE, count_lines, markdown
from diagnosis.real_concealed.picture import svg
from diagnosis.real_concealed.plan import INJECTED
from diagnosis.real_concealed.study import study
from diagnosis.real_concealed.table import csv
from identification.real.command import LOG
from identification.real.looks import Looks
from problem.errors import InputError
from problem.settings import nearest

FOLDER = ".concealed"


def conceal_in_real(
    results: Path, recordings: Path, only: Sequence[str] = (), progress: Callable[[str], None] = lambda message: None
) -> Iterator[str]:
    """Lines that tell what was found and written; InputError for an unknown name.

    Table, page and picture hold the recordings of this call. What is interrupted goes on.
    """
    names = list(INJECTED)
    for name in only:
        if name not in names:
            raise InputError(f"unknown recording '{name}': {nearest(name, names)}")
    kept, looks, studies = kept_in(recordings / FOLDER), Looks(results / LOG), []
    for name in (each for each in names if not only or each in only):
        studies.append(study(name, recordings, kept, looks, progress))
        yield from count_lines(studies[-1].verdicts, name)
    texts = {"concealed.md": markdown(studies), "concealed.csv": csv(studies), PICTURE: svg(studies)}
    yield from (str(path) for path in write_texts(texts, results))
