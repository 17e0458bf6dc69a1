"""Verdicts held against facts: literal cases, and an independent program on random verdicts."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml

from armlab.common.errors import InputError
from armlab.common.settings import validate
from armlab.proof.open.real_folders.facts import FactsFile, PairFacts, SingleFacts, read_facts
from armlab.proof.open.real_folders.facts_score import FolderScore, score_missing, score_pair, score_single
from armlab.proof.open.real_folders.stated_names import FACT_RANKS, ToldVerdict
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_copies

GROUPS = {"friction": ["coulomb_friction", "viscous_friction", "friction_curve"], "links": ["payload"]}
STRONG_FRICTION = {"effect": ["friction"], "joint": 2, "speed": 0.5, "torque": [2.0, 4.0], "strong": True}


def finding(effect: str, joint: int | None, probability: float | None = None, **keys: Any) -> dict[str, Any]:
    """A finding with one number, if any: `level=3.0`."""
    numbers = {key: {"value": keys.pop(key), "ci95": None, "unit": ""} for key in ("level", "mass") if key in keys}
    return {"effect": effect, "joint": joint, "probability": probability, "parameters": numbers, **keys}


def judge(known: dict[str, Any], *findings: dict[str, Any], **verdict: Any) -> FolderScore:
    """The score of a verdict of one recording."""
    file = validate(FactsFile, {"schema": "facts/1", "groups": GROUPS, "singles": {"arm": known}}, "facts")
    content = {"status": "mismatch", "summary": "One. Two.", "findings": list(findings), **verdict}
    return score_single(file.singles["arm"], validate(ToldVerdict, content, "verdict"), file)


def judge_pair(known: dict[str, Any], *findings: dict[str, Any], **verdict: Any) -> FolderScore:
    """The score of a comparison."""
    file = validate(FactsFile, {"schema": "facts/1", "groups": GROUPS, "pairs": {"arm": known}}, "facts")
    content = {"status": "changed", "findings": list(findings), **verdict}
    return score_pair(file.pairs["arm"], validate(ToldVerdict, content, "verdict"), file)


@pytest.mark.parametrize(
    ("told", "rank"),
    [
        (finding("coulomb_friction", 2, level=3.0), "named"),
        (finding("coulomb_friction", 2, 0.95, level=3.0), "named"),
        (
            finding(
                "coulomb_friction",
                2,
                0.6,
                level=3.0,
                **{
                    "class": [
                        {"effect": "coulomb_friction", "joint": 2, "probability": 0.6},
                        {"effect": "friction_curve", "joint": 2, "probability": 0.35},
                    ]
                },
            ),
            "class",
        ),
        (finding("coulomb_friction", 2, 0.6, level=3.0), "cause"),
        (finding("coulomb_friction", 2, 0.99, level=3.0, minor=True), "minor"),
        (finding("coulomb_friction", 1, 0.99, level=3.0), "missed"),
    ],
)
def test_a_fact_is_told_by_name_by_class_as_a_cause_or_not(told: dict[str, Any], rank: str) -> None:
    score = judge({"known": [STRONG_FRICTION]}, told)
    assert [each.rank for each in score.facts] == [rank]
    assert bool(score.wrong) == (rank in ("minor", "missed"))


def test_what_is_less_probable_than_a_half_counts_as_below_and_finds_no_fact() -> None:
    score = judge({"known": [STRONG_FRICTION]}, finding("coulomb_friction", 2, 0.4, level=3.0))
    assert (score.facts[0].rank, score.below, score.extra) == ("missed", ("coulomb_friction@2",), ())


def test_all_friction_of_a_joint_together_has_to_lie_in_the_known_range() -> None:
    viscous = finding("viscous_friction", 2) | {"parameters": {"coefficient": {"value": 4.0, "ci95": None, "unit": ""}}}
    assert judge({"known": [STRONG_FRICTION]}, viscous).wrong == ()  # 4 N m s/rad at 0.5 rad/s
    both = judge({"known": [STRONG_FRICTION]}, viscous, finding("coulomb_friction", 2, level=2.5))
    assert both.wrong == ("friction@2 4.5 at 0.5, known 2 to 4",)


def test_what_is_neither_known_nor_allowed_is_extra_and_what_contradicts_is_wrong() -> None:
    known = {"allowed": [{"effect": ["friction"], "joints": [1]}], "never": ["payload"]}
    told = [finding("coulomb_friction", 1), finding("coulomb_friction", 2), finding("payload", 2, mass=1.0)]
    score = judge(known, *told)
    assert (score.extra, score.wrong) == (("coulomb_friction@2",), ("never payload@2",))
    assert (score.words, score.causes, score.told) == (2, 2, 3)


def test_reading_mistakes_are_wrong_unless_they_are_fair_at_that_joint() -> None:
    mistake = finding("unit_error", 1, kind="setup")
    summary = "The recording is read wrongly."
    assert judge({}, mistake, summary=summary).wrong == ("read wrongly: unit_error@1", "doubt in the summary")
    assert judge({"setup": [{"effect": "unit_error", "joints": [1, 2]}]}, mistake, summary=summary).wrong == ()
    assert judge({"setup": [{"effect": "unit_error", "joints": [2]}]}, mistake).wrong == ("read wrongly: unit_error@1",)


def test_an_inconclusive_verdict_is_wrong_unless_abstaining_is_right() -> None:
    assert judge({"known": [STRONG_FRICTION]}, status="inconclusive").wrong == ("missed friction@2", "inconclusive")
    assert judge({"known": [STRONG_FRICTION], "abstain": True}, status="inconclusive").wrong == ()


def test_a_change_needs_a_name_and_a_size_that_touches_the_known_factor() -> None:
    known = {"changed": [{"effect": ["links"], "joint": 1, "factor": [2.0, 3.0], "errors": 9}]}
    row = {"effect": "payload", "joint": 1, "old": 1.0, "new": 2.5, "changed": True}
    right = judge_pair(known, finding("payload", 1), changes=[row])
    assert (right.facts[0].rank, right.facts[0].size_right, right.wrong) == ("named", True, ())
    large = judge_pair(known, finding("payload", 1), changes=[row | {"new": 5.0}])
    assert large.wrong == ("no size inside 2 to 3",)
    wide = judge_pair(known, finding("payload", 1), changes=[row | {"difference_ci95": [0.0, 3.0]}])
    assert wide.wrong == ("no size inside 2 to 3",)
    assert right.facts[0].width is None
    assert wide.facts[0].width == pytest.approx(9 * 3.0 / 1.5 / (2 * 1.96), rel=1e-3)
    assert judge_pair(known, status="same").wrong == ("missed, at 9 standard errors",)
    assert judge_pair(known | {"same_is_fair": True}, status="same").wrong == ()


def test_any_change_is_wrong_where_nothing_changed() -> None:
    assert judge_pair({}, finding("payload", 1)).wrong == ("nothing changed: payload@1",)
    assert judge_pair({}, finding("payload", 1, 0.4)).wrong == ()
    assert judge_pair({}).wrong == ("nothing changed: status",)


def test_a_folder_without_a_verdict_misses_every_fact() -> None:
    score = score_missing(validate(SingleFacts, {"known": [STRONG_FRICTION]}, "facts"))
    assert (score.count("missed", strong=True), score.wrong) == (1, ("no verdict",))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"singles": {"a": {"known": [{"effect": ["coulomb"], "joint": 1}]}}}, "unknown effect 'coulomb' in"),
        ({"singles": {"a": {"know": []}}}, "did you mean 'known'?"),
        ({"singles": {"a": {"known": [{"effect": ["payload"], "joint": 0}]}}}, "singles.a.known[0].joint"),
        ({"singles": {"a": {"setup": [{"effect": "payload"}]}}}, "singles.a.setup"),
        ({"singles": {"a": {"known": [{"effect": ["payload"], "joint": 1, "speed": 1.0}]}}}, "speed and torque"),
        ({"pairs": {"a": {"changed": [{"effect": ["payload"], "joint": 1, "errors": 3}]}}}, "factor or difference"),
        ({"singles": {"a": {}}, "pairs": {"a": {}}}, "stands under singles and under pairs"),
        ({"schema": "facts/2"}, "'schema' should be facts/1"),
    ],
)
def test_facts_with_mistakes_are_refused_in_one_line(tmp_path: Path, content: dict[str, Any], message: str) -> None:
    path = tmp_path / "facts.yaml"
    path.write_text(yaml.safe_dump({"schema": "facts/1", **content}))
    with pytest.raises(InputError) as caught:
        read_facts(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_example_of_the_documentation_is_a_facts_file(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "recordings.md").read_text()
    (tmp_path / "facts.yaml").write_text(page[page.index("schema: facts/1\n") :].partition("```")[0])
    facts = read_facts(tmp_path / "facts.yaml")
    assert (len(facts.singles), len(facts.pairs)) == (1, 1)


def _other_program() -> Path | None:
    folder = local_copies()
    return folder / "score_facts.py" if folder and (folder / "score_facts.py").is_file() else None


def _load(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("score_facts", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def random_verdict(rng: np.random.Generator, effects: list[str], pair: bool) -> dict[str, Any]:
    """A verdict with findings of all kinds, changes and intervals."""
    findings = [_random_finding(rng, effects) for _ in range(rng.integers(0, 7))]
    summary = rng.choice(
        ["Nothing is read wrongly.", "It may be read so.", "A unit is read wrongly.", "Four words are here."]
    )
    status = rng.choice(["changed", "same", "inconclusive"] if pair else ["mismatch", "none", "inconclusive"])
    changes = [_random_change(rng, [*effects, "base_parameter"]) for _ in range(rng.integers(0, 4))]
    rows = [{"joint": 1, "speeds": [0.1, 1.0], "torque": [0.5, 4.0]}] if rng.random() < 0.2 else []
    content = {"status": str(status), "summary": str(summary), "findings": findings}
    return content | ({"changes": changes} if pair else {"friction": rows})


def _random_finding(rng: np.random.Generator, effects: list[str]) -> dict[str, Any]:
    effect, joint = str(rng.choice(effects)), int(rng.integers(1, 8))
    setup = rng.random() < 0.15
    names = ["level", "positive", "negative", "coefficient", "exponent", "mass", "gain", "offset", "inertia", "factor"]
    numbers = {}
    for name in rng.choice(names, rng.integers(0, 5), replace=False):
        value = float(rng.normal(0, 3))
        interval = [value - 0.3, value + 0.3] if rng.random() < 0.5 else None
        numbers[str(name)] = {"value": value, "ci95": interval, "unit": ""}
    shares = rng.dirichlet(np.ones(3))
    members = [
        {"effect": str(rng.choice([effect, *effects])), "joint": joint, "probability": float(share)} for share in shares
    ]
    return {
        "effect": str(rng.choice(["unit_error", "clock_error"])) if setup else effect,
        "kind": "setup" if setup else "physics",
        "joint": joint if rng.random() < 0.9 else None,
        "joints": [joint] if rng.random() < 0.5 else [],
        "probability": float(rng.random()) if rng.random() < 0.7 else None,
        "class": members if rng.random() < 0.6 else None,
        "minor": bool(rng.random() < 0.1),
        "parameters": numbers,
    }


def _random_change(rng: np.random.Generator, effects: list[str]) -> dict[str, Any]:
    old, new = rng.normal(1, 1, 2).tolist()
    return {
        "effect": str(rng.choice(effects)),
        "joint": int(rng.integers(1, 3)),
        "old": old if rng.random() < 0.8 else None,
        "new": new,
        "ratio": float(rng.uniform(0.5, 3)) if rng.random() < 0.3 else None,
        "difference_ci95": sorted(rng.normal(0, 0.5, 2).tolist()) if rng.random() < 0.7 else None,
        "changed": bool(rng.random() < 0.7),
    }


@pytest.mark.skipif(_other_program() is None, reason=f"{LOCAL_COPIES_VARIABLE} names no folder with score_facts.py")
@pytest.mark.parametrize("seed", range(20))
def test_another_program_scores_random_verdicts_alike(seed: int) -> None:
    program = _other_program()
    assert program is not None
    module, raw = _load(program), yaml.safe_load(program.with_name("facts.yaml").read_text())
    file, rng = read_facts(program.with_name("facts.yaml")), np.random.default_rng(seed)
    groups = raw["groups"]
    effects = sorted(
        {*(each for names in groups.values() for each in names), "backlash", "torque_offset", "time_delay"}
    )
    for name, known in (*raw["singles"].items(), *raw["pairs"].items()):
        facts = file.of(name)
        content = random_verdict(rng, effects, isinstance(facts, PairFacts))
        verdict = validate(ToldVerdict, json.loads(json.dumps(content)), "verdict")
        if isinstance(facts, PairFacts):
            theirs, ours = module.pair(known, content, groups), score_pair(facts, verdict, file)
            assert theirs["factor"] == sum(bool(each.size_right) for each in ours.facts), name
        else:
            assert facts is not None
            theirs, ours = module.single(known, content, groups), score_single(facts, verdict, file)
            assert [theirs[f"strong {rank}"] for rank in FACT_RANKS] == [ours.count(rank, True) for rank in FACT_RANKS]
            assert (theirs["words"], theirs["causes"], theirs["told"]) == (ours.words, ours.causes, ours.told), name
            assert theirs["below"] == list(ours.below), name
        assert [theirs[rank] for rank in FACT_RANKS] == [ours.count(rank) for rank in FACT_RANKS], name
        assert theirs["extra"] == list(ours.extra), name
        assert len(theirs["wrong"]) == len(ours.wrong), (name, theirs["wrong"], ours.wrong)
