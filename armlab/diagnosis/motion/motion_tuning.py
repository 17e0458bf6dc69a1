"""The tuning numbers of a diagnosis of motion only: each with its unit, its meaning, and where its value comes from."""

from dataclasses import dataclass

from armlab.common.tuning import tuned


@dataclass(frozen=True)
class MotionTuning:
    """Recordings of motion only: servos by replay (`armlab/diagnosis/motion`)."""

    longest_window_s: float = tuned(10.0, "longest window of a replay: longer than any servo settles", "s", least=0.1)
    shortest_window_s: float = tuned(1.0, "shorter windows tell little but their first state", "s", least=0.01)
    wanted_windows: int = tuned(
        24, "blocks for the statistics; at most so many in fits that compare starts", "windows", least=2
    )
    longest_step_s: float = tuned(0.00125, "longest step of the integration", "s", least=1e-5)
    shortest_step_s: float = tuned(0.0003, "shortest step of the integration: as of a fast drive", "s", least=1e-5)
    max_step_error: float = tuned(
        0.2,
        "that the step of the integration makes of it: above, it becomes shorter",
        "of the error of a fit",
        least=0.0,
    )
    drive_period_s: float = tuned(
        0.001, "of the clock of a drive, which may use its integral before or after it adds to it", "s", least=0.0
    )
    warm_up_s: float = tuned(
        0.5, "replay before a window, in which a servo forgets an error of the first state", "s", least=0.0
    )
    history_s: float = tuned(0.3, "commands before a window, for delays", "s", least=0.3)
    cutoff_hz: float = tuned(
        10.0, "cut-off of the motion that makes loads and couplings; the joint itself is simulated", "Hz", least=0.1
    )
    residual_cutoff_hz: float = tuned(
        3.0,
        "cut-off of measured minus simulated motion, which loads and couplings get beside the simulated one",
        "Hz",
        least=0.1,
    )
    coupling_rounds: int = tuned(
        3, "in which the loads between the joints and their numbers are computed in turn", "rounds", least=1
    )
    held_out_share: float = tuned(
        1 / 3, "its end, held out where no run validates", "of each run", least=0.05, most=0.9
    )
    frequencies_hz: tuple[float, ...] = tuned(
        (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0),
        "natural frequencies of the starts of a fit: from a soft hobby servo to a stiff drive",
        "Hz",
        least=1e-3,
    )
    damping_ratios: tuple[float, ...] = tuned((0.4, 1.5), "damping ratios of the starts of a fit")
    moving_speed: float = tuned(
        0.1, "rows of the regression that finds starts: above the noise of a differentiated encoder", "rad/s (m/s)"
    )
    needed_limits: tuple[float, ...] = tuned(
        (0.7, 1.0, 1.5),
        "torque limits of the starts of a fit where the drive is not known: it may push fully most of the time",
        "of the torque that the motion needs",
    )
    starts: int = tuned(2, "starts that are fitted on few windows", "starts", least=1)
    max_evaluations: int = tuned(15, "of a fit from a start", "evaluations", least=1)
    refit_evaluations: int = tuned(
        8, "of a fit that starts near its end, and of one that compares starts", "evaluations", least=1
    )
    max_judged_windows: int = tuned(60, "most windows of the choice; the numbers come from all", "windows", least=4)
    tried_parameters: int = tuned(
        6,
        "parameters that are fitted in each round, of those that a linear model gains most from",
        "parameters",
        least=1,
    )
    judged_parameters: int = tuned(
        3, "of these, that are judged on the other half: those that fit best", "parameters", least=1
    )
    min_promise: float = tuned(
        0.2,
        "that a linear model of the errors promises: with less a parameter is not tried",
        "of the least gain",
        least=0.0,
        most=1.0,
    )
    limit_levels: tuple[float, ...] = tuned(
        (0.2, 0.4, 0.6, 0.75, 0.9),
        "starts of a torque limit: it may cut a little or much",
        "of the limit, or of the torque that a drive without one reaches",
    )
    stribeck_speeds: tuple[float, ...] = tuned(
        (0.03, 0.1, 0.3), "of static friction, from which the choice takes one", "rad/s (m/s)"
    )
    integral_rates: tuple[float, ...] = tuned(
        (0.5, 2.0, 8.0), "starts of an integral gain over kp, where nothing is said of the drive", "1/s"
    )
    rate_bounds: tuple[float, ...] = tuned(
        (0.1, 50.0), "of an integral gain over kp: slower is an offset, faster is friction", "1/s"
    )
    wound_up_levels: tuple[float, ...] = tuned(
        (0.2, 0.6), "starts of the limit of an integral", "of the torque that the motion needs"
    )
    min_gain: float = tuned(
        0.02,
        "least gain of a number on windows that took no part",
        "of the squared error beyond the encoder's noise",
        least=0.0,
        most=1.0,
    )
    min_share_beyond_noise: float = tuned(
        0.1,
        "that counts as more than the encoder's noise, at least; of what is more a number has to take its gain",
        "of the squared error",
        least=0.0,
        most=1.0,
    )
    max_share_of_encoder_steps: float = tuned(
        0.1,
        "that a drive without the difference gives as well, by reading its encoder in steps",
        "of the squared error that a number takes",
        source="recordings of arms with nothing hidden: above it false numbers, below it true ones",
        least=0.0,
        most=1.0,
    )
    max_p_value: float = tuned(
        0.01,
        "of no gain, for a finding and for a change, after Bonferroni's correction",
        "probability",
        source="convention",
        most=1.0,
    )
    max_joining_p_value: float = tuned(
        0.05, "of no gain, for a place in the model, without correction", "probability", source="convention", most=1.0
    )
    clearly_worse: float = tuned(
        2.0,
        "that whole held-out runs replay worse with a number, before it is withdrawn: sticking joints scatter",
        "standard errors over stretches",
        source="convention",
        least=0.0,
    )
    calm_share: float = tuned(
        0.6,
        "that a drive may reach in a calm window, where no limit acts: it may be lower than stated",
        "of the torque limit",
        most=1.0,
    )
    min_calm_windows: int = tuned(4, "calm ones that can refute a number", "windows", least=2)
    odd_factor: float = tuned(
        4.0, "a window that something else than the servo has moved", "times the median error", least=1.0
    )
    max_odd_share: float = tuned(0.1, "most windows that are left out so", "of the windows", most=0.5)
    min_motion: float = tuned(0.01, "windows with less travel say nothing of the usual error", "rad (m)")
    max_unexplained: float = tuned(
        0.7, "above it the command did not move the joint", "of the error of a servo without gain", most=1.0
    )
    at_floor: float = tuned(3.0, "an error that needs no explanation", "times the encoder's noise", least=1.0)
    same_error: float = tuned(
        1.25, "ratio of the error before to that after, or to the encoder's noise, that counts as right", least=1.0
    )
    class_factor: float = tuned(
        3.0,
        "growth with one more free number that makes the two a class; size of an integral gain that is there",
        "times a standard error",
        least=1.0,
    )
    min_load_share: float = tuned(
        0.1, "gravity below it does not set the scale of torques", "of the drive's torque", most=1.0
    )


DEFAULT = MotionTuning()
