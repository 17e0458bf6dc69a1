"""The torque tier: sets of recordings with torque, and a proof, which judges a set of mixed cases and one of nulls."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from armlab.common.errors import InputError
from armlab.proof.blind.case_files import write_case
from armlab.proof.blind.formats import SetKind, SetManifest, SetTier, Tier
from armlab.proof.blind.log_page import LOG_FILE
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS, PLAN, Plan, draw_plan
from armlab.proof.blind.score.scoring import format_lines, score_set
from armlab.proof.blind.sealed import OBSERVATION, TRUTH_FILE, VERDICTS, Score, SealedTier, code_commit, judged_seed
from armlab.proof.blind.sizing import simulate_case

QUICK_NAME, QUICK_SEED, QUICK_CASES = "quick", 1900, 24
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

    def plans(self) -> Iterator[Plan]:
        """The plans of all cases."""
        return (self.plan(number) for number in range(self.cases))


def make_set_settings(cases: int, seed: int, tier: SetTier, kind: SetKind, development: bool) -> SetSettings:
    """The settings of a set; seeds 1000-1999 always make development sets."""
    return SetSettings(cases, seed, tier, kind, development or seed in DEVELOPMENT_SEEDS)


def _make(plan: Plan, draft: Path) -> None:
    write_case(simulate_case(plan), draft / OBSERVATION, draft / TRUTH_FILE)


def _question(_: Plan, observation: Path) -> list[str]:
    return ["diagnose", str(observation)]


def _judge(_: SetSettings, work: Path, results: Path) -> Score:
    found = score_set(work, work / VERDICTS, None, results)
    return Score(format_lines(found), found["cases"], found["tiers"])


TORQUE = SealedTier("torque", SetSettings.plans, _make, _question, _judge, SetManifest)


@dataclass(frozen=True)
class Proof:
    """The torque sets of one proof, and its name. commit: of the source tree, None for a proof that is not judged."""

    sets: dict[str, SetSettings]
    name: str
    commit: str | None = None


def choose_proof(quick: bool, development: int | None, cases: int, nulls: int) -> Proof:
    """The quick proof, a small development set that is always the same; one on a development seed; or the judged one,
    whose seed follows from the commit, so that nobody could tune on it before the commit existed.
    """
    if quick:
        return Proof({"quick": SetSettings(QUICK_CASES, QUICK_SEED, development=True)}, QUICK_NAME)
    if development is not None:
        return make_development_proof(development, cases, nulls)
    commit = code_commit()
    return Proof(_choose_sets(judged_seed(commit), cases, nulls, development=False), commit, commit)


def make_development_proof(seed: int, cases: int, nulls: int) -> Proof:
    """Sets for development, which are not logged; InputError for a seed that is not for development."""
    if seed not in DEVELOPMENT_SEEDS:
        raise InputError(
            f"seed {seed} should be one for development, {DEVELOPMENT_SEEDS[0]} to {DEVELOPMENT_SEEDS[-1]}"
        )
    return Proof(_choose_sets(seed, cases, nulls, development=True), f"development-{seed}")


def _choose_sets(seed: int, cases: int, nulls: int, development: bool) -> dict[str, SetSettings]:
    sizes: tuple[tuple[SetKind, int], ...] = (("mixed", cases), ("nulls", nulls))
    return {kind: SetSettings(count, seed, kind=kind, development=development) for kind, count in sizes if count}


def prove_torque(proof: Proof, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Proves each torque set of a proof; yields the lines that report it. InputError if `work` holds another proof.

    work, results: folders of sets and of scores, with one folder a set; the log of judged runs stands in `results`.
    """
    for name, settings in proof.sets.items():
        yield f"{name}: {settings.cases} cases, seed {settings.seed}"
        log = results / LOG_FILE
        yield from replace(TORQUE, name=name).prove(settings, work / name, results / name, jobs, proof.commit, log)
