"""The tuning numbers of the reading of a recording, with the bound that `armlab proof calibrate-reading` learns."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from armlab.common.tuning import tuned

BOUND_FILE: Final = "bound.json"
BOUND_SCHEMA: Final = "reading-bound/2"


def learnt(name: str) -> float:
    """A number that `armlab proof calibrate-reading` has learnt on real arms, as `BOUND_FILE` calls it."""
    content = json.loads((Path(__file__).parent / BOUND_FILE).read_text(encoding="utf-8"))
    return float(content[name])


@dataclass(frozen=True)
class ReadingTuning:
    """How readings of the recording and of the robot file are compared, and when a mistake is named."""

    rows: int = tuned(
        720,
        unit="rows",
        meaning="instants of all runs: on a sixth of them readings are looked for, on the others they are judged",
        least=120,
    )
    blocks: int = tuned(
        20, unit="blocks", meaning="blocks of time of all runs, of which every second is held out", least=4
    )
    friction_ways: tuple[float, ...] = tuned(
        (0.001, 0.002, 0.004, 0.008, 0.016, 0.032),
        unit="of a drive's travel",
        meaning="ways over which friction may turn after a reversal: it lags as torque does that is read late",
        source="development sets: twice as long a way imitates torque that is 0.3 s late",
        least=1e-6,
    )
    max_delay_s: float = tuned(0.5, unit="s", meaning="largest delay that is looked for", least=0.01)
    max_delay_share: float = tuned(
        0.08, unit="of the shortest run", meaning="largest delay that is looked for", most=0.3
    )
    smallest_error: float = tuned(
        0.01,
        unit="of the torque's scatter",
        meaning="errors below it are no reason to read a recording otherwise: noise, links and friction leave as much",
    )
    model_error: float = tuned(
        0.1, unit="of the torque's scatter", meaning="what rigid links with usual friction usually leave", least=1e-6
    )
    independent_rows: float = tuned(
        5.0, unit="rows a block", meaning="rows of a block that tell something new", least=0.1
    )
    near_width: float = tuned(
        0.25,
        unit="of the pseudo-inertia",
        meaning="how far links are from the simulation at most where their data are right",
        source="links of simulations are 5 to 20 % off",
        least=1e-3,
    )
    free_width: float = tuned(
        3.0, unit="of the pseudo-inertia", meaning="width of the prior about links that are free", least=1e-3
    )
    sign_width: float = tuned(
        0.02, unit="of the largest speed", meaning="speed at which the sign of a velocity is taken for full", least=1e-6
    )
    min_unit_factor: float = tuned(
        1.6, meaning="torque of another unit is at least so many times too large or small; less is a gain", least=1.0
    )
    refine_steps: int = tuned(16, unit="steps", meaning="of the search for a number", least=2)
    min_refined_gain: float = tuned(
        0.2, unit="nats", meaning="gain of the best of some values that makes the search for a number worth while"
    )
    min_zero_deg: float = tuned(
        10.0, unit="deg", meaning="a zero that is less far off is physics", source="the contract of findings"
    )
    min_tilt_deg: float = tuned(
        5.0, unit="deg", meaning="a base that is less tilted is physics", source="the contract of findings"
    )
    min_delay_s: float = tuned(
        0.02, unit="s", meaning="torque that is less late is physics", source="the contract of findings", least=1e-4
    )
    delay_steps: int = tuned(5, unit="values", meaning="delays that are tried each way", least=2)
    max_clock_factor: float = tuned(2.5, meaning="clocks that are tried run so many times too fast or slow", least=1.01)
    clock_steps: int = tuned(13, unit="values", meaning="clocks that are tried", least=3)
    usual_travel: float = tuned(
        learnt("usual_travel"),
        unit="rad",
        meaning="how far a joint that turns travels in a recording, geometric mean of arms",
        source="real arms: armlab proof calibrate-reading",
        least=1e-3,
    )
    travel_scatter: float = tuned(
        learnt("travel_scatter"),
        unit="of the logarithm",
        meaning="standard deviation of that of one more joint",
        source="real arms: armlab proof calibrate-reading",
        least=1e-3,
    )
    usual_error: float = tuned(
        0.05,
        unit="of the torque's scatter",
        meaning="no other reading is looked for where links and usual friction leave less of every joint",
    )
    gross_error: float = tuned(
        0.3,
        unit="of the torque's scatter",
        meaning="of all joints, from which on two mistakes are looked for of which none explains much alone",
    )
    least_evidence: float = tuned(
        learnt("bound"),
        unit="nats",
        meaning="what a mistake that is named has to explain beyond chance",
        source="the best wrong readings of real arms: armlab proof calibrate-reading",
    )
    max_open_gap: float = tuned(
        0.25,
        unit="of the gap",
        meaning="what such a mistake leaves of the gap between the links of the simulation and free ones",
    )
    beam: int = tuned(4, unit="readings", meaning="single mistakes that a second one is looked for beside", least=1)
    max_mistakes: int = tuned(3, unit="mistakes", meaning="most mistakes of a recording", least=1)
    fastest_speed: float = tuned(30.0, unit="rad/s (m/s)", meaning="no reading makes a joint faster than this")
    min_slope_likeness: float = tuned(
        0.9, meaning="correlation and slope from which on a recorded velocity confirms the clock", most=0.999
    )
    other_links_chance: float = tuned(
        0.5, meaning="chance of links that are off, against a mistake that only the links of the simulation tell"
    )
    lapse_odds: float = tuned(
        14.0,
        unit="odds",
        meaning="that no name is right, of a mistake with a gain of one standard error and another one that fits alike",
        source="development: seed 1740, 415 findings on simulated and public recordings, of which 17 are wrong",
    )
    max_unexplained: float = tuned(
        0.6, unit="of the torque's scatter", meaning="what an arm of the right geometry and reading leaves at most"
    )
    standstill_s: float = tuned(0.3, unit="s", meaning="length of a stretch in which an arm stands still", least=0.01)
    still_travel: float = tuned(
        2e-3, unit="of a joint's travel", meaning="a joint that moves less in such a stretch stands still"
    )
    min_standstill_load: float = tuned(
        1.0, unit="of the torque's scatter", meaning="gravity torque from which on standstill tells something"
    )
    least_standstill_share: float = tuned(
        0.2, meaning="a joint that holds less of its gravity torque at standstill is read wrongly"
    )

    @property
    def travels(self) -> tuple[float, float]:
        """Between which joints that turn travel, rad: three standard deviations of the logarithm."""
        factor = math.exp(3 * self.travel_scatter)
        return self.usual_travel / factor, self.usual_travel * factor
