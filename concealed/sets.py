"""A concealed set: cases made in parallel, each whole or not at all, and the seal upon them."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from joblib import Parallel, delayed

from concealed.manifest import NAME, write_manifest
from concealed.plan import DEVELOPMENT_SEEDS, Plan, Tier, draw_plan
from problem.errors import InputError

Kind = Literal["mixed", "nulls"]
TIERS: tuple[Tier, ...] = ("clean", "realistic")
SETTINGS = "settings.json"


@dataclass(frozen=True)
class SetSettings:
    """What a set holds. development: without the kinds of noise that are kept for judged sets."""

    cases: int
    seed: int
    tier: Literal["clean", "realistic", "both"] = "both"
    kind: Kind = "mixed"
    development: bool = False

    def plan(self, number: int) -> Plan:
        """The plan of one case; `both` takes the tiers in turn."""
        tiers = TIERS if self.tier == "both" else (self.tier,)
        index, tier = divmod(number, len(tiers))
        return draw_plan(self.seed, index, tiers[tier], self.kind == "nulls", self.development)


def settings_for(cases: int, seed: int, tier: Any, kind: Any, development: bool) -> SetSettings:
    """The settings of a set; seeds 1000-1999 make development sets, whatever was asked."""
    return SetSettings(cases, seed, tier, kind, development or seed in DEVELOPMENT_SEEDS)


def conceal(settings: SetSettings, out: Path, jobs: int) -> Iterator[str]:
    """Makes what is missing of a set, tells each case's name as it is done, last the manifest's SHA-256.

    Raises InputError for a folder that holds another set.
    """
    _claim(settings, out)
    names = [settings.plan(number).name for number in range(settings.cases)]
    missing = [number for number, name in enumerate(names) if not _done(out, name)]
    work = (delayed(_make)(settings, number, out) for number in missing)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)
    if missing or not (out / NAME).is_file():
        facts = {key: value for key, value in asdict(settings).items() if key != "cases"}
        write_manifest(out, {**facts, "cases": sorted(names)})


def _claim(settings: SetSettings, out: Path) -> None:
    """Notes what the folder is for, before hours of work."""
    content = json.dumps(asdict(settings), indent=1) + "\n"
    note = out / SETTINGS
    if note.is_file() and note.read_text(encoding="utf-8") != content:
        raise InputError(f"{out} holds another concealed set (see {note}): choose another folder")
    if out.exists() and not note.is_file() and any(out.iterdir()):
        raise InputError(f"{out} is there already and holds no concealed set: choose another folder")
    for part in ("observations", "truth"):
        (out / part).mkdir(parents=True, exist_ok=True)
    note.write_text(content, encoding="utf-8")


def _done(out: Path, name: str) -> bool:
    return (out / "observations" / name).is_dir()


def _make(settings: SetSettings, number: int, out: Path) -> str:
    """Makes one case in a draft folder; the observation's renaming comes last, so that a cut leaves no half."""
    from concealed.folder import write_case
    from concealed.passes import simulated

    plan = settings.plan(number)
    draft = out / "drafts" / plan.name
    shutil.rmtree(draft, ignore_errors=True)
    write_case(simulated(plan), draft / "observation", draft / f"{plan.name}.json")
    for suffix in (".json", ".parquet"):
        (draft / f"{plan.name}{suffix}").replace(out / "truth" / f"{plan.name}{suffix}")
    (draft / "observation").replace(out / "observations" / plan.name)
    shutil.rmtree(draft)
    return plan.name
