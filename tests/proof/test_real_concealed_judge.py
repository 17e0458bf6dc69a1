"""The judge of concealed cases, on findings that are made up."""

from armlab.proof.open.real_concealed.conceal import SoughtEffect
from armlab.proof.open.real_concealed.examine import ExaminedCase, ParameterSize, ReportedFinding, RivalName
from armlab.proof.open.real_concealed.fixed_plan import Case, Disturbance
from armlab.proof.open.real_concealed.judge import Answer, CaseVerdict, judge_case

LOAD = SoughtEffect(
    "payload of 2 kg at link 3",
    ("payload",),
    (3,),
    {"payload": {"mass": (2.0, None)}},
    ("inertial_parameter_error",),
)
CASE = Case("told", (), Disturbance("payload", 3, 2.0, "kg"))


def _said(
    effect: str, *joints: int, size: float = 1.0, rivals: tuple[RivalName, ...] = (), name: str = "mass"
) -> ReportedFinding:
    return ReportedFinding(effect, joints, "", (ParameterSize(name, size, (size - 0.2, size + 0.2), "kg"),), rivals)


def _outcome(*said: ReportedFinding, joints: int = 3, given: float = 3.0, found: float = 1.0) -> ExaminedCase:
    every = (given,) * joints
    hidden = (0.5, 4.0, 0.5)[:joints]
    return ExaminedCase("told", said, every, (found,) * joints, hidden, (9.0,) * joints, 1.0, 0.1)


def _verdict(
    *said: ReportedFinding, control: tuple[ReportedFinding, ...] = (), sought: SoughtEffect = LOAD, joints: int = 3
) -> CaseVerdict:
    nothing = _outcome(*control, joints=joints, given=2.0)
    return judge_case(CASE, _outcome(*said, joints=joints), (sought,), nothing)


def _answer(*said: ReportedFinding) -> Answer:
    return _verdict(*said).parts[0].answer


def test_each_answer_has_its_word() -> None:
    class_of_two = (RivalName("payload", (3,)),)
    assert _answer(_said("payload", 3)) == "named"
    assert _answer(_said("inertial_parameter_error", 3)) == "identical"
    assert _answer(_said("rotor_inertia", 3, rivals=class_of_two)) == "class"
    assert _answer(_said("rotor_inertia", 3, rivals=class_of_two * 4)) == "missed"
    assert _answer(_said("payload", 2)) == "elsewhere"
    assert _answer(_said("viscous_friction", 3)) == "missed"


def test_findings_of_the_control_are_no_others_and_wrong_places_are_not_counted_twice() -> None:
    control = (_said("viscous_friction", 1),)
    verdict = _verdict(*control, _said("payload", 2), _said("backlash", 2), control=control)
    assert [each.effect for each in verdict.others] == ["backlash"]


def test_what_the_control_says_as_well_is_no_answer_and_is_taken_off_where_it_is_less() -> None:
    control = (_said("payload", 3, size=0.5),)
    assert _verdict(_said("payload", 3, size=0.6), control=control).parts[0].answer == "missed"
    (judged,) = _verdict(_said("payload", 3, size=2.4), control=control).parts
    (held,) = judged.numbers
    assert held.size.value == 2.4 - 0.5
    assert held.holds


def test_the_only_joint_cannot_tell_its_skew_from_a_delay_of_all() -> None:
    late = SoughtEffect("late", ("time_delay",), (), {"time_delay": {"seconds": (1.0, None)}}, ("channel_skew",))
    control = (_said("channel_skew", 1, size=-0.5, name="seconds"),)
    verdict = _verdict(_said("time_delay", size=0.4, name="seconds"), control=control, sought=late, joints=1)
    (judged,) = verdict.parts
    assert judged.answer == "named"
    assert judged.numbers[0].size.value == 0.9
    assert judged.numbers[0].holds


def test_numbers_are_not_judged_where_other_laws_were_found_than_were_withheld() -> None:
    laws = {"coulomb_friction": {"level": (1.0, None)}, "viscous_friction": {"coefficient": (1.0, None)}}
    friction = SoughtEffect("friction, joint 2", tuple(laws), (2,), laws)
    level = _said("coulomb_friction", 2, size=5.0, name="level")
    both = (level, _said("viscous_friction", 2, size=1.0, name="coefficient"))
    assert [each.holds for each in _verdict(level, sought=friction).parts[0].numbers] == [None]
    assert [each.holds for each in _verdict(*both, sought=friction).parts[0].numbers] == [False, True]


def test_the_gap_is_that_of_the_joint_where_it_shows_most() -> None:
    verdict = _verdict(_said("payload", 3))
    assert verdict.joint_shown == 2
    assert verdict.strength == 4.0 / 2.0
    assert verdict.gap == (3.0 - 1.0) / (3.0 - 1.0)


def test_a_disturbance_that_cancels_what_the_control_names_is_counted_apart() -> None:
    late = SoughtEffect("late", ("time_delay",), (), {"time_delay": {"seconds": (2.0, None)}})
    control = (_said("time_delay", size=-1.7, name="seconds"),)
    assert _verdict(control=control, sought=late).parts[0].answer == "cancelled"
    more = SoughtEffect("late", ("time_delay",), (), {"time_delay": {"seconds": (5.0, None)}})
    assert _verdict(control=control, sought=more).parts[0].answer == "missed"


def test_another_law_of_friction_is_an_answer_of_its_own_and_further_laws_are_no_others() -> None:
    friction = SoughtEffect("friction, joint 2", ("coulomb_friction",), (2,), {}, (), ("viscous_friction",))
    assert _verdict(_said("viscous_friction", 2), sought=friction).parts[0].answer == "law"
    verdict = _verdict(_said("coulomb_friction", 2), _said("viscous_friction", 2), sought=friction)
    assert verdict.parts[0].answer == "named"
    assert [each.effect for each in verdict.laws] == ["viscous_friction"]
    assert verdict.others == ()
    assert len(_verdict(_said("coulomb_friction", 2), _said("viscous_friction", 1), sought=friction).others) == 1
