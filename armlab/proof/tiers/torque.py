"""The torque tier: sets of recordings with torque; a proof judges a set of mixed cases and one of nulls."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from armlab.proof.blind.case_files import write_case
from armlab.proof.blind.formats import SetKind, SetManifest, SetTier, Tier
from armlab.proof.blind.log_page import LOG_FILE
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS, PLAN, Plan, draw_plan
from armlab.proof.blind.score.scoring import format_lines, score_set
from armlab.proof.blind.sealed import OBSERVATION, TRUTH_FILE, VERDICTS, Score, SealedTier
from armlab.proof.blind.sizing import simulate_case

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


def torque_sets(seed: int, cases: int, nulls: int) -> dict[str, SetSettings]:
    """The sets of one proof by their names: of mixed cases and of nulls, where there are any."""
    sizes: tuple[tuple[SetKind, int], ...] = (("mixed", cases), ("nulls", nulls))
    return {kind: make_set_settings(count, seed, "both", kind, development=False) for kind, count in sizes if count}


def prove_torque(
    sets: Mapping[str, SetSettings], work: Path, results: Path, jobs: int, commit: str | None = None
) -> Iterator[str]:
    """Proves each torque set; yields the lines that report it. InputError if `work` holds other sets.

    work, results: folders of sets and of scores, with one folder a set; the log of judged runs stands in `results`.
    """
    for name, settings in sets.items():
        yield f"{name}: {settings.cases} cases, seed {settings.seed}"
        log = results / LOG_FILE
        yield from replace(TORQUE, name=name).prove(settings, work / name, results / name, jobs, commit, log)
