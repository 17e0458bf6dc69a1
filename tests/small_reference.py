"""The reference model of a small recording whose friction is known."""

from pathlib import Path

from small_recordings import frame, recording_in

from armlab.effects.friction import CoulombFriction, ViscousFriction
from armlab.identification.components import every_joint
from armlab.identification.identifier import Identifier
from armlab.proof.open.real_concealed.conceal import ReferenceModel
from armlab.recordings.load import load_recording


def reference_in(folder: Path) -> ReferenceModel:
    """Identified with Coulomb and viscous friction from a recording that is written into a folder."""
    recording = load_recording(recording_in(folder, frame(0, 6), frame(1, 6)))
    friction = (*every_joint(recording.arm, CoulombFriction), *every_joint(recording.arm, ViscousFriction))
    found = Identifier(recording.arm, friction, "physical", cutoff_hz=20.0).fit(recording.with_role("identify"))
    return ReferenceModel(recording, found.model_, "as told")
