"""A concealed set: cases made in parallel, each complete or absent, and the manifest that seals them.

The manifest holds the SHA-256 of every file. Its own SHA-256 is printed before the first diagnosis.
"""

import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.concealed.case_files import write_case
from armlab.concealed.folders import claim_folder
from armlab.concealed.formats import LoopManifest, SetKind, SetManifest, SetTier, Tier, read_model, write_model
from armlab.concealed.plan import DEVELOPMENT_SEEDS, PLAN, Plan, draw_plan
from armlab.concealed.sizing import simulate_case

MANIFEST_FILE = "manifest.json"
ManifestModel = TypeVar("ManifestModel", SetManifest, LoopManifest)


def seal_files(folder: Path) -> dict[str, str]:
    """The SHA-256 of every observation and answer below a folder, by path from it."""
    parts = (path for part in ("observations", "truth") for path in (folder / part).rglob("*") if path.is_file())
    files = {path.relative_to(folder).as_posix(): file_digest(path) for path in parts}
    return dict(sorted(files.items()))


def read_checked_manifest(
    folder: Path, model: type[ManifestModel], expected: str | None = None
) -> tuple[ManifestModel, str]:
    """A manifest and its SHA-256, after every file was compared with it.

    expected: the SHA-256 that was printed. Raises InputError if anything differs.
    """
    path = folder / MANIFEST_FILE
    if not path.is_file():
        raise InputError(f"no {MANIFEST_FILE} in {folder}: this is not a finished concealed set")
    found = file_digest(path)
    if expected is not None and found != expected:
        raise InputError(f"{path} has the SHA-256 {found}, not {expected}: it is not the manifest that was sealed")
    manifest = read_model(model, path)
    for name, value in manifest.files.items():
        file = folder / name
        if not file.is_file() or file_digest(file) != value:
            what = "was changed" if file.is_file() else "is missing"
            raise InputError(f"{file} {what} after {MANIFEST_FILE} was sealed: the set cannot be scored")
    return manifest, found


def file_digest(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


TIERS: tuple[Tier, ...] = ("clean", "realistic")


@dataclass(frozen=True)
class SetSettings:
    """What a set holds. development: without the kinds of noise that are kept for judged sets."""

    cases: int
    seed: int
    tier: SetTier = "both"
    kind: SetKind = "mixed"
    development: bool = False

    def plan(self, number: int) -> Plan:
        """The plan of one case; `both` takes the tiers in turn."""
        tiers = TIERS if self.tier == "both" else (self.tier,)
        index, tier = divmod(number, len(tiers))
        nulls = self.kind == "nulls"
        return draw_plan(self.seed, index, tiers[tier], nulls, self.development, PLAN.sticking_share)


def make_set_settings(cases: int, seed: int, tier: SetTier, kind: SetKind, development: bool) -> SetSettings:
    """The settings of a set; seeds 1000-1999 always make development sets."""
    return SetSettings(cases, seed, tier, kind, development or seed in DEVELOPMENT_SEEDS)


def conceal_cases(settings: SetSettings, out: Path, jobs: int) -> Iterator[str]:
    """Makes the missing cases of a set and yields the name of each; an incomplete set loses its seal.

    Raises InputError for a folder that holds another set.
    """
    claim_folder(settings, out, ("observations", "truth"))
    missing = [number for number in range(settings.cases) if not _is_done(out, settings.plan(number).name)]
    if missing:
        (out / MANIFEST_FILE).unlink(missing_ok=True)
    work = (delayed(_make_case)(settings, number, out) for number in missing)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(work)


def seal_set(settings: SetSettings, out: Path) -> tuple[list[str], str]:
    """The names of a complete set's cases and the SHA-256 of its manifest, which is written unless it is there."""
    names = sorted(settings.plan(number).name for number in range(settings.cases))
    if not (out / MANIFEST_FILE).is_file():
        manifest = SetManifest(
            schema="manifest/1",
            seed=settings.seed,
            tier=settings.tier,
            kind=settings.kind,
            development=settings.development,
            cases=tuple(names),
            files=seal_files(out),
        )
        write_model(manifest, out / MANIFEST_FILE)
    return names, file_digest(out / MANIFEST_FILE)


def _is_done(out: Path, name: str) -> bool:
    return (out / "observations" / name).is_dir()


def _make_case(settings: SetSettings, number: int, out: Path) -> str:
    """Makes one case in a draft folder. Its observation is moved last and marks the case as complete."""
    plan = settings.plan(number)
    draft = out / "drafts" / plan.name
    shutil.rmtree(draft, ignore_errors=True)
    write_case(simulate_case(plan), draft / "observation", draft / f"{plan.name}.json")
    for suffix in (".json", ".parquet"):
        (draft / f"{plan.name}{suffix}").replace(out / "truth" / f"{plan.name}{suffix}")
    (draft / "observation").replace(out / "observations" / plan.name)
    shutil.rmtree(draft)
    return plan.name
