"""The report as files: one page, and each picture as a file beside it."""

from pathlib import Path

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.verdict_files import write_texts
from diagnosis.report.gallery import Gallery, gallery
from diagnosis.report.page import report_page
from diagnosis.report.rows import shown

PAGE, FIGURES = "report.html", "figures"


def report_texts(diagnosis: Diagnosis, command: str = "") -> dict[str, str]:
    """Names and content of the page and the pictures. command: that repeats it."""
    data = shown(diagnosis)
    drawn: Gallery | None = None if data is None else gallery(diagnosis, data)
    texts = {PAGE: report_page(diagnosis, drawn, command)}
    if drawn is not None:
        texts |= {f"{FIGURES}/{name}": text + "\n" for name, text in drawn.files.items()}
    return texts


def write_report(diagnosis: Diagnosis, folder: Path, command: str = "") -> Path:
    """Writes report.html and figures/ into a folder and returns the page; InputError where that cannot be done."""
    write_texts(report_texts(diagnosis, command), folder)
    return folder / PAGE
