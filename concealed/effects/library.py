"""The effects that have a name in the vocabulary."""

from concealed.effects.bodies import Geometry, LinkError, Payload, Tilt
from concealed.effects.channels import Contact, Delay, EncoderOffset, Gain, Offset, Saturation, Skew
from concealed.effects.drives import Backlash, Coupling, Elasticity, Rotor
from concealed.effects.friction import Asymmetric, Coulomb, LoadDependent, NonlinearViscous, Stribeck, Viscous
from concealed.effects.hidden import Hidden
from concealed.effects.memory import Drift, Presliding
from concealed.effects.springs import Cable, Compensator, Ripple

LIBRARY: tuple[type[Hidden], ...] = (
    Coulomb, Viscous, NonlinearViscous, Stribeck, Asymmetric, LoadDependent, Presliding, Drift,
    Rotor, Gain, Offset, Ripple, Elasticity, Backlash, Coupling, Compensator, Cable,
    Payload, LinkError, Tilt, EncoderOffset, Geometry, Delay, Skew, Contact, Saturation,
)  # fmt: skip
