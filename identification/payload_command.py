"""`armlab payload` and `armlab gains`: from recordings with and without a load to lines."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identification.components import usual_components
from identification.groups import counterbalance
from identification.payload import Payload, Place, TorqueGains, identify_payload, torque_gains
from identification.regression import signals_of, suggested_cutoff
from identification.structure import Structure
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS, Arm
from problem.errors import InputError
from problem.inertia import link_from_centre_of_mass
from recordings.differentiate import Signals
from recordings.load import load_recording
from recordings.recording import Recording
from recordings.run import Run

CENTRE = ("centre x", "centre y", "centre z")
POSITION_FACTOR = 2.0  # columns then lose nothing to the torque, and loads move arms slowly enough for it


@dataclass(frozen=True)
class Setting:
    """What a person says of the load and the arm: see the options of the commands.

    counterbalanced: the joint with a counterbalance, which a spring stands for; cutoff_hz: from the data if None.
    """

    place: Place
    counterbalanced: int | None = None
    cutoff_hz: float | None = None


@dataclass(frozen=True, eq=False)
class _Task:
    structure: Structure
    loaded: Sequence[Signals]
    without: Sequence[Signals]

    @staticmethod
    def of(loaded: Path, without: Path | None, setting: Setting) -> "_Task":
        """Reads the recordings; the runs that identify take part, by one cut-off."""
        carrying = load_recording(loaded)
        bare = load_recording(without) if without else None
        arm = carrying.arm
        if bare is not None and len(bare.arm) != len(arm):
            raise InputError(f"{without} has {len(bare.arm)} joints, {loaded} has {len(arm)}")
        if bare is None and arm.links is None:
            raise InputError(f"--without is needed: the robot {arm.name} has no nominal `links` to stand for it")
        for what, joint in (("--link", setting.place.link), ("--counterbalance", setting.counterbalanced)):
            if joint is not None and joint > len(arm):
                raise InputError(f"{what} {joint} should be one from 1 to {len(arm)}")
        runs = _identifying(carrying), _identifying(bare) if bare else ()
        cutoff = setting.cutoff_hz or max(map(suggested_cutoff, (*runs[0], *runs[1])))
        signals = ([signals_of(run, cutoff, POSITION_FACTOR) for run in each] for each in runs)
        return _Task(_structure(arm, setting, nominal=bare is None), *signals)


def _identifying(recording: Recording) -> tuple[Run, ...]:
    runs = recording.with_role("identify")
    if not runs:
        raise InputError(f"{recording.folder} has no run to identify from: give one of its runs the role identify")
    return runs


def _structure(arm: Arm, setting: Setting, nominal: bool) -> Structure:
    """The usual components; rotors that the nominal arm names are not sought beside its links."""
    known = nominal and arm.rotor_inertia
    usual = tuple(part for part in usual_components(len(arm)) if not (known and part.effect == "rotor_inertia"))
    spring = counterbalance(setting.counterbalanced)["spring"] if setting.counterbalanced else ()
    sprung = [part.joint for part in spring]  # the spring's rest angle takes the offset in
    taken = tuple(part for part in usual if part.effect != "torque_offset" or part.joint not in sprung)
    return Structure(arm, (*taken, *spring)).separable()[0]


def payload_lines(loaded: Path, without: Path | None, setting: Setting) -> Iterator[str]:
    """The load of a recording, with intervals; InputError, in one line, where the recordings do not tell it."""
    task = _Task.of(loaded, without, setting)
    try:
        found = identify_payload(task.structure, task.without, task.loaded, setting.place)
    except ValueError as error:
        raise InputError(f"{loaded}: {error}") from None
    yield from _payload_table(found, mass_alone=setting.place.centre is not None)


def _payload_table(found: Payload, mass_alone: bool) -> Iterator[str]:
    rows = list(zip(PARAMETER_NAMES, found.parameters, found.half_widths, PARAMETER_UNITS, strict=True))
    yield from (_row(*row) for row in rows[: 1 if mass_alone else 10])
    if not mass_alone and found.parameters[0] > 0:
        yield from (_row(*row, "m") for row in zip(CENTRE, found.centre, found.centre_half_widths, strict=True))


def _row(name: str, value: float, half: float, unit: str) -> str:
    return f"{name} = {value:.4g} [{value - half:.4g}, {value + half:.4g}] {unit}"


def gains_lines(loaded: Path, without: Path, mass: float, setting: Setting) -> Iterator[str]:
    """The gain of each joint's torque reading from a load of known mass at a known point."""
    task = _Task.of(loaded, without, setting)
    load = link_from_centre_of_mass(mass, np.array(setting.place.centre or (0.0, 0.0, 0.0)), np.zeros((3, 3)))
    try:
        found = torque_gains(task.structure, task.without, task.loaded, load, setting.place.link)
    except ValueError as error:
        raise InputError(f"{loaded}: {error}") from None
    yield from _gains_table(found)


def _gains_table(found: TorqueGains) -> Iterator[str]:
    for joint, (gain, half) in enumerate(zip(found.gains, found.half_widths, strict=True), 1):
        unknown = "the load does not load it" if np.isnan(gain) else ""
        yield f"joint {joint}: {unknown}" if unknown else _row(f"joint {joint}: gain", gain, half, "")
