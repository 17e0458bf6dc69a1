"""The whole proof, tier by tier: torque (clean and realistic, two engines), how recordings are read, motion only, and
real recordings.

Each tier has a folder of its own, below that of the proof, and continues there after an interruption. A judged proof
has one seed for all of them, from the last commit that changed the code: results of one tier may be committed before
the next one is run.
"""

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, get_args

from armlab.proof.blind.log_page import LOG_FILE
from armlab.proof.blind.sealed import FINISHED_MARK, judged_seed
from armlab.proof.blind.setup.setup_plan import PUBLIC
from armlab.proof.tiers.motion import MOTION, MotionSet
from armlab.proof.tiers.reading import SETUP, SetupSet
from armlab.proof.tiers.real import RealSet, prove_real
from armlab.proof.tiers.summary_page import write_summary
from armlab.proof.tiers.torque import QUICK_NAME, QUICK_SEED, Proof, prove_torque

TierName = Literal["torque", "setup", "motion", "real"]
TIERS: tuple[TierName, ...] = get_args(TierName)
QUICK_SETUP, QUICK_MOTION = (6, 0, 4), (4, 4)  # cases of each source, of a quick proof
JUDGED_SETUP, JUDGED_MOTION = (300, 200, 300), (300, 300)
RealSize = tuple[tuple[str, ...], int]  # recordings, and random cases of each
QUICK_REAL: RealSize = ("emps", "staubli-tx40"), 1
JUDGED_REAL: RealSize = PUBLIC, 16


def prove_tiers(proof: Proof, tiers: Sequence[TierName], work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Makes, seals, diagnoses and scores the sets of some tiers; yields the lines that report it."""
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
    """One tier; but for torque, a proof for development has as many cases as one for a quick look."""
    judged, folder = proof.commit is not None, results / tier
    seed = judged_seed(proof.commit) if proof.commit else _development_seed(proof)
    if tier == "torque":
        return prove_torque(proof, work, results, jobs)
    if tier == "setup":
        setup = SetupSet(*(JUDGED_SETUP if judged else QUICK_SETUP), seed)
        return SETUP.prove(setup, work, folder, jobs, proof.commit)
    if tier == "real":
        return prove_real(RealSet(*(JUDGED_REAL if judged else QUICK_REAL), seed), work, folder, jobs, proof.commit)
    motion = MotionSet(*(JUDGED_MOTION if judged else QUICK_MOTION), seed)
    return MOTION.prove(motion, work, folder, jobs, proof.commit)


def _development_seed(proof: Proof) -> int:
    return QUICK_SEED if proof.name == QUICK_NAME else next(iter(proof.sets.values())).seed
