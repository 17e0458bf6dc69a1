"""`armlab score`: from a concealed set and verdicts to score.json, tables, figures, the page and the gallery."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, cast

from armlab.common.errors import InputError
from armlab.common.files import all_or_none, write_texts
from armlab.proof.blind.formats import SetManifest
from armlab.proof.blind.score.cases import JudgedCase, read_cases
from armlab.proof.blind.score.distance import read_oracle_table, remove_oracle
from armlab.proof.blind.score.figures import draw_figures
from armlab.proof.blind.score.gallery import remove_other_pictures, write_gallery
from armlab.proof.blind.score.measures import (
    Measure,
    compute_measures,
    confusion_table,
    detection_table,
    detection_table_by_effect,
)
from armlab.proof.blind.score.outcomes import list_misses
from armlab.proof.blind.score.rows import ScoreRows, make_rows, read_table
from armlab.proof.blind.score.score_page import CAPTIONS, format_measure, render_page
from armlab.proof.blind.sealed import read_checked_manifest

SCORE_FILE, PAGE_FILE, MISSES_FILE = "score.json", "score.md", "misses.csv"
ROW_TABLES = ("cases", "effects", "claims", "parameters")


def score_set(folder: Path, verdicts: Path, sealed: str | None, out: Path) -> dict[str, Any]:
    """Checks the seal, scores every case, writes score.json, CSV tables, score.md, figures and the gallery into `out`.

    sealed: SHA-256 of the manifest as printed. Raises InputError for a set that was changed since, and where there
    is no verdict at all.
    """
    cases, table, result = compute_score(folder, verdicts, sealed)
    missed = list_misses(cases, table)
    with all_or_none(out) as draft:
        (draft / SCORE_FILE).write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        missed.to_csv(draft / MISSES_FILE, index=False)
        _write_tables(table, sorted(result["tiers"]), draft)
        shown = write_gallery(cases, table, draft)
        drawn = [path.stem for path in draw_figures(table, draft)]
        (draft / PAGE_FILE).write_text(render_page(table, result, missed, drawn), encoding="utf-8")
    remove_other_pictures(out, shown)
    remove_oracle(out)
    return result


def read_rows(folder: Path) -> ScoreRows:
    """The tables of a score. OSError where one is missing."""
    return ScoreRows(*(read_table(folder / f"{name}.csv") for name in ROW_TABLES))


def write_page_again(folder: Path) -> dict[str, Any]:
    """Writes score.md of a score again, from score.json and the tables beside it; returns what score.json holds.

    Nothing is judged anew. Raises InputError where a file of the score is missing or is none.
    """
    try:
        result = json.loads((folder / SCORE_FILE).read_text(encoding="utf-8"))
        table = read_rows(folder)
        drawn = [name for name in CAPTIONS if (folder / f"{name}.svg").is_file()]
        oracle = read_oracle_table(folder, table.effects)
        page = render_page(table, result, read_table(folder / MISSES_FILE), drawn, oracle)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{folder} holds no whole score ({error}): score its set again with --verdicts") from None
    write_texts({PAGE_FILE: page}, folder)
    return cast(dict[str, Any], result)


def compute_score(
    folder: Path, verdicts: Path, sealed: str | None
) -> tuple[list[JudgedCase], ScoreRows, dict[str, Any]]:
    """The cases, their rows and what score.json holds; nothing is written. Raises InputError as `score` does."""
    manifest, found = read_checked_manifest(folder, SetManifest, sealed)
    cases = read_cases(folder, verdicts, manifest.cases)
    table = make_rows(cases)
    result = {
        "schema": "score/1",
        "manifest": found,
        "seed": manifest.seed,
        "kind": manifest.kind,
        "development": manifest.development,
        "cases": len(table.cases),
        "tiers": {
            tier: [asdict(each) for each in compute_measures(table, tier)] for tier in sorted(set(table.cases["tier"]))
        },
    }
    return cases, table, result


def format_lines(result: dict[str, Any]) -> list[str]:
    """The measures, a line each, for the terminal."""
    out = []
    for tier, found in result["tiers"].items():
        measures = [Measure(**each) for each in found]
        out += [f"{tier}:", *(f"  {each.title}: {format_measure(each)}  {each.wanted}" for each in measures)]
    return out


def _write_tables(table: ScoreRows, tiers: list[str], out: Path) -> None:
    for name in ROW_TABLES:
        getattr(table, name).to_csv(out / f"{name}.csv", index=False)
    detection_table_by_effect(table).to_csv(out / "detection_by_effect.csv", index=False)
    for tier in tiers:
        detection_table(table, tier).to_csv(out / f"detection_{tier}.csv", index=False)
        confusion_table(table, tier).to_csv(out / f"confusion_{tier}.csv")
