"""`armlab score`: from a concealed set and verdicts to score.json, tables and figures."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd

from concealed.manifest import checked_manifest
from concealed.score.figures import draw_all
from concealed.score.measures import Measure, by_effect, confusion, detection, measures
from concealed.score.reading import judged
from concealed.score.rows import Rows, rows

FILE = "score.json"


def score(folder: Path, verdicts: Path, sealed: str | None, out: Path) -> dict[str, Any]:
    """Checks the seal, scores every case, writes score.json, CSV tables, score.md and figures into `out`.

    sealed: SHA-256 of the manifest as printed. Raises InputError for a set that was changed since, and where there
    is no verdict at all.
    """
    manifest, found = checked_manifest(folder, sealed)
    table = rows(judged(folder, verdicts, manifest["cases"]))
    tiers = sorted(set(table.cases["tier"]))
    result = {
        "schema": "score/1",
        "manifest": found,
        "seed": manifest["seed"],
        "kind": manifest["kind"],
        "development": manifest["development"],
        "cases": len(table.cases),
        "tiers": {tier: [asdict(each) for each in measures(table, tier)] for tier in tiers},
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / FILE).write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    _write_tables(table, tiers, out)
    (out / "score.md").write_text(page(table, tiers, result), encoding="utf-8")
    draw_all(table, out)
    return result


def page(table: Rows, tiers: list[str], result: dict[str, Any]) -> str:
    """The score as Markdown."""
    seal = f"{result['cases']} cases, seed {result['seed']}, manifest SHA-256 `{result['manifest']}`."
    parts = ["# Score on concealed effects", seal]
    for tier in tiers:
        parts += [f"## {tier} tier", _markdown(measures(table, tier)), "Names by effect, above three detection limits:"]
        parts += [_frame(by_effect(table, tier)), f"![confusion](confusion_{tier}.svg)"]
    return "\n\n".join([*parts, "![detection](detection.svg)", "![gap](gap.svg)"]) + "\n"


def lines(result: dict[str, Any]) -> list[str]:
    """The measures, a line each, for the terminal."""
    out = []
    for tier, found in result["tiers"].items():
        out += [f"{tier}:", *(f"  {each['name']}: {_shown(Measure(**each))}  {each['wanted']}" for each in found)]
    return out


def _write_tables(table: Rows, tiers: list[str], out: Path) -> None:
    for name in ("cases", "effects", "claims", "parameters"):
        getattr(table, name).to_csv(out / f"{name}.csv", index=False)
    for tier in tiers:
        detection(table, tier).to_csv(out / f"detection_{tier}.csv", index=False)
        confusion(table, tier).to_csv(out / f"confusion_{tier}.csv")


def _markdown(found: list[Measure]) -> str:
    rows = [f"| {each.name} | {_shown(each)} | {each.number} | {each.wanted} |" for each in found]
    return "\n".join(["| measure | observed (95 % interval) | of | wanted |", "|---|---|---|---|", *rows])


def _shown(each: Measure) -> str:
    if each.value is None:
        return "-"
    return f"{each.value:.3g} ({each.low:.3g} to {each.high:.3g})"


def _frame(table: pd.DataFrame) -> str:
    head = [f"| {' | '.join(table.columns)} |", "|" + "---|" * table.shape[1]]
    return "\n".join([*head, *(f"| {' | '.join(map(str, row))} |" for row in table.itertuples(index=False))])
