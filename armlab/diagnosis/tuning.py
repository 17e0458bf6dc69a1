"""The tuning numbers of a diagnosis: each with its unit, its meaning, and where its value comes from.

One frozen dataclass holds the numbers of one stage, `Tuning` holds the stages. A number is named `stage.number`, as in
`noise.max_order`. Mathematical constants, guards against rounding and steps of derivatives stand beside their code.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace

from armlab.common.errors import InputError
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import suggest_name
from armlab.common.tuning import TuningValue, tuned
from armlab.diagnosis.motion.motion_tuning import MotionTuning
from armlab.recordings.reading.tuning import ReadingTuning

REFUTE_SOURCE = "development sets: wrong names left 0.2 to 9 times what they explained, right ones 0.53 at most"


@dataclass(frozen=True)
class DataTuning:
    """How runs are filtered and thinned, and which rows count as moving."""

    cutoff_hz: float = tuned(40.0, "highest cut-off of the filter that torque and columns share", "Hz", least=0.1)
    max_cutoff_ratio: float = tuned(
        0.32, "highest cut-off of that filter", "of the sampling rate", least=0.01, most=0.45
    )
    rows_per_cutoff: float = tuned(
        2.2,
        "rows that are kept: so few that whitening lifts hardly any frequency that the filter has emptied",
        "rows a period of the cut-off",
        least=0.1,
    )
    position_cutoff_ratio: float = tuned(
        2.0,
        "cut-off of the positions: what the torque holds, the motion has to hold too",
        "of the torque's cut-off",
        least=0.1,
    )
    max_position_cutoff_ratio: float = tuned(
        0.4, "highest cut-off of the positions", "of the sampling rate", least=0.01, most=0.45
    )
    max_encoder_share: float = tuned(
        0.5,
        "encoder noise in the columns that ends the usable frequencies",
        "of the torque's power density",
        source="a recording with nothing hidden: above it delays of 5 ms were claimed that cancel each other",
    )
    min_cutoff_hz: float = tuned(10.0, "cut-off that is used however much the encoders disturb", "Hz", least=0.1)
    median_width: int = tuned(41, "width of the running median of the torque's power", "frequencies", least=1)
    inertia_states: int = tuned(50, "states at which the mass matrix is averaged", "states a run", least=1)
    standstill_sigmas: float = tuned(5.0, "a slower joint stands still", "standard deviations of the velocity's noise")
    creep_ratio: float = tuned(0.01, "below it friction takes any value up to its level", "of the joint's high speed")
    high_speed_quantile: float = tuned(0.95, "quantile of a joint's speed that is its high speed", "quantile", most=1.0)
    min_standstill_s: float = tuned(0.004, "shorter standstills are single samples", "s")
    standstill_margin: float = tuned(
        1.5, "how far the filter carries a standstill to both sides", "periods of the cut-off"
    )
    min_segment_rows: int = tuned(40, "shorter stretches in motion tell too little of the noise", "rows", least=2)
    least_segment_rows: int = tuned(
        10, "shortest stretch in motion that counts where a joint has no longer ones", "rows", least=2
    )
    min_moving_share: float = tuned(
        0.1, "a joint with fewer moving rows counts as moving all the time", "of the rows", most=1.0
    )
    stretch_s: float = tuned(
        0.5,
        "length of the stretches of time that are units of chance: longer than what whitening leaves of any tie",
        "s",
        least=1e-3,
    )
    min_stretches: int = tuned(
        60, "least number of stretches that a variance is taken over: shorter where time is short", "stretches", least=2
    )
    min_held_out_stretches: int = tuned(
        12, "least number of stretches on which predictions are compared", "stretches", least=3
    )
    held_out_blocks: int = tuned(
        6, "blocks of time that a run is cut into where no run validates", "blocks a run", least=2
    )
    held_out_every: int = tuned(3, "every so many-th of these blocks is held out", "blocks", least=2)


@dataclass(frozen=True)
class SoundnessTuning:
    """When a recording cannot be used, or was read wrongly."""

    unit_factor: float = tuned(
        3.0, "torque that is so many times too large or small on all joints is in another unit", least=1.0
    )
    min_explained_share: float = tuned(
        0.3, "a simulation that explains less on a joint tells nothing of its unit", "of the torque's scatter"
    )


@dataclass(frozen=True)
class NoiseTuning:
    """The autoregressive model of each joint's errors."""

    max_order: int = tuned(12, "highest order of the autoregression; BIC takes the best", "rows")
    min_rows_per_order: int = tuned(
        4, "rows of the shortest stretch for each order of the autoregression", "rows", least=1
    )
    white_noise_share: float = tuned(
        1e-3, "white noise that is added: bounds how much a quiet band of frequencies is lifted", "of the variance"
    )
    min_free_share: float = tuned(
        0.2, "least degrees of freedom in the variance of the noise", "of the rows", least=0.01, most=1.0
    )
    max_prediction_loss: float = tuned(
        0.02,
        "loss of the whitened fit on held-out stretches, against a plain one, above which errors are white",
        "of the held-out squared error",
    )
    filter_correlation_rows: float = tuned(
        1.5, "rows at rest that the filter of the torque ties together", "rows", least=0.1
    )
    min_moving_share: float = tuned(
        0.5,
        "rows in motion from which on the colour of their noise is that of rows at rest, too",
        "of the rows",
        source="0.16 to 0.31 of the rows are at rest in quick motion, 0.8 in the slow one of a collaborative arm",
    )
    max_rest_ratio: float = tuned(
        1.5,
        "errors at rest up to which the colour of noise in motion is that of rest, too",
        "of the whitened errors in motion",
        source="1.0 to 1.3 where friction follows velocity, 1.9 and more where joints stick (development sets)",
    )


@dataclass(frozen=True)
class LinkTuning:
    """The widths of the links' errors that the search tries."""

    uncertainty_grid: tuple[float, ...] = tuned(
        (0.01, 0.02, 0.04, 0.08, 0.16), "widths that all links have alike", "of the links' inertia", least=1e-6
    )
    single_link_grid: tuple[float, ...] = tuned(
        (0.01, 0.02, 0.04, 0.08, 0.16, 0.5),
        "widths of one link, which may carry what the simulation does not know",
        "of the links' inertia",
        least=1e-6,
    )
    initial_width: float = tuned(0.08, "width of all links in the first fit", "of the links' inertia", least=1e-6)


@dataclass(frozen=True)
class SolverTuning:
    """Fits and scores of sets of effects."""

    crowd_penalty: float = tuned(
        4.0, "what each unusual effect makes the next one dearer: many at once are rare", "log likelihood"
    )


@dataclass(frozen=True)
class SearchTuning:
    """The search for a set of effects."""

    rounds: int = tuned(2, "rounds of search and of better shapes, before the last search", least=1)
    max_candidates_asked: int = tuned(
        40, "best candidates of a step that are asked for their physics", "candidates", least=1
    )
    max_unusual_effects: int = tuned(
        12, "effects beside usual friction: a start that asks for more has lost its way", "effects"
    )


@dataclass(frozen=True)
class RefineTuning:
    """The local search for an effect's shape."""

    evaluations_per_shape: int = tuned(
        18, "evaluations of the local search for each shape parameter", "evaluations", least=1
    )
    logarithmic_ratio: float = tuned(30.0, "bounds so far apart are searched by their logarithm", least=1.0)
    first_step: float = tuned(0.08, "first step of the local search", "of the way between the bounds", least=1e-6)


@dataclass(frozen=True)
class BlockTuning:
    """Stretches of time as the units of chance in identification rows."""

    folds: int = tuned(5, "parts of the identification stretches that are held out in turn", least=2)
    max_variance_ratio: float = tuned(
        1e5,
        "directions with a larger variance, which other columns hold as well, are not tested",
        "of the least variance",
        least=1.0,
    )


@dataclass(frozen=True)
class PredictionTuning:
    """The model that predicts: its cut-off, and what it holds beside the named effects."""

    min_trial_gain: float = tuned(
        0.02,
        "a lower cut-off, or links near a robot file, have to lower the error by more",
        "of the held-out error",
        most=1.0,
    )
    link_widths: tuple[float, ...] = tuned(
        (0.1, 0.3, 1.0, 3.0),
        "how far links may be from a robot file that holds them, beside free links, where they are refitted",
        "of the links' inertia",
        least=1e-6,
    )
    min_gain: float = tuned(
        0.01,
        "a part that is present has to lower the errors by more",
        "logarithm of the joints' errors",
        source="1 % of the error of one joint, as the choice of `identify` asks",
    )
    min_standard_errors: float = tuned(
        2.0,
        "a change has to lower the errors by more",
        "standard errors between blocks",
        source="one is the rule of Breiman and others 1984 for one choice; two, after looks at the public arms",
    )
    max_follow_rounds: int = tuned(
        8, "fits with columns that follow the model, before it counts as one that does not settle", "fits"
    )
    follow_tolerance: float = tuned(
        0.01, "change of the errors from one such fit to the next that is settled", "of the rms error"
    )


@dataclass(frozen=True)
class PushTuning:
    """What a push looks like."""

    level: float = tuned(0.3, "rows above it belong to the push", "of its peak", most=0.99)
    least_s: float = tuned(0.15, "a push that is shorter in motion is a reversal", "s")


@dataclass(frozen=True)
class PruningTuning:
    """What an effect has to pass to be claimed."""

    level: float = tuned(
        0.01, "chance of any false claim on a recording with nothing missing", "probability", least=1e-12, most=1.0
    )
    max_cycles: int = tuned(3, "cycles of withdrawing and looking again", "cycles", least=1)


@dataclass(frozen=True)
class SurrogateTuning:
    """The flexible regressions that stand in for physics without a name."""

    ridge_exponents: tuple[float, ...] = tuned(
        (-6.0, -5.0, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0),
        "ridges that are tried",
        "powers of ten of a feature's mean squared length",
        least=-12.0,
        most=12.0,
    )
    hats: int = tuned(
        8,
        "piecewise linear functions of a variable: twice as many where it matters most, three times of a position, "
        "half as many of each of two",
        "functions",
        least=4,
    )
    max_pairs: int = tuned(6, "pairs of other joints that get waves", "pairs")
    sign_widths: tuple[float, ...] = tuned(
        (0.005, 0.02, 0.06, 0.2, 0.6),
        "widths of smooth signs of the velocity, and of the load",
        "of the largest value",
        least=1e-6,
        count=3,
    )
    turning_ways: tuple[float, ...] = tuned(
        (0.01, 0.03, 0.1, 0.3), "ways after a reversal over which hysteresis turns", "of a joint's travel", least=1e-6
    )
    memories_s: tuple[float, ...] = tuned(
        (0.02, 0.1, 0.5), "lags of signs and velocities, for what depends on the way since a reversal", "s", least=1e-6
    )
    fastest_swing_hz: float = tuned(25.0, "fastest of the springs that a load drives", "Hz", least=1e-3)
    max_swing_share: float = tuned(
        0.25, "fastest of them where samples are few", "of the sampling rate", least=0.01, most=0.45
    )
    swing_range: float = tuned(50.0, "fastest of them over slowest", least=1.1)
    swings: int = tuned(14, "how many of them, in equal ratios", "springs", least=2)
    min_noise_gain: float = tuned(0.02, "gain of a prediction that is taken out of the noise", "of the held-out error")
    noise_level: float = tuned(
        0.05, "below it a prediction counts as no noise: else whitening would hide what is slow", "p-value", most=1.0
    )
    least_gain: float = tuned(
        0.03,
        "gain that a finding has to make, a name or structure without one",
        "of the joint's held-out error",
        source="development sets: of 30 right findings above two detection limits 29 gained more, wrong ones 2 to 3 %",
    )
    min_variable_share: float = tuned(
        0.1, "part of the gain that is lost without an important variable", "of the gain", most=1.0
    )
    max_variables: int = tuned(4, "important variables that are named", "variables", least=1)


@dataclass(frozen=True)
class LocationTuning:
    """Where the error is beyond the noise."""

    bins: int = tuned(
        10, "quantile bins of a variable; a peak is no longer than one such part of a run", "bins", least=2
    )
    min_significance: float = tuned(
        2.0, "excess error of a joint that is more than chance", "standard errors times sqrt(log(stretches + 1))"
    )


@dataclass(frozen=True)
class UnknownTuning:
    """When structure that is left is a finding."""

    unclaimed_fall: float = tuned(
        0.25,
        "fall by parts that no finding claims, with which it is inconclusive to find none",
        "of the held-out error",
    )
    level: float = tuned(
        0.03, "level of structure without a name, after all surrogates that were tried", "p-value", most=1.0
    )
    form_error_share: float = tuned(
        0.25,
        "structure below it comes from the form of the law, and is no finding",
        "of the error that a law explains",
        source=REFUTE_SOURCE,
    )


@dataclass(frozen=True)
class ClaimTuning:
    """How claims are stated: rivals, names of links, closed gaps."""

    max_deficit: float = tuned(2.0, "a rival whose score is lower by less may be as good by chance", "log likelihood")
    outlying_factor: float = tuned(
        4.0, "a link that is so much wider carries something", "of the other links' median width"
    )
    body_tolerance: float = tuned(
        0.05,
        "a body at another link that predicts worse by less predicts as well",
        "of the held-out error, mean of the joints' logarithms",
    )
    min_gap: float = tuned(0.02, "a smaller gap between error and noise cannot be measured", "of the noise floor")


@dataclass(frozen=True)
class NamingTuning:
    """When a finding has a name, a class of names, or none; and what is weighed for that."""

    least_names: float = tuned(
        0.8,
        "of the names of a class together, without `unknown`; with less a finding is unknown",
        "probability",
        source="development sets: one name in twenty that is claimed is wrong",
        least=0.5,
        most=1.0,
    )
    least_unnamed_fall: float = tuned(
        0.05,
        "fall from which on a law without a name is a finding",
        "of the held-out error",
        source="nulls judged on commit 15dd9f6: most false claims were such laws below it",
    )
    shown: float = tuned(0.05, "a less probable name is not listed", "probability", most=1.0)
    names: int = tuned(8, "the likeliest effects that are weighed for a finding", "names", least=1)


@dataclass(frozen=True)
class PlausibilityTuning:
    """When numbers that no engineer expects, or that are hardly known, withdraw a finding."""

    max_interval_ratio: float = tuned(
        30.0,
        "highest over lowest end of the interval of a positive parameter that is known",
        source="development sets: 12 for a right finding; an interval of 94 % of the value to both sides has it",
        least=1.0,
    )


@dataclass(frozen=True)
class IntervalTuning:
    """Intervals of named parameters."""

    factor: float = tuned(
        1.45,
        "widens intervals: what laws leave out at reversals is no noise",
        source="development sets: of 605 parameters 81 % were held without it",
    )


@dataclass(frozen=True)
class ComparisonTuning:
    """What changed between recordings."""

    stretch_s: float = tuned(
        1.5, "length of the stretches of time whose scatter says how sure a change is", "s", least=1e-3
    )
    min_stretches: int = tuned(6, "shorter ones where a recording has fewer", "stretches", least=2)
    plain_cutoff_hz: float = tuned(
        5.0,
        "cut-off at which rigid links and friction are compared",
        "Hz",
        source="least squares on real arms: 3 to 10 Hz leave the least of the torque",
        least=0.1,
    )
    same_length: float = tuned(0.9, "runs of one motion are so long at least", "of the longer run", most=1.0)
    same_motion: float = tuned(0.02, "how far apart the positions of runs of one motion may be", "of the travel")
    typical_share: float = tuned(
        0.2,
        "scale of the normal prior of a change of which nothing else is known",
        "of the torque's root mean square",
        least=1e-6,
    )
    typical_scale: float = tuned(
        0.5, "the same of a change of all friction of a joint by one factor", "of the friction", least=1e-6
    )
    drift_waves: int = tuned(6, "slow waves in which offset and friction of a run may drift", "waves a run", least=1)
    gain_drift: float = tuned(
        0.005,
        "standard deviation of a motor's torque constant between runs",
        "of the torque",
        source="NdFeB magnets lose about 0.11 % of their field per kelvin; five kelvin",
    )
    level: float = tuned(
        0.01, "of a false change in all that is compared", "probability", source="convention", most=1.0
    )
    single_run_level: float = tuned(
        1e-5,
        "the same of a change of links and friction where one recording has no second run to differ from",
        "probability",
        source="run against run of real arms with nothing changed: 1e-4 to 9e-3 where something was named",
        most=1.0,
    )
    least_shared: float = tuned(
        0.25,
        "in states that all recordings were in; where fewer are, no change is told from what the model lacks elsewhere",
        "of the rows",
        source="all nine false changes between other motions of 40 development pairs (seed 1663) were where fewer were",
        most=1.0,
    )
    least_evidence: float = tuned(
        5.0,
        "of a change, and of what the model has against a fault that it does not have; less is a rival",
        "log likelihood",
        source="a Bayes factor of 150",
    )
    least_gain: float = tuned(
        0.003,
        "gain that a change makes on stretches of the recordings that are held out in turn",
        "of the held-out error",
    )
    max_asked: int = tuned(12, "candidates that are tested at each step", "candidates", least=1)
    max_changes: int = tuned(8, "most changes that are named", "changes", least=1)


@dataclass(frozen=True)
class Tuning:
    """All tuning numbers of a diagnosis, by stage."""

    data: DataTuning = DataTuning()
    soundness: SoundnessTuning = SoundnessTuning()
    reading: ReadingTuning = field(default_factory=ReadingTuning)
    noise: NoiseTuning = NoiseTuning()
    links: LinkTuning = LinkTuning()
    solver: SolverTuning = SolverTuning()
    search: SearchTuning = SearchTuning()
    refine: RefineTuning = RefineTuning()
    blocks: BlockTuning = BlockTuning()
    prediction: PredictionTuning = PredictionTuning()
    pushes: PushTuning = PushTuning()
    pruning: PruningTuning = PruningTuning()
    surrogate: SurrogateTuning = SurrogateTuning()
    location: LocationTuning = LocationTuning()
    unknown: UnknownTuning = UnknownTuning()
    claims: ClaimTuning = ClaimTuning()
    naming: NamingTuning = NamingTuning()
    plausibility: PlausibilityTuning = PlausibilityTuning()
    intervals: IntervalTuning = IntervalTuning()
    comparison: ComparisonTuning = ComparisonTuning()
    motion: MotionTuning = field(default_factory=MotionTuning)


@dataclass(frozen=True)
class TuningNumber:
    """One tuning number. name: `stage.number`; least, most: bounds of each value; count: least length of a list."""

    name: str
    value: TuningValue
    unit: str
    meaning: str
    source: str
    least: float
    most: float
    count: int


def tuning_numbers(tuning: Tuning) -> Iterator[TuningNumber]:
    """All numbers, stage by stage."""
    for stage in fields(tuning):
        own = getattr(tuning, stage.name)
        for each in fields(own):
            yield TuningNumber(f"{stage.name}.{each.name}", getattr(own, each.name), **each.metadata)


def changed_numbers(tuning: Tuning) -> dict[str, TuningValue]:
    """Numbers that differ from their default, by name."""
    usual = {each.name: each.value for each in tuning_numbers(Tuning())}
    return {each.name: each.value for each in tuning_numbers(tuning) if each.value != usual[each.name]}


def find_number(name: str) -> TuningNumber:
    """A number by its name; InputError, with the nearest name, for one that there is not."""
    known = {each.name: each for each in tuning_numbers(Tuning())}
    if name not in known:
        close = suggest_name(name, list(known))
        hint = close if close.startswith("did") else "`armlab tools tuning` lists them all"
        raise InputError(f"{name}: no such tuning number, {hint}")
    return known[name]


def change_tuning(tuning: Tuning, name: str, value: object) -> Tuning:
    """The tuning with another value of one number.

    Raises InputError, in one line, for an unknown name, a value of a wrong type, or one that cannot be computed with.
    """
    number = find_number(name)
    checked = _checked_value(number, value)
    stage, own = name.split(".")
    return replace(tuning, **{stage: replace(getattr(tuning, stage), **{own: checked})})


def _checked_value(number: TuningNumber, value: object) -> TuningValue:
    """The value as the number's type: a whole number may stand for a real one, a single value for a list."""
    wanted = number.value
    kind = {int: "a whole number", float: "a number", tuple: "numbers"}[type(wanted)]
    whole = isinstance(wanted, int)
    values = value if isinstance(value, tuple) else (value,)
    right = len(values) == 1 if not isinstance(wanted, tuple) else len(values) >= number.count
    right = right and all(isinstance(each, int if whole else int | float) for each in values)
    if not right or any(isinstance(each, bool) for each in values):
        some = f" ({number.count} at least)" if number.count > 1 else ""
        raise InputError(f"{number.name}: {_value_text(value)} should be {kind}{some}, like {_value_text(wanted)}")
    if not all(number.least <= each <= number.most and math.isfinite(each) for each in values):
        bounds = f"{number.least:g} at least" + (f", {number.most:g} at most" if number.most < math.inf else "")
        raise InputError(f"{number.name}: {_value_text(value)} should be {bounds}")
    if isinstance(wanted, tuple):
        return tuple(float(each) for each in values)
    return values[0] if whole else float(values[0])


def parse_change(text: str) -> tuple[str, TuningValue]:
    """Name and value of `stage.number=value`; a list is written with commas. InputError where it is not so written."""
    name, equals, written = text.partition("=")
    try:
        values = tuple(_parse_value(part) for part in written.split(","))
    except ValueError:
        values = ()
    if not equals or not values:
        raise InputError(f"{text}: should be like noise.max_order=8, and a list like surrogate.memories_s=0.1,0.5")
    return name.strip(), values if len(values) > 1 else values[0]


def _parse_value(text: str) -> int | float:
    try:
        return int(text)
    except ValueError:
        return float(text)


def _value_text(value: object) -> str:
    """A value as it is written in `stage.number=value`."""
    if isinstance(value, tuple):
        return ",".join(_value_text(each) for each in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def tuning_page() -> str:
    """All numbers with value, unit, meaning and source."""
    intro = (
        "Each number that was chosen, by stage of the diagnosis (`armlab/diagnosis/tuning.py`). `armlab tools tuning` "
        "lists them, too. `armlab diagnose --set noise.max_order=8` takes another value, and "
        "`armlab proof ablate --vary noise.max_order=8` measures what that changes."
    )
    parts = []
    for stage in fields(Tuning):
        own = [each for each in tuning_numbers(Tuning()) if each.name.startswith(f"{stage.name}.")]
        rows = [(f"`{each.name}`", _value_text(each.value), each.unit, each.meaning, each.source) for each in own]
        about = str(type(getattr(Tuning(), stage.name)).__doc__)
        parts += [f"## {stage.name}", about, markdown_table(("name", "value", "unit", "meaning", "source"), rows)]
    return markdown_page("Tuning numbers of the diagnosis", intro, *parts)
