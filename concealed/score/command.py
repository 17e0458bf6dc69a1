"""`armlab score`: from a concealed set and verdicts to score.json, tables, figures, the page and the gallery."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from concealed.manifest import checked_manifest
from concealed.score.figures import draw_all
from concealed.score.gallery import write_gallery
from concealed.score.measures import Measure, measures
from concealed.score.misses import misses
from concealed.score.page import page, shown
from concealed.score.reading import Judged, judged
from concealed.score.rows import Rows, rows
from concealed.score.tables import confusion, detection, detection_by_effect

FILE = "score.json"


def score(folder: Path, verdicts: Path, sealed: str | None, out: Path) -> dict[str, Any]:
    """Checks the seal, scores every case, writes score.json, CSV tables, score.md, figures and the gallery into `out`.

    sealed: SHA-256 of the manifest as printed. Raises InputError for a set that was changed since, and where there
    is no verdict at all.
    """
    cases, table, result = counted(folder, verdicts, sealed)
    tiers = sorted(result["tiers"])
    out.mkdir(parents=True, exist_ok=True)
    (out / FILE).write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    missed = misses(cases, table)
    missed.to_csv(out / "misses.csv", index=False)
    _write_tables(table, tiers, out)
    write_gallery(cases, table, out)
    drawn = [path.stem for path in draw_all(table, out)]
    (out / "score.md").write_text(page(table, result, missed, drawn), encoding="utf-8")
    return result


def counted(folder: Path, verdicts: Path, sealed: str | None) -> tuple[list[Judged], Rows, dict[str, Any]]:
    """The cases, their rows and what score.json holds; nothing is written. Raises InputError as `score` does."""
    manifest, found = checked_manifest(folder, sealed)
    cases = judged(folder, verdicts, manifest["cases"])
    table = rows(cases)
    result = {
        "schema": "score/1",
        "manifest": found,
        "seed": manifest["seed"],
        "kind": manifest["kind"],
        "development": manifest["development"],
        "cases": len(table.cases),
        "tiers": {tier: [asdict(each) for each in measures(table, tier)] for tier in sorted(set(table.cases["tier"]))},
    }
    return cases, table, result


def lines(result: dict[str, Any]) -> list[str]:
    """The measures, a line each, for the terminal."""
    out = []
    for tier, found in result["tiers"].items():
        out += [f"{tier}:", *(f"  {each['name']}: {shown(Measure(**each))}  {each['wanted']}" for each in found)]
    return out


def _write_tables(table: Rows, tiers: list[str], out: Path) -> None:
    for name in ("cases", "effects", "claims", "parameters"):
        getattr(table, name).to_csv(out / f"{name}.csv", index=False)
    detection_by_effect(table).to_csv(out / "detection_by_effect.csv", index=False)
    for tier in tiers:
        detection(table, tier).to_csv(out / f"detection_{tier}.csv", index=False)
        confusion(table, tier).to_csv(out / f"confusion_{tier}.csv")
