"""Names of findings with probabilities: the choice model, what is claimed, and what a reader is told."""

from dataclasses import replace

import numpy as np
import pytest

from armlab.common.errors import InputError
from armlab.diagnosis.choice import Example, Weights, fit_lapse, fit_weights, probabilities, with_lapse
from armlab.diagnosis.result import Claim, Rival, Weighed, WeighedName
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.names.decide import calibrated_weights, named_claims, naming_of, unknown_limit
from armlab.diagnosis.torque.names.findings import Statement, statement_of
from armlab.effects.drive import TorqueOffset
from armlab.effects.friction import CoulombFriction
from armlab.effects.friction_curve import FrictionCurve
from armlab.proof.open.calibration.calibrate import ExampleFinding, calibrate, judge_reliability


@pytest.fixture(autouse=True)
def plain_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    """One number, whose weight is one."""
    monkeypatch.setattr("armlab.diagnosis.torque.names.decide.calibrated_weights", lambda: Weights({"for it": 1.0}))


def weighed(unknown: float, **names: float) -> Weighed:
    """Names of joint 2 with these probabilities."""
    known = [WeighedName(name, 2, (2,), {"for it": float(np.log(chance))}) for name, chance in names.items()]
    return (*known, WeighedName("unknown", 2, (2,), {"for it": float(np.log(unknown))}))


def claim(effect: str, names: Weighed, rivals: tuple[Rival, ...] = ()) -> Claim:
    evidence = Evidence(1, 1e-9, 1e-8, 0.5, 1e-6, 0.5, 1.0, 0.5, 100.0)
    return Claim(effect, 2, (2,), (), "tau_2 += 1", evidence, np.ones((3, 2)), rivals, weighed=names)


def test_probabilities_sum_to_one_and_follow_what_speaks_for_a_name() -> None:
    found = probabilities([{"for it": 2.0}, {"for it": 0.0, "not asked": 9.0}, {}], Weights({"for it": 1.0}))
    assert found.sum() == pytest.approx(1)
    assert found[0] / found[1] == pytest.approx(np.exp(2))
    assert found[1] == found[2]


def test_weights_are_found_that_made_the_choices() -> None:
    rng, true = np.random.default_rng(0), {"one": 2.0, "other": -1.0}
    examples = []
    for _ in range(3000):
        names = tuple(dict(zip(true, rng.normal(size=2), strict=True)) for _ in range(3))
        chosen = rng.choice(3, p=probabilities(names, Weights(true)))
        examples.append(Example(names, tuple(at == chosen for at in range(3))))
    found = fit_weights(examples, dict.fromkeys(true, 0.0), dict.fromkeys(true, 2.0))
    assert found["one"] == pytest.approx(2.0, abs=0.15)
    assert found["other"] == pytest.approx(-1.0, abs=0.15)
    findings = [ExampleFinding(str(number % 50), "clean", each, False) for number, each in enumerate(examples)]
    calibration = calibrate(findings).tiers["clean"]
    assert all(low <= each.mean <= high for each in calibration.bins for low, high in [each.interval])
    assert calibration.brier[0] < calibration.brier[1]


def test_two_right_names_count_together() -> None:
    both = [Example(({"a": 1.0}, {"b": 1.0}, {"none": 1.0}), (True, True, False))] * 50
    found = fit_weights(both, {"a": 0.0, "b": 0.0, "none": 0.0}, {"a": 1.0, "b": 1.0, "none": 1.0})
    assert found["a"] == pytest.approx(found["b"])
    assert found["none"] < found["a"]


def test_reliability_is_of_the_likeliest_answer() -> None:
    found = judge_reliability([np.array([0.8, 0.2])] * 5, [(True, False)] * 4 + [(False, True)])
    assert [(each.findings, each.right, each.mean) for each in found.bins] == [(5, 4, pytest.approx(0.8))]


def test_a_probable_name_is_claimed_alone() -> None:
    names = weighed(0.03, coulomb_friction=0.95, viscous_friction=0.02)
    (found,) = named_claims([claim("coulomb_friction", names)], Settings())
    assert (found.effect, found.probability, found.members, found.rivals) == (
        "coulomb_friction",
        pytest.approx(0.95),
        (),
        (),
    )


def test_else_a_class_whose_probabilities_add_up() -> None:
    names = weighed(0.15, coulomb_friction=0.6, stribeck_friction=0.22, viscous_friction=0.03)
    (found,) = named_claims([claim("coulomb_friction", names)], Settings())
    assert found.probability == pytest.approx(0.6)
    assert [(each.effect, round(each.probability, 2)) for each in found.members] == [
        ("coulomb_friction", 0.6),
        ("stribeck_friction", 0.22),
        ("unknown", 0.15),
    ]
    assert [each.effect for each in found.rivals] == ["stribeck_friction"]


def test_else_it_is_unknown_with_a_probability_of_its_own() -> None:
    names = weighed(0.5, coulomb_friction=0.3, stribeck_friction=0.2)
    (found,) = named_claims([claim("coulomb_friction", names)], Settings())
    assert (found.effect, found.joint, found.probability) == ("unknown", 2, pytest.approx(0.5))
    assert [each.effect for each in found.members] == ["unknown", "coulomb_friction", "stribeck_friction"]
    assert found.candidate is None
    assert found.equation == "tau_2 += f(the motion)"


def test_a_name_that_is_not_of_the_class_of_its_finding_is_none() -> None:
    (found,) = named_claims([claim("channel_skew", weighed(0.04, early_friction=0.94, channel_skew=0.02))], Settings())
    assert (found.effect, found.probability) == ("unknown", pytest.approx(0.04))
    assert [each.effect for each in found.members] == ["early_friction"]


def test_friction_keeps_its_law_at_a_joint_of_whose_friction_the_simulation_says_nothing() -> None:
    names = weighed(0.5, coulomb_friction=0.3, stribeck_friction=0.2)
    own = replace(claim("coulomb_friction", names), candidate=CoulombFriction(2, (2,), (1,)))
    (found,) = named_claims([own], Settings(), plain={2})
    assert (found.effect, found.probability) == ("coulomb_friction", pytest.approx(0.3))
    assert [each.effect for each in found.members] == ["friction_curve", "coulomb_friction", "stribeck_friction"]
    likelier = replace(own, weighed=weighed(0.02, coulomb_friction=0.03, viscous_friction=0.95))
    (found,) = named_claims([likelier], Settings(), plain={2})
    assert (found.effect, [each.effect for each in found.members]) == ("coulomb_friction", ["viscous_friction"])
    other = replace(own, weighed=weighed(0.95, coulomb_friction=0.03, viscous_friction=0.02))
    (curve,) = named_claims([other], Settings(), plain={2})
    assert statement_of(curve) == Statement("name", ("friction_curve",), pytest.approx(0.95))
    assert curve.parameters == ()
    beside = [other, replace(own, effect="viscous_friction", weighed=weighed(0.05, viscous_friction=0.95))]
    kept = {each.effect: statement_of(each).kind for each in named_claims(beside, Settings(), plain={2})}
    assert kept == {"coulomb_friction": "nothing", "viscous_friction": "name"}
    unlikely = replace(own, weighed=weighed(0.6, coulomb_friction=0.25, stribeck_friction=0.15))
    (nameless,) = named_claims([unlikely], Settings(), plain={1})
    assert (nameless.effect, nameless.probability) == ("unknown", pytest.approx(0.6))


def test_friction_that_is_likelier_than_not_keeps_its_cause_where_no_law_is_sure() -> None:
    names = weighed(0.4, coulomb_friction=0.3, stribeck_friction=0.3)
    own = replace(claim("coulomb_friction", names), candidate=CoulombFriction(2, (2,), (1,)))
    (found,) = named_claims([own], Settings())
    assert statement_of(found) == Statement("cause", ("coulomb_friction",), pytest.approx(0.6))


def test_a_curve_of_friction_that_is_none_of_the_formulas_is_another_curve() -> None:
    names = weighed(0.5, friction_curve=0.3, nonlinear_viscous_friction=0.2)
    own = replace(claim("friction_curve", names), candidate=FrictionCurve(2, (2,), (1,)))
    (found,) = named_claims([own], Settings())
    assert (found.effect, found.probability) == ("friction_curve", pytest.approx(0.8))
    assert statement_of(found) == Statement(
        "class", ("friction_curve", "nonlinear_viscous_friction"), pytest.approx(1.0)
    )


def test_of_an_offset_that_every_arm_has_the_names_share_what_no_name_had() -> None:
    names = weighed(0.2, torque_offset=0.5, cable_stiffness=0.3)
    own = replace(claim("torque_offset", names), candidate=TorqueOffset(2, (2,), (1,)))
    (found,) = named_claims([own], Settings(), plain={2})
    assert found.probability == pytest.approx(0.625)
    assert statement_of(found).kind == "class"


def test_a_link_that_is_off_keeps_its_name_where_nothing_is_likelier() -> None:
    others = dict.fromkeys(("payload", "geometry_error", "encoder_offset"), 0.1)
    names = weighed(0.05, inertial_parameter_error=0.45, torque_offset=0.2, **others)
    link = replace(claim("inertial_parameter_error", names), in_links=True)
    (found,) = named_claims([link], Settings())
    assert (found.effect, found.probability) == ("inertial_parameter_error", pytest.approx(0.45))
    likelier = replace(link, weighed=weighed(0.3, inertial_parameter_error=0.3, torque_offset=0.4))
    (found,) = named_claims([likelier], Settings())
    assert found.effect == "unknown"


def test_a_law_without_a_name_is_a_finding_only_where_held_out_errors_fall() -> None:
    doubtful = claim("payload", weighed(0.4, payload=0.6))
    (found,) = named_claims([doubtful], Settings())
    assert found.effect == "unknown"
    small = replace(doubtful, evidence=replace(doubtful.evidence, rms_after=0.97))
    assert named_claims([small], Settings()) == ()
    structure = replace(small, effect="unknown")
    assert len(named_claims([structure], Settings())) == 1
    certain = replace(small, weighed=weighed(0.02, payload=0.98))
    assert [each.effect for each in named_claims([certain], Settings())] == ["payload"]


def test_more_than_three_names_are_no_class() -> None:
    assert len(naming_of(weighed(0.05, law_0=0.35, law_1=0.35, law_2=0.25), Settings()).claimed) == 3
    assert naming_of(weighed(0.06, **{f"law_{number}": 0.235 for number in range(4)}), Settings()).is_unknown


def test_a_class_that_may_be_none_of_its_names_is_unknown() -> None:
    assert len(naming_of(weighed(0.15, payload=0.85), Settings()).claimed) == 2
    assert naming_of(weighed(0.25, payload=0.75), Settings()).is_unknown


def test_no_finding_is_surer_to_have_no_name_than_such_findings_were_right() -> None:
    only = claim("unknown", weighed(1.0))
    (found,) = named_claims([only], Settings())
    assert (found.effect, found.probability) == ("unknown", unknown_limit())
    assert [(each.effect, each.probability) for each in found.members] == [("unknown", unknown_limit())]
    (found,) = named_claims([claim("coulomb_friction", weighed(0.8, coulomb_friction=0.2))], Settings())
    assert found.probability == unknown_limit()
    assert [round(each.probability, 2) for each in found.members] == [round(unknown_limit(), 2), 0.2]


def test_two_unknowns_of_a_joint_are_one_finding() -> None:
    names = weighed(0.6, coulomb_friction=0.4)
    other = replace(claim("unknown", weighed(0.5, coulomb_friction=0.5)), depends_on=("position_2",))
    (found,) = named_claims([claim("coulomb_friction", names), other], Settings())
    assert found.probability == pytest.approx(0.6)
    assert np.array_equal(found.prediction, 2 * np.ones((3, 2)))
    assert found.depends_on == ("position_2",)


def test_what_no_motion_separates_stays_beside_a_probable_name() -> None:
    same = Rival("rotor_inertia", 2, (2,), identical=True)
    names = weighed(0.03, payload=0.97)
    (found,) = named_claims([claim("payload", names, (same,))], Settings())
    assert found.rivals == (same,)
    assert found.next_experiment


def test_names_that_no_motion_separates_count_together() -> None:
    same = Rival("rotor_inertia", 2, (2,), identical=True)
    (found,) = named_claims([claim("payload", weighed(0.03, payload=0.3, rotor_inertia=0.67), (same,))], Settings())
    assert (found.effect, found.members, found.rivals) == ("payload", (), (same,))
    assert found.probability == pytest.approx(0.97)


def test_the_weights_of_the_package_were_learnt_from_development_sets() -> None:
    weights = calibrated_weights()
    assert {"found none", "structure none"} <= set(weights.numbers)
    assert all(np.isfinite(list(weights.numbers.values())))
    assert 0 < weights.lapse < 0.1


@pytest.mark.parametrize("recording", ["emps", "staubli-tx40", "unisa-ur10", "unisa-panda", "kuka-kr300"])
def test_a_real_recording_is_judged_by_weights_that_do_not_know_it(recording: str) -> None:
    own, others = calibrated_weights(recording), calibrated_weights()
    assert own.numbers.keys() == others.numbers.keys()
    assert own != others
    assert calibrated_weights("not in the calibration") == others


def test_the_cases_of_a_real_recording_are_left_out_together() -> None:
    speaks, against = Example(({"a": 1.0}, {}), (True, False)), Example(({"a": 1.0}, {}), (False, True))
    simulated = [ExampleFinding(str(number), "clean", speaks, False) for number in range(20)]
    real = [ExampleFinding(str(number), "real", against, False, "emps") for number in range(20)]
    found = calibrate([*simulated, *real])
    assert found.left_out["emps"].numbers["a"] > found.weights.numbers["a"]
    assert found.tiers["real"].bins[0].right == 0
    assert found.tiers["real"].bins[0].mean > 0.6


def test_known_weights_stay_and_new_numbers_are_learnt_beside_them() -> None:
    """What is known says that a name with `a` is right; where `b` stands beside it, it is not."""
    alone, beside = ({"a": 1.0}, {}), ({"a": 1.0, "b": 1.0}, {})
    findings = [ExampleFinding(str(number), "clean", Example(alone, (True, False)), False) for number in range(20)]
    findings += [ExampleFinding(f"b{number}", "clean", Example(beside, (False, True)), False) for number in range(20)]
    found = calibrate(findings, lambda recording: Weights({"a": 2.0}, 0.02)).weights
    assert found.numbers["a"] == pytest.approx(2.0, abs=0.01)
    assert found.numbers["b"] < -3
    assert found.lapse == 0.02


def test_findings_of_one_recording_cannot_be_left_out() -> None:
    finding = ExampleFinding("1", "real", Example(({"a": 1.0}, {}), (True, False)), False, "emps")
    with pytest.raises(InputError, match="give more"):
        calibrate([finding] * 3)


def test_a_lapse_bounds_how_sure_a_name_can_be() -> None:
    """One in ten is wrong where the weights say that one in a thousand is: there one of two names is drawn evenly."""
    sure = np.array([0.999, 0.001])
    lapse = fit_lapse([sure] * 100, [(True, False)] * 90 + [(False, True)] * 10)
    assert with_lapse(sure, lapse)[0] == pytest.approx(0.9, abs=0.01)
    assert fit_lapse([sure] * 1000, [(True, False)] * 999 + [(False, True)]) == pytest.approx(0, abs=1e-3)
    assert fit_lapse([sure], [(False, False)]) == 0
