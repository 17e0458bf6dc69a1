"""The judge of random cases, on findings that are made up."""

from dataclasses import replace

from armlab.diagnosis.result import Weighed, WeighedName
from armlab.proof.open.real_concealed.at_random import RandomStudy, random_tables
from armlab.proof.open.real_concealed.claims import (
    DrawnVerdict,
    LabelledFinding,
    judge_drawn,
    label_weighed,
    with_own_findings,
)
from armlab.proof.open.real_concealed.conceal import SoughtEffect
from armlab.proof.open.real_concealed.concealed_case import Case, Disturbance
from armlab.proof.open.real_concealed.draw import DrawnCase
from armlab.proof.open.real_concealed.examine import (
    ExaminedCase,
    ParameterSize,
    PossibleName,
    ReportedFinding,
    RivalName,
)

SPRING = SoughtEffect("spring at joint 2", ("cable_stiffness",), (2,), {}, ("gravity_compensator",))
CASE = DrawnCase(Case("told", (), Disturbance("cable_stiffness", 2, 2.0, "N m/rad")), 3.5)


def _said(
    effect: str, *joints: int, chance: float | None = 0.9, members: tuple[PossibleName, ...] = ()
) -> ReportedFinding:
    rivals = tuple(RivalName(each.effect, each.joints) for each in members if each.effect not in (effect, "unknown"))
    return ReportedFinding(effect, joints, "", (), rivals, chance, members)


def _sized(effect: str, size: float, *joints: int) -> ReportedFinding:
    return ReportedFinding(effect, joints, "", (ParameterSize("a", size, (size - 0.2, size + 0.2), ""),), ())


def _judged(
    *said: ReportedFinding, sought: SoughtEffect = SPRING, control: tuple[ReportedFinding, ...] = (), joints: int = 3
) -> DrawnVerdict:
    def outcome(findings: tuple[ReportedFinding, ...]) -> ExaminedCase:
        return ExaminedCase("told", findings, 0.1)

    return judge_drawn(CASE, outcome(said), (sought,), outcome(control), joints)


def _weighed(*names: str) -> Weighed:
    return tuple(WeighedName(each, 2, (2,), {f"is {each}": 1.0}) for each in (*names, "unknown"))


def _labels(*weighed: Weighed, control: tuple[ReportedFinding, ...] = ()) -> list[LabelledFinding]:
    outcome = ExaminedCase("told", (), 0.1, weighed=weighed)
    return list(label_weighed(outcome, (SPRING,), replace(outcome, findings=control), 3))


def _verdicts(*said: ReportedFinding) -> list[str]:
    return [each.verdict for each in _judged(*said).claims]


def _answer(*said: ReportedFinding, control: tuple[ReportedFinding, ...] = ()) -> str:
    return _judged(*said, control=control).parts[0].answer


def _names(*effects: str) -> tuple[PossibleName, ...]:
    return tuple(PossibleName(each, (2,), 0.9 / len(effects)) for each in effects)


def test_a_claim_is_right_in_its_class_unknown_or_wrong() -> None:
    in_class = _said("torque_ripple", 2, members=_names("torque_ripple", "cable_stiffness"))
    too_many = _names("torque_ripple", "backlash", "rotor_inertia", "torque_offset", "cable_stiffness")
    assert _verdicts(_said("cable_stiffness", 2)) == ["right"]
    assert _verdicts(_said("gravity_compensator", 2)) == ["right"]
    assert _verdicts(in_class) == ["class"]
    assert _verdicts(_said("torque_ripple", 2, members=too_many)) == ["wrong"]
    assert _verdicts(_said("torque_ripple", 2)) == ["wrong"]
    assert _verdicts(_said("cable_stiffness", 1)) == ["wrong"]
    assert _verdicts(_said("unknown", 2, members=_names("unknown", "cable_stiffness"))) == ["unknown"]


def test_each_answer_to_what_is_sought_has_its_word() -> None:
    in_class = _said("torque_ripple", 2, members=_names("torque_ripple", "cable_stiffness"))
    assert _answer(_said("torque_ripple", 2), _said("cable_stiffness", 2)) == "named"
    assert _answer(in_class) == "class"
    assert _answer(_said("unknown", 2)) == "unknown"
    assert _answer(_said("unknown", 2), _said("torque_ripple", 2)) == "another name"
    assert _answer(_said("cable_stiffness", 1)) == "another name"
    assert _answer(_said("unknown", 3), _said("torque_ripple", 3)) == "missed"


def test_what_the_control_claims_as_well_is_not_new() -> None:
    control = (_said("torque_ripple", 1), _said("unknown", 3))
    assert _judged(*control, _said("cable_stiffness", 2), control=control).parts[0].answer == "named"
    assert [each.finding.effect for each in _judged(*control, control=control).claims] == []


def test_a_law_of_the_control_that_holds_what_is_sought_absorbs_it() -> None:
    wear = SoughtEffect("more friction", ("viscous_friction",), (2,), {})
    control = (_sized("asymmetric_friction", 1.0, 2),)
    grown = _judged(_sized("asymmetric_friction", 3.0, 2), sought=wear, control=control)
    assert grown.parts[0].answer == "absorbed"
    assert grown.claims == ()
    same = _judged(_sized("asymmetric_friction", 1.1, 2), sought=wear, control=control)
    assert same.parts[0].answer == "missed"


def test_another_law_of_withheld_friction_is_neither_right_nor_wrong() -> None:
    friction = SoughtEffect("friction", ("coulomb_friction",), (2,), {}, (), ("asymmetric_friction",))
    verdict = _judged(_said("asymmetric_friction", 2), sought=friction)
    assert [each.verdict for each in verdict.claims] == ["law"]
    assert verdict.parts[0].answer == "law"


def test_the_only_joint_cannot_tell_its_skew_from_a_delay_and_states_both_as_one() -> None:
    late = SoughtEffect("late", ("time_delay",), (), {}, ("channel_skew",))
    names = (PossibleName("channel_skew", (1,), 0.7), PossibleName("time_delay", (), 0.2))
    (claim,) = _judged(_said("channel_skew", 1, chance=0.7, members=names), sought=late, joints=1).claims
    assert (claim.verdict, claim.class_size) == ("right", 1)
    assert claim.probability is not None
    assert abs(claim.probability - 0.9) < 1e-9


def test_tables_have_a_row_for_each_thing_sought_and_each_new_claim() -> None:
    verdict = _judged(_said("torque_ripple", 2), _said("unknown", 1, chance=None))
    texts = random_tables([RandomStudy("told", "as told", verdict.outcome, (verdict,), ((),))])
    cases, claims = texts["cases.csv"], texts["claims.csv"]
    assert cases.splitlines()[1].startswith("told,1,injected,cable stiffness,spring of 2 N m/rad at joint 2,")
    assert "another name" in cases
    assert len(claims.splitlines()) == 3
    assert claims.splitlines()[1].endswith("wrong,1,0.9")
    assert claims.splitlines()[2].endswith("unknown,1,")


def test_a_weighed_name_is_right_where_it_is_sought_and_none_is_where_it_is_not() -> None:
    sought, other = _labels(_weighed("torque_ripple", "cable_stiffness"), _weighed("torque_ripple", "backlash"))
    assert (sought.right, other.right) == ((False, True, False), (False, False, True))
    assert sought.numbers[0] == {"is torque_ripple": 1.0}
    assert not sought.background
    assert not other.background


def test_nobody_knows_whether_what_the_control_names_is_right() -> None:
    (known,) = _labels(_weighed("torque_ripple", "backlash"), control=(_said("torque_ripple", 2),))
    assert known.background
    assert not any(known.right)
    (sought,) = _labels(_weighed("cable_stiffness"), control=(_said("cable_stiffness", 2),))
    assert sought.right == (True, False)


def test_what_half_of_the_cases_name_is_of_the_arm_though_the_control_misses_it() -> None:
    """Each case conceals something else; what is concealed in a case does not count there."""
    friction, ripple, spring = _said("coulomb_friction", 1), _said("torque_ripple", 3), _said("cable_stiffness", 2)
    said = [(friction, ripple), (spring,), (friction, spring), (spring, _said("unknown", 3))]
    cases = [(ExaminedCase(str(at), each, 0.1), (SPRING,) if at else ()) for at, each in enumerate(said)]
    own = with_own_findings(ExaminedCase("control", (ripple,), 0.1), cases, 3)
    assert own.findings == (ripple, friction)
