"""The simulated recordings of a look at likeness: nulls of the field tier, and of the realistic one beside them."""

from pathlib import Path

from joblib import Parallel, delayed

from armlab.proof.blind.field.field_plan import FieldPlan, draw_field_plan
from armlab.proof.blind.field.field_runs import simulate_field
from armlab.proof.blind.field.files import write_field_observation
from armlab.proof.blind.sealed import OBSERVATIONS
from armlab.proof.tiers.torque import TORQUE, SetSettings


def make_field_nulls(seed: int, cases: int, folder: Path, jobs: int) -> list[Path]:
    """Recording folders of field nulls; those that are there already stay."""
    plans = [draw_field_plan(seed, index, "null") for index in range(cases)]
    missing = [plan for plan in plans if not (folder / plan.name).is_dir()]
    Parallel(n_jobs=jobs)(delayed(_make)(plan, folder) for plan in missing)
    return [folder / plan.name for plan in plans]


def make_realistic_nulls(seed: int, cases: int, folder: Path, jobs: int) -> list[Path]:
    """Recording folders of nulls of the realistic tier; those that are there already stay."""
    settings = SetSettings(cases, seed, "realistic", "nulls", development=True)
    for _ in TORQUE.conceal(settings, folder, jobs):
        pass
    return [folder / OBSERVATIONS / plan.name for plan in TORQUE.draw(settings)]


def _make(plan: FieldPlan, folder: Path) -> None:
    write_field_observation(simulate_field(plan), folder / plan.name)
