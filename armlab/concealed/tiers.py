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

from armlab.concealed.log_page import LOG_FILE
from armlab.concealed.prove import FINISHED_MARK, QUICK_NAME, QUICK_SEED, Proof, judged_seed, prove
from armlab.concealed.real.prove import RealSet, prove_real
from armlab.concealed.servo.prove import MotionSet, prove_motion
from armlab.concealed.setup.plan import PUBLIC
from armlab.concealed.setup.prove import SetupSet, prove_setup
from armlab.concealed.summary_page import write_summary

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
        if tier == "torque":
            yield from prove(proof, folder, results, jobs)
        else:
            if proof.commit is None and (folder / FINISHED_MARK).is_file():
                shutil.rmtree(folder)  # as for torque: a finished proof that is not judged starts again from nothing
            yield from _prove_other(proof, tier, folder, results / tier, jobs)
            if folder.is_dir():  # a tier that was skipped has none
                (folder / FINISHED_MARK).touch()
        if proof.commit is not None and (results / LOG_FILE).is_file():  # other folders than the judged one have no log
            yield f"wrote {write_summary(results)}"


def _prove_other(proof: Proof, tier: TierName, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """A tier whose cases are no torque sets; a proof for development has as many of them as one for a quick look."""
    judged = proof.commit is not None
    seed = judged_seed(proof.commit) if proof.commit else _development_seed(proof)
    if tier == "setup":
        return prove_setup(SetupSet(*(JUDGED_SETUP if judged else QUICK_SETUP), seed), work, results, jobs)
    if tier == "real":
        recordings, cases = JUDGED_REAL if judged else QUICK_REAL
        return prove_real(RealSet(recordings, cases, seed), work, results, jobs, proof.commit)
    return prove_motion(MotionSet(*(JUDGED_MOTION if judged else QUICK_MOTION), seed), work, results, jobs)


def _development_seed(proof: Proof) -> int:
    return QUICK_SEED if proof.name == QUICK_NAME else next(iter(proof.sets.values())).seed
