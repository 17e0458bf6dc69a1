"""The tables of the page, as HTML."""

from armlab.diagnosis.result import Claim, Diagnosis
from diagnosis.report.html import table
from diagnosis.report.memory import filter_memory_seconds, memory_seconds
from diagnosis.report.rows import Shown
from diagnosis.report.words import joint_unit, number, place, plain, rows_of
from recordings.vocabulary import EFFECT_IDS, effect_named


def fit_table(diagnosis: Diagnosis, data: Shown) -> str:
    """Held-out errors by joint, the gap that is closed, and how long what is left remembers itself."""
    given = None if data.given is None else data.held_out_rms(data.given)
    headings = ["joint", *(["as given"] if given is not None else []), "refitted", "found", "noise floor", "gap closed"]
    rows = []
    for joint, each in enumerate(diagnosis.fit):
        size = joint_unit(diagnosis.simulation.arm, joint)
        first = [] if given is None else [f"{number(float(given[joint]))} {size}"]
        closed = "–" if each.gap_closed is None else f"{100 * each.gap_closed:.1f} %"
        errors = [f"{number(value)} {size}" for value in (each.before, each.after, each.noise_floor)]
        times = [
            1e3 * memory_seconds(residual[:, joint], joint, data.observed) for residual in (data.refit, data.final)
        ]
        rows.append([str(each.joint), *first, *errors, closed, f"{times[0]:.0f} → {times[1]:.0f} ms"])
    headings.append(f"memory (filter {1e3 * filter_memory_seconds(data.observed):.0f} ms)")
    return table(headings, rows)


def parameter_table(claim: Claim) -> str:
    """Named parameters of a finding with their intervals."""
    rows = [[each.name, each.value, each.interval, each.unit] for one in claim.parameters for each in rows_of(one)]
    return table(["parameter", "value", "95 % interval", "unit"], rows, (0, 3)) if rows else ""


def located_table(diagnosis: Diagnosis) -> str:
    """Which joints carry the excess error, and in which regime."""
    rows = []
    for each in diagnosis.located:
        stretch = "" if each.time is None else f"{number(each.time[0])} to {number(each.time[1])} s"
        rows.append([str(each.joint), f"{100 * each.share:.1f} %", each.regime, ", ".join(each.runs), stretch])
    headings = ["joint", "share of the excess error", "where", "runs", "stretch of time"]
    return table(headings, rows, (2, 3, 4)) if rows else ""


def findings_table(diagnosis: Diagnosis) -> str:
    """All findings in a line each."""
    rows = []
    for claim in diagnosis.claims:
        evidence = claim.evidence
        size = joint_unit(diagnosis.simulation.arm, evidence.joint)
        rivals = ", ".join(f"{plain(each.effect)}, {place(each.effect, each.joint)}" for each in claim.rivals)
        error = f"{number(evidence.rms_before)} → {number(evidence.rms_after)} {size} (joint {evidence.joint + 1})"
        where = place(claim.effect, claim.joint, claim.joints)
        rows.append([plain(claim.effect), where, claim.equation, error, rivals or "–"])
    headings = ["effect", "where", "equation", "held-out error without → with it", "fits as well"]
    return table(headings, rows, (1, 2, 3, 4)) if rows else ""


def meaning(effect: str) -> str:
    """What an effect is in a line; nothing for a user's own."""
    return effect_named(effect).meaning if effect in EFFECT_IDS else ""
