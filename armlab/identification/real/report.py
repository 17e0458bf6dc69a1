"""What `armlab real` does: all public recordings by one procedure, `identification.csv` and a page with pictures."""

from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.identification.peers.side_by_side import compare_peers, write_peers
from armlab.identification.pictures import png_data_url
from armlab.identification.real.looks import Looks
from armlab.identification.real.published import Comparison, compare_with_published, fit_published_structure
from armlab.identification.real.study import RECIPES, Study, describe_study, study_recording
from armlab.identification.validation import RunError

PAGE_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 1060px; margin: 2em auto; padding: 0 1em; color: #222; }
table { border-collapse: collapse; } th, td { text-align: right; padding: 3px 12px; border-bottom: 1px solid #e4e4e4; }
th:first-child, td:first-child { text-align: left; } img { max-width: 100%; }
"""
MAX_STANDARD_ERRORS = 2.0  # combined standard errors


def write_report(studies: Sequence[Study], looks: Looks, folder: Path) -> tuple[Path, Path]:
    """Paths of the table and the page; InputError where they cannot be written."""
    table, page = folder / "identification.csv", folder / "identification.html"
    body = "".join(_page_body(studies, looks))
    head = (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Real '
        f"arms</title><style>{PAGE_STYLE}</style>"
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        error_frame(studies).to_csv(table, index=False, float_format="%.3f", lineterminator="\n")
        page.write_text(f"{head}</head><body>{body}</body></html>\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {folder}: {error.strerror}") from None
    return table, page


def error_frame(studies: Sequence[Study]) -> pd.DataFrame:
    """recording, model, run, relative_error_percent: one row for each model on each run."""
    rows = [
        (study.recipe.name, model.name, error.run, error.relative_percent)
        for study in studies
        for model in study.models
        for error in model.errors
    ]
    return pd.DataFrame(rows, columns=["recording", "model", "run", "relative_error_percent"])


def _page_body(studies: Sequence[Study], looks: Looks) -> Iterator[str]:
    yield "<h1>Real arms</h1><p>Percent of ||tau - tau_hat|| / ||tau|| over all joints. Cut-off, components and prior "
    yield "are chosen by blocked cross-validation inside the identification data; validation data are looked at "
    yield "afterwards, and every look is logged.</p>"
    for study in studies:
        yield from _study_section(study, looks)


def _study_section(study: Study, looks: Looks) -> Iterator[str]:
    yield f"<h2>{escape(study.recipe.name)}</h2><p>{escape(describe_study(study))}. "
    yield f"{len(study.selection.tried)} alternatives were compared inside the identification data.</p>"
    yield "<table><tr><th>model</th><th>run</th><th>role</th><th>percent, filtered</th><th>percent, as recorded</th>"
    yield "<th>best known</th><th>looks at the run</th></tr>"
    for model in study.models:
        for error in model.errors:
            yield _error_row(study, model.name, error, looks)
    yield "</table>"
    chosen = study.models[-1].identifier
    yield f"<p>Condition number of the chosen columns at unit length: {chosen.condition_number_:.3g}.</p>"
    if study.recipe.name == "staubli-tx40":
        choice = study.selection.choice
        same = fit_published_structure(study.recording, choice.cutoff_hz, choice.position_factor)
        yield from _published_section(compare_with_published(same))
    for run in study.recording.with_role("validate"):
        picture = png_data_url(chosen.model_.plot(run))
        yield f'<img alt="torque and model on {escape(run.name)}" src="{picture}">'


def _error_row(study: Study, name: str, error: RunError, looks: Looks) -> str:
    judged = error.role == "validate"
    known = study.recipe.best_known.get(error.run, float("nan")) if judged else float("nan")
    count = looks.count(study.recording.arm.name, error.run) if judged else 0
    cells = (
        name,
        error.run,
        error.role,
        f"{error.relative_percent:.2f}",
        f"{error.recorded_percent:.2f}",
        f"{known:.1f}" if known == known else "",
        str(count) if judged else "",
    )
    return "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


def _published_section(rows: Sequence[Comparison]) -> Iterator[str]:
    close = sum(row.ratio < MAX_STANDARD_ERRORS for row in rows)
    yield f"<p>{close} of {len(rows)} published base parameters ({100 * close / len(rows):.0f} %) lie within "
    yield (
        f"{MAX_STANDARD_ERRORS:g} combined standard "
        "errors.</p><table><tr><th>parameter</th><th>published</th><th>found</th>"
    )
    yield "<th>difference / combined standard error</th></tr>"
    for row in rows:
        yield f"<tr><td>{escape(row.name)}</td><td>{row.published:.4g} &plusmn; {row.published_error:.2g}</td>"
        yield f"<td>{row.found:.4g} &plusmn; {row.found_error:.2g}</td><td>{row.ratio:.2f}</td></tr>"
    yield "</table>"


LOOKS_FILE = "validation_looks.jsonl"


def identify_public(
    results: Path, recordings: Path, only: Sequence[str] = (), peers: Path | None = None
) -> Iterator[str]:
    """Lines about what was identified and written; InputError for an unknown name.

    peers: an interpreter with figaroh and mujoco.sysid, which then take part.
    """
    names = [recipe.name for recipe in RECIPES]
    for name in only:
        if name not in names:
            raise InputError(f"unknown recording '{name}': {suggest_name(name, names)}")
    looks, studies = Looks(results / LOOKS_FILE), []
    for recipe in (each for each in RECIPES if not only or each.name in only):
        study = study_recording(recipe, recordings, looks)
        studies.append(study)
        yield describe_study(study)
        for error in study.models[-1].errors:
            known = recipe.best_known.get(error.run) if error.role == "validate" else None
            beside = f" (best known {known:g} %)" if known else ""
            recorded = f"{error.recorded_percent:.2f} % of the torque as recorded"
            yield f"  {error.role} {error.run}: {error.relative_percent:.2f} %{beside}, {recorded}"
    table, page = write_report(studies, looks, results)
    yield f"{table}\n{page}"
    if peers is not None:
        folder = recordings / ".peers"
        compared = [row for each in studies for row in compare_peers(each, peers, folder / each.recipe.name, looks)]
        yield str(write_peers(compared, results))
