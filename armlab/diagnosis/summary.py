"""The verdict in a paragraph that a person can read."""

from collections.abc import Sequence

from armlab.common.report.wording import join_words
from armlab.diagnosis.formats import Status
from armlab.diagnosis.report.sentences import findings_in_sentences
from armlab.diagnosis.report.words import effect_in_words, joint_unit
from armlab.diagnosis.result import Claim, JointFit
from armlab.diagnosis.simulation import Simulation
from armlab.diagnosis.tuning import ClaimTuning
from armlab.identification.torque_model import TorqueModel
from problem.joint_words import joint_in_words

MAX_NAMED_FINDINGS = 6  # differences that the summary names; the others are counted


def summarise(status: Status, claims: Sequence[Claim], fits: Sequence[JointFit], simulation: Simulation) -> str:
    """What is missing and how much better the model then predicts."""
    if status == "none":
        worst = max((each.after for each in fits), default=0.0)
        return f"Nothing is missing: the simulation explains the recording down to its noise (at most {worst:.3g} N m)."
    best = max(fits, key=lambda each: each.before - each.after)
    where = joint_in_words(simulation.arm, best.joint)
    size = joint_unit(simulation.arm, best.joint - 1)
    gain = (
        f"On held-out data the error of {where} falls from {best.before:.3g} {size} (rigid body refitted) "
        f"to {best.after:.3g} {size}."
    )
    return f"{findings_in_sentences(claims, simulation, MAX_NAMED_FINDINGS)} {gain}"


def unnamed_gain(fits: Sequence[JointFit], tuning: ClaimTuning) -> JointFit | None:
    """The joint whose held-out error falls most with parts that are present and not claimed, where that is much."""
    worst = min(fits, key=lambda each: each.after / max(each.before, 1e-300))
    return worst if worst.after < (1 - tuning.max_unnamed_gain) * worst.before else None


def describe_unnamed(joint: JointFit, model: TorqueModel) -> str:
    """What is known where a model predicts better and none of its parts is sure enough for a name."""
    parts = [model.structure.components[index] for index in sorted(model.unclaimed)]
    names = dict.fromkeys(effect_in_words(each.effect) for each in parts if each.joint == joint.joint)
    here, where = join_words(list(names)) if names else "the links as fitted", joint_in_words(model.arm, joint.joint)
    return (
        f"Something is missing at {where}, and these data cannot name it surely: with what the model holds "
        f"without a claim ({here}) the error on held-out data falls from {joint.before:.3g} to {joint.after:.3g}. "
        "Record longer motion with more reversals and speeds."
    )
