"""The page of `armlab identify`: parameters with intervals, errors, residuals; one file."""

from html import escape
from pathlib import Path

from identification.identifier import Identifier
from identification.pictures import png
from identification.validation import RunError, error_table
from problem.errors import InputError
from recordings.recording import Recording

STYLE = "body{font:15px/1.45 system-ui,sans-serif;max-width:1060px;margin:2em auto;color:#222}img{max-width:100%}"


def write_page(recording: Recording, identifier: Identifier, errors: tuple[RunError, ...], path: Path) -> Path:
    """Writes the page and returns its path; InputError where it cannot be written."""
    model = identifier.model_
    parts = [
        f"<h1>{escape(recording.name)}</h1><p>Cut-off {model.cutoff_hz:.4g} Hz; condition number "
        f"{identifier.condition_number_:.4g} (columns at unit length); 95 % intervals for correlated errors.</p>",
        f"<h2>Errors</h2><pre>{escape(error_table(errors))}</pre>",
        f"<h2>Parameters</h2><pre>{escape(str(model))}</pre><h2>Residuals</h2>",
        *(f'<img alt="{escape(run.name)}" src="{png(model.plot(run))}">' for run in recording.runs),
    ]
    head = f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(recording.name)}</title>'
    try:
        path.write_text(f"{head}<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    return path
