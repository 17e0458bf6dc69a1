"""What a diagnosis says: plain data for the verdict, the model file and the report."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from armlab.common.arrays import Array
from armlab.diagnosis.formats import Status
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.diagnosis.torque.search.search import NotTaken, Step
from armlab.effects.contract import UNKNOWN, Candidate
from armlab.effects.parameters import ParameterValue
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.reading.answer import Answer
from armlab.recordings.recording import Finding, Recording, Role


@dataclass(frozen=True)
class Rival:
    """What these data cannot tell from a claim.

    identical: no motion of this kind could; else it fits as well here, `deficit` units of log likelihood worse.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...] = ()
    identical: bool = False
    deficit: float = 0.0


@dataclass(frozen=True)
class WeighedName:
    """A name that a finding could have, or none of them (`unknown`). numbers: what speaks for it or against it, by what
    they say."""

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    numbers: Mapping[str, float]

    @property
    def is_none(self) -> bool:
        """Whether it stands for none of the names."""
        return self.effect == UNKNOWN.id


Weighed = tuple[WeighedName, ...]


@dataclass(frozen=True)
class Member:
    """A name that a finding may have, or that it is none of them (`unknown`)."""

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    probability: float

    def is_of(self, effect: str, joint: int | None) -> bool:
        """Whether it is the name of this effect at this place."""
        return (self.effect, self.joint) == (effect, joint)

    @property
    def as_rival(self) -> Rival:
        """The name as one that these data leave open."""
        return Rival(self.effect, self.joint, self.joints)


MAX_MINOR_GROWTH, MAX_MINOR_SHARE = 0.05, 0.01  # of the held-out error, and of the torque: less is of no practical size


@dataclass(frozen=True)
class Removal:
    """What the held-out error of a joint, from 0, becomes where something is taken away and the rest is fitted anew.

    growth: of the error, as a share. rms, torque: N m (N), the error with it, and the torque. joints: all those, from
    0, whose error grows by more than a minor change; better: those whose error falls by more.
    """

    joint: int
    growth: float
    rms: float
    torque: float
    joints: tuple[int, ...] = ()
    better: tuple[int, ...] = ()

    @property
    def is_minor(self) -> bool:
        """Whether the error changes by so little that nobody would miss it."""
        return self.growth < MAX_MINOR_GROWTH or self.growth * self.rms < MAX_MINOR_SHARE * self.torque


@dataclass(frozen=True)
class Part:
    """What a model holds of one cause at one place, claimed or not. claims: places of those about it, from 0.

    cause: see `parts.cause_of`. joint: or link, from 1, None for the whole robot or all links; joints: both of a
    coupling. effects: ids. removal: of all of it together. share: of the squared error that there was to explain;
    shares: of its claims, which sum to it where there are any.
    """

    cause: str
    joint: int | None
    joints: tuple[int, ...]
    effects: tuple[str, ...]
    claims: tuple[int, ...]
    removal: Removal | None
    share: float = 0.0
    shares: tuple[float, ...] = ()


@dataclass(frozen=True)
class JointFriction:
    """All friction of a model at a joint, from 1: its size, N m (N), at two speeds, rad/s (m/s), and 95 % intervals."""

    joint: int
    speeds: tuple[float, float]
    torque: tuple[float, float]
    interval: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Survival:
    """How often a name is found again in torque that is simulated from the model found, with what it leaves drawn anew.

    returned of simulated: with the finding in the simulation. appeared of left_out: without it.
    """

    returned: int
    simulated: int
    appeared: int
    left_out: int


@dataclass(frozen=True, eq=False)
class Claim:
    """One finding. joint: from 1, the link for parameters of a link, None for the whole robot.

    candidate, coefficients, covariance: the terms that add to the model, None for `unknown`. prediction: (rows,
    joints), N m, its torque at the kept rows. depends_on: variables of an unknown. in_links: whether the links of the
    model found hold it already. group: its number in the model that predicts; unnamed: those of laws that stand there
    for a finding without a name. weighed: names that it could have.
    probability: of its name; members: of its class, the likeliest first, where the name alone is not probable enough.
    left_out: the part of its torque that the model found does not predict. simulated: its scalar parameters as the
    simulation has them, where it has a law of this kind there, to which the finding adds. removal: of it alone from the
    model found. minor: of no practical size, or not among the findings that are told (`armlab.report.account`).
    survival: None unless it was asked for.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    parameters: tuple[ParameterValue, ...]
    equation: str
    evidence: Evidence
    prediction: Array
    rivals: tuple[Rival, ...] = ()
    next_experiment: str | None = None
    candidate: Candidate | None = None
    coefficients: Array | None = None
    covariance: Array | None = None
    depends_on: tuple[str, ...] = ()
    in_links: bool = False
    group: int | None = None
    unnamed: tuple[int, ...] = ()
    weighed: Weighed = ()
    probability: float | None = None
    members: tuple[Member, ...] = ()
    left_out: Array | float = 0.0
    simulated: Mapping[str, float] = field(default_factory=dict)
    removal: Removal | None = None
    minor: bool = False
    survival: Survival | None = None


@dataclass(frozen=True)
class Located:
    """Where excess error is. share: of all excess error. variable: that orders it best. time: a stretch, s."""

    joint: int
    share: float
    variable: str | None
    regime: str
    runs: tuple[str, ...] = ()
    time: tuple[float, float] | None = None


@dataclass(frozen=True)
class Unexplained:
    """Structure of a joint that no effect explains. share: of its held-out error variance."""

    joint: int
    share: float
    depends_on: tuple[str, ...]


@dataclass(frozen=True)
class HeldOutErrors:
    """Held-out error of a joint, N m (N): of the refitted rigid arm, of the model found, of the named effects alone,
    and of a plain identification with friction, offset and rotor inertia of every joint.
    """

    before: float
    after: float
    named: float
    identified: float


@dataclass(frozen=True)
class JointFit:
    """Held-out errors of a joint against the filtered torque and the torque as recorded.

    noise_floor: N m (N), of the filtered torque's noise. gap_closed: from the refitted rigid arm to the noise.
    plain: of plain least squares against the filtered torque, None where it could not be fitted.
    """

    joint: int
    filtered: HeldOutErrors
    recorded: HeldOutErrors
    noise_floor: float
    gap_closed: float | None
    plain: float | None = None

    @property
    def before(self) -> float:
        """Of the refitted rigid arm, filtered torque."""
        return self.filtered.before

    @property
    def after(self) -> float:
        """Of the model found, filtered torque."""
        return self.filtered.after


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """Everything that the verdict, the model and the report are made of.

    nominal, refit, final: residuals (rows, joints), N m, of the simulation as it is, of its links refitted, and of
    the model found, without surrogates of what is unknown. inertial: (10 * joints,) of the model found. model: the
    same to predict with; named_model: fitted with the named effects alone. is_plain: whether plain least squares is
    delivered in the place of the model that predicts, because it predicts the runs that identify better.
    steps: the log of the search and the tests. not_taken: effects that the model of the names does not hold. looks: how
    many candidates and shapes were compared. signs: warnings about limits, names, clock and standstill of the recording
    as it is. setup: how it is to be read, None where that was not asked; `recording` is then as it should be read.
    weighed: the names of each finding, and of what was not probable enough for one. reason: why no model was fitted,
    empty where one was. unnamed: the joint that is predicted much better without any finding. left: share of the torque
    of each role that the model leaves behind the low-pass of plain least squares, geometric mean over the joints;
    carries_over: whether it explains what was held out, too.
    """

    recording: Recording
    simulation: Simulation
    status: Status
    reason: str = ""
    observed: Observed | None = None
    nominal: Array | None = None
    refit: Array | None = None
    final: Array | None = None
    inertial: Array | None = None
    model: TorqueModel | None = None
    named_model: TorqueModel | None = None
    base_values: Array | None = None
    base_covariance: Array | None = None
    claims: tuple[Claim, ...] = ()
    parts: tuple[Part, ...] = ()
    is_plain: bool = False
    friction: tuple[JointFriction, ...] = ()
    located: tuple[Located, ...] = ()
    unexplained: tuple[Unexplained, ...] = ()
    fit: tuple[JointFit, ...] = ()
    steps: tuple[Step, ...] = ()
    not_taken: tuple[NotTaken, ...] = ()
    looks: int = 0
    seconds: float = 0.0
    signs: tuple[Finding, ...] = ()
    setup: Answer | None = None
    setup_seconds: float = 0.0
    weighed: tuple[Weighed, ...] = ()
    unnamed: JointFit | None = None
    left: Mapping[Role, float] = field(default_factory=dict)
    carries_over: bool = True
    settings: dict[str, float | str | bool] = field(default_factory=dict)
