"""The whole proof, tier by tier; a tier is named by what its recordings have.

Each tier has a folder of its own, below that of the proof, and continues there after an interruption. A judged proof
has one seed for all of them, from the last commit that changed the code: results of one tier may be committed before
the next one is run.
"""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

from armlab.common.errors import InputError
from armlab.proof.blind.log_page import LOG_FILE
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS
from armlab.proof.blind.sealed import FINISHED_MARK, code_commit, judged_seed
from armlab.proof.blind.setup.setup_plan import PUBLIC
from armlab.proof.tiers.changes import CHANGES, PairSet
from armlab.proof.tiers.field import FIELD_TIER, FieldSet
from armlab.proof.tiers.motion import MOTION, MotionSet
from armlab.proof.tiers.reading import SETUP, SetupSet
from armlab.proof.tiers.real import RealSet, prove_real
from armlab.proof.tiers.summary_page import write_summary
from armlab.proof.tiers.torque import prove_torque, torque_sets

TierName = Literal["torque", "setup", "motion", "real", "changes", "field"]
TIERS: tuple[TierName, ...] = get_args(TierName)
USUAL_TIERS = TIERS[:4]
QUICK_SEED = 1900
Sizes = Mapping[str, int]  # how many cases, by their kind
JUDGED: Mapping[TierName, Sizes] = {
    "torque": {"cases": 400, "nulls": 600},
    "setup": {"simulated": 300, "real": 200, "nulls": 300},
    "motion": {"cases": 300, "nulls": 300},
    "real": {"cases": 16},  # of each recording
    "changes": {"nulls": 300, "changed": 120, "field_nulls": 200, "field_changed": 100},
    "field": {"cases": 100, "nulls": 100, "mistakes": 100},
}
QUICK: Mapping[TierName, Sizes] = {
    "torque": {"cases": 24, "nulls": 0},
    "setup": {"simulated": 6, "real": 0, "nulls": 4},
    "motion": {"cases": 4, "nulls": 4},
    "real": {"cases": 1},
    "changes": {"nulls": 2, "changed": 2, "field_nulls": 2, "field_changed": 2},
    "field": {"cases": 2, "nulls": 2, "mistakes": 2},
}
QUICK_RECORDINGS = ("emps", "staubli-tx40")  # of the tier of real recordings


@dataclass(frozen=True)
class Proof:
    """What the tiers of a proof share. name: of its folder. commit: of the code, None for one that is not judged.

    quick: a few cases of each tier. sizes: other numbers of cases, by their kind. folders: recordings of the local
    copies that stand beside the public ones in the setup tier (with a D-H table) and that of real recordings.
    """

    name: str
    seed: int
    commit: str | None = None
    quick: bool = False
    sizes: Sizes = field(default_factory=dict)
    folders: tuple[str, ...] = ()

    def sizes_of(self, tier: TierName) -> dict[str, int]:
        """How many cases of each kind a tier has."""
        usual = (QUICK if self.quick else JUDGED)[tier]
        return {kind: self.sizes.get(kind, number) for kind, number in usual.items()}


def choose_proof(quick: bool, development: int | None, sizes: Sizes, folders: tuple[str, ...]) -> Proof:
    """The quick proof, small sets of a development seed that are always the same; one on another development seed; or
    the judged one, whose seed follows from the commit, so that nobody could tune on it before the commit existed.

    Raises InputError for a seed that is not for development.
    """
    if quick:
        return Proof("quick", QUICK_SEED, None, quick, sizes, folders)
    if development is None:
        commit = code_commit()
        return Proof(commit, judged_seed(commit), commit, quick, sizes, folders)
    if development not in DEVELOPMENT_SEEDS:
        first, last = DEVELOPMENT_SEEDS[0], DEVELOPMENT_SEEDS[-1]
        raise InputError(f"seed {development} should be one for development, {first} to {last}")
    return Proof(f"development-{development}", development, None, quick, sizes, folders)


def prove_tiers(proof: Proof, tiers: Sequence[TierName], work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Makes, seals, diagnoses and scores the sets of some tiers; yields the lines that report it.

    Raises InputError for a kind of cases that none of them has.
    """
    kinds = {kind for tier in tiers for kind in JUDGED[tier]}
    for kind in proof.sizes:
        if kind not in kinds:
            raise InputError(f"--size {kind}: cases of the tiers {', '.join(tiers)} are {', '.join(sorted(kinds))}")
    for tier in tiers:
        yield f"tier {tier}"
        folder = work / tier
        if proof.commit is None and (folder / FINISHED_MARK).is_file():
            shutil.rmtree(folder)  # a finished proof that is not judged starts again from nothing
        yield from _prove_tier(proof, tier, folder, results, jobs)
        if folder.is_dir():  # a tier that was skipped has none
            (folder / FINISHED_MARK).touch()
        if proof.commit is not None and (results / LOG_FILE).is_file():  # other folders than the judged one have no log
            yield f"wrote {write_summary(results)}"


def _prove_tier(proof: Proof, tier: TierName, work: Path, results: Path, jobs: int) -> Iterator[str]:
    sizes, seed, folder, commit = proof.sizes_of(tier), proof.seed, results / tier, proof.commit
    match tier:
        case "torque":
            return prove_torque(torque_sets(seed, **sizes), work, results, jobs, commit)
        case "setup":
            return SETUP.prove(SetupSet(**sizes, seed=seed, folders=proof.folders), work, folder, jobs, commit)
        case "motion":
            return MOTION.prove(MotionSet(**sizes, seed=seed), work, folder, jobs, commit)
        case "real":
            recordings = (*(QUICK_RECORDINGS if proof.quick else PUBLIC), *proof.folders)
            return prove_real(RealSet(recordings, **sizes, seed=seed), work, folder, jobs, commit)
        case "changes":
            return CHANGES.prove(PairSet(**sizes, seed=seed), work, folder, jobs, commit)
        case "field":
            return FIELD_TIER.prove(FieldSet(**sizes, seed=seed), work, folder, jobs, commit)
