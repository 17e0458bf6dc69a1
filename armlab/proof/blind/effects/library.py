"""All hidden effects that the diagnosis has a name for, in the order of figures."""

from armlab.proof.blind.effects.bodies import Geometry, LinkError, Payload, Tilt
from armlab.proof.blind.effects.channels import Contact, Delay, EncoderOffset, Offset, Saturation, Skew, TorqueGain
from armlab.proof.blind.effects.drives import Backlash, Coupling, Elasticity, Rotor
from armlab.proof.blind.effects.friction import (
    Asymmetric,
    Coulomb,
    Curve,
    Drift,
    LoadDependent,
    NonlinearViscous,
    Presliding,
    Stribeck,
    Viscous,
)
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.springs import Cable, Compensator, Ripple

LIBRARY: tuple[type[HiddenEffect], ...] = (
    Coulomb,
    Viscous,
    NonlinearViscous,
    Stribeck,
    Asymmetric,
    LoadDependent,
    Presliding,
    Drift,
    Rotor,
    TorqueGain,
    Offset,
    Ripple,
    Elasticity,
    Backlash,
    Coupling,
    Compensator,
    Cable,
    Payload,
    LinkError,
    Tilt,
    EncoderOffset,
    Geometry,
    Delay,
    Skew,
    Contact,
    Saturation,
    Curve,
)
