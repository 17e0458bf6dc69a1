"""One sentence for the person who wants to know which of several names is right."""

SEPARATING_EXPERIMENT = {
    "coulomb_friction": "record several constant speeds in both directions, slow ones too, with many reversals",
    "viscous_friction": "record the same speeds at different frequencies of motion, and several constant speeds",
    "nonlinear_viscous_friction": "record constant speeds up to the top of the speed range",
    "stribeck_friction": "record slow creeping below three times the Stribeck velocity, in both directions",
    "asymmetric_friction": "pass the same poses in both directions at the same speeds",
    "load_dependent_friction": "repeat one motion with two payloads, or one speed in two poses of different load",
    "presliding_hysteresis": "record micro-motions about zero velocity, smaller than the presliding range",
    "friction_drift": "record the same loop cold and after half an hour of motion",
    "rotor_inertia": "compare with the motor's data sheet: no motion tells rotor inertia from the link's own",
    "torque_gain_error": "record the motion with and without a payload of known mass",
    "torque_offset": "hold a variety of poses, each reached from both directions",
    "torque_ripple": "turn the joint slowly at constant speed, sampled well above the ripple",
    "joint_elasticity": "excite the joint with a chirp past its resonance, or read an encoder on the link side",
    "backlash": "let the load change its sign slowly, or read an encoder on the link side",
    "joint_coupling": "move the driving joint alone while the other one rests",
    "gravity_compensator": "record two payloads over the full range of the joint",
    "cable_stiffness": "move the joint slowly over its full range in both directions",
    "payload": "repeat the motion without the payload",
    "inertial_parameter_error": "weigh the link, or repeat the motion with a payload of known mass",
    "base_tilt": "measure the base with a level, or turn joint 1 through its full range",
    "encoder_offset": "check the joint's zero against its calibration mark",
    "geometry_error": "calibrate the geometry with a measuring arm or a laser tracker",
    "time_delay": "record a multisine of high frequency: delay grows with frequency, viscous friction does not",
    "channel_skew": "correlate the channels on a fast motion, or trigger them from one clock",
    "external_contact": "repeat the run without contact",
    "torque_saturation": "repeat the motion at half the speed, where no torque comes near the limit",
    "unknown": "move the joint alone over the variables it depends on, one at a time",
}


def next_experiment(effect: str, rivals: tuple[str, ...]) -> str | None:
    """What would tell a claim from its rivals; None where there is nothing to tell."""
    if not rivals and effect != "unknown":
        return None
    return SEPARATING_EXPERIMENT.get(effect)
