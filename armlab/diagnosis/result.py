"""What a diagnosis says: plain data for the verdict, the model file and the report."""

from dataclasses import dataclass, field

from armlab.common.arrays import Array
from armlab.diagnosis.data import Observed
from armlab.diagnosis.evidence import Evidence
from armlab.diagnosis.formats import Status
from armlab.diagnosis.search import Step
from armlab.diagnosis.simulation import Simulation
from armlab.effects.contract import Candidate
from armlab.effects.parameters import ParameterValue
from armlab.recordings.recording import Recording


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


@dataclass(frozen=True, eq=False)
class Claim:
    """One finding. joint: from 1, the link for parameters of a link, None for the whole robot.

    candidate, coefficients, covariance: the terms that add to the model, None for `unknown`. prediction: (rows,
    joints), N m, its torque at the kept rows. depends_on: variables of an unknown. in_links: whether the links of the
    model found hold it already.
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
class JointFit:
    """Held-out error of a joint, N m: of the refitted rigid arm, of the model found, and of the noise alone."""

    joint: int
    before: float
    after: float
    noise_floor: float
    gap_closed: float | None


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Everything that the verdict, the model and the report are made of.

    nominal, refit, final: residuals (rows, joints), N m, of the simulation as it is, of its links refitted, and of
    the model found. inertial: (10 * joints,) of the model found. held_out: (rows,) what took no part in the fit.
    steps: the log of the search. looks: how many candidates and shapes were compared.
    """

    recording: Recording
    simulation: Simulation
    status: Status
    summary: str
    observed: Observed | None = None
    nominal: Array | None = None
    refit: Array | None = None
    final: Array | None = None
    inertial: Array | None = None
    base_values: Array | None = None
    base_covariance: Array | None = None
    claims: tuple[Claim, ...] = ()
    located: tuple[Located, ...] = ()
    unexplained: tuple[Unexplained, ...] = ()
    fit: tuple[JointFit, ...] = ()
    steps: tuple[Step, ...] = ()
    looks: int = 0
    seconds: float = 0.0
    settings: dict[str, float | str | bool] = field(default_factory=dict)

    def __repr__(self) -> str:
        """The status, the first claims as effect@place with their equations, and how many there are."""
        lines = [f"Diagnosis of {self.recording.name!r}: {self.status}; claims: {len(self.claims)}"]
        for claim in self.claims[:4]:
            place = "" if claim.joint is None else f"@{claim.joint}"
            lines.append(f"  {claim.effect}{place}: {claim.equation}")
        if len(self.claims) > 4:
            lines.append(f"  and {len(self.claims) - 4} more claims")
        return "\n".join(lines if self.claims else [*lines, f"  {self.summary}"])
