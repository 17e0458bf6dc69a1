"""The page: its sections one after the other, for a verdict with and without a fit."""

from armlab.diagnosis.result import Diagnosis
from diagnosis.report import sections
from diagnosis.report.findings import findings
from diagnosis.report.gallery import Gallery
from diagnosis.report.html import document


def report_page(diagnosis: Diagnosis, gallery: Gallery | None, command: str) -> str:
    """HTML text. gallery: None where nothing was fitted."""
    parts = [sections.head(diagnosis)]
    if gallery is not None:
        parts += [
            sections.before_after(diagnosis, gallery),
            findings(diagnosis, gallery),
            sections.where(diagnosis, gallery),
            sections.motion(gallery),
            sections.following(diagnosis),
            sections.method(diagnosis, gallery.data.observed.held_out_blocks),
        ]
    parts.append(sections.origin(diagnosis, command))
    return document(f"Diagnosis of {diagnosis.recording.name}", parts)
