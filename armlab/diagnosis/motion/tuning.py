"""The tuning numbers of a diagnosis of motion only: each with its unit, its meaning, and where its value comes from."""

from dataclasses import dataclass

from armlab.common.tuning import tuned


@dataclass(frozen=True)
class MotionTuning:
    """Recordings of motion only: servos by replay (`armlab/diagnosis/motion`)."""

    longest_window_s: float = tuned(
        10.0, unit="s", meaning="longest window of a replay: longer than any servo settles", least=0.1
    )
    shortest_window_s: float = tuned(
        1.0, unit="s", meaning="shorter windows tell little but their first state", least=0.01
    )
    wanted_windows: int = tuned(
        24, unit="windows", meaning="blocks for the statistics, where the recording is long enough", least=2
    )
    longest_step_s: float = tuned(0.00125, unit="s", meaning="longest step of the integration", least=1e-5)
    shortest_step_s: float = tuned(
        0.0003, unit="s", meaning="shortest step of the integration: as of a fast drive", least=1e-5
    )
    max_step_error: float = tuned(
        0.2,
        unit="of the error of a fit",
        meaning="that the step of the integration makes of it: above, it becomes shorter",
        least=0.0,
    )
    drive_period_s: float = tuned(
        0.001,
        unit="s",
        meaning="of the clock of a drive, which may use its integral before or after it adds to it",
        least=0.0,
    )
    warm_up_s: float = tuned(
        0.5, unit="s", meaning="replay before a window, in which a servo forgets an error of the first state", least=0.0
    )
    history_s: float = tuned(0.3, unit="s", meaning="commands before a window, for delays", least=0.3)
    cutoff_hz: float = tuned(
        10.0,
        unit="Hz",
        meaning="cut-off of the motion that makes loads and couplings; the joint itself is simulated",
        least=0.1,
    )
    residual_cutoff_hz: float = tuned(
        3.0,
        unit="Hz",
        meaning="cut-off of measured minus simulated motion, which loads and couplings get beside the simulated one",
        least=0.1,
    )
    coupling_replays: int = tuned(
        3,
        unit="replays",
        meaning="of the arm, each along the path or with the shared number of the one before",
        least=1,
    )
    coupling_rounds: int = tuned(
        2, unit="rounds", meaning="in which the usual numbers and the loads take turns before the choice", least=1
    )
    coupling_choices: int = tuned(
        3, unit="times", meaning="most that loads are made and numbers are chosen by turns", least=1
    )
    held_out_share: float = tuned(
        1 / 3, unit="of each run", meaning="its end, held out where no run validates", least=0.05, most=0.9
    )
    frequencies_hz: tuple[float, ...] = tuned(
        (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0),
        unit="Hz",
        meaning="natural frequencies of the starts of a fit: from a soft hobby servo to a stiff drive",
        least=1e-3,
    )
    damping_ratios: tuple[float, ...] = tuned((0.4, 1.5), meaning="damping ratios of the starts of a fit")
    moving_speed: float = tuned(
        0.1,
        unit="rad/s (m/s)",
        meaning="rows of the regression that finds starts: above the noise of a differentiated encoder",
    )
    needed_limits: tuple[float, ...] = tuned(
        (0.7, 1.0, 1.5),
        unit="of the torque that the motion needs",
        meaning="torque limits of the starts of a fit where the drive is not known: it may push fully most of the time",
    )
    max_start_windows: int = tuned(24, unit="windows", meaning="most windows of the fits that compare starts", least=2)
    starts: int = tuned(2, unit="starts", meaning="starts that are fitted on few windows", least=1)
    max_evaluations: int = tuned(15, unit="evaluations", meaning="of a fit from a start", least=1)
    refit_evaluations: int = tuned(
        8, unit="evaluations", meaning="of a fit that starts near its end, and of one that compares starts", least=1
    )
    max_judged_windows: int = tuned(
        60, unit="windows", meaning="most windows of the choice; the numbers come from all", least=4
    )
    tried_parameters: int = tuned(
        6,
        unit="parameters",
        meaning="parameters that are fitted in each round, of those that a linear model gains most from",
        least=1,
    )
    judged_parameters: int = tuned(
        3, unit="parameters", meaning="of these, that are judged on the other half: those that fit best", least=1
    )
    min_promise: float = tuned(
        0.2,
        unit="of the least gain",
        meaning="that a linear model of the errors promises: with less a parameter is not tried",
        least=0.0,
        most=1.0,
    )
    limit_levels: tuple[float, ...] = tuned(
        (0.2, 0.4, 0.6, 0.75, 0.9),
        unit="of the limit, or of the torque that a drive without one reaches",
        meaning="starts of a torque limit: it may cut a little or much",
    )
    stribeck_speeds: tuple[float, ...] = tuned(
        (0.03, 0.1, 0.3), unit="rad/s (m/s)", meaning="of static friction, from which the choice takes one"
    )
    integral_rates: tuple[float, ...] = tuned(
        (0.5, 2.0, 8.0), unit="1/s", meaning="starts of an integral gain over kp, where nothing is said of the drive"
    )
    rate_bounds: tuple[float, ...] = tuned(
        (0.1, 50.0), unit="1/s", meaning="of an integral gain over kp: slower is an offset, faster is friction"
    )
    wound_up_levels: tuple[float, ...] = tuned(
        (0.2, 0.6), unit="of the torque that the motion needs", meaning="starts of the limit of an integral"
    )
    min_gain: float = tuned(
        0.02,
        unit="of the squared error beyond the encoder's noise",
        meaning="least gain of a number on windows that took no part",
        least=0.0,
        most=1.0,
    )
    min_share_beyond_noise: float = tuned(
        0.1,
        unit="of the squared error",
        meaning="that counts as more than the encoder's noise, at least; of what is more a number has to take its gain",
        least=0.0,
        most=1.0,
    )
    max_share_of_encoder_steps: float = tuned(
        0.1,
        unit="of the squared error that a number takes",
        meaning="that a drive without the difference gives as well, by reading its encoder in steps",
        source="recordings of arms with nothing hidden: above it false numbers, below it true ones",
        least=0.0,
        most=1.0,
    )
    max_p_value: float = tuned(
        0.01,
        unit="probability",
        meaning="of no gain, for a finding and for a change, after Bonferroni's correction",
        source="convention",
        most=1.0,
    )
    max_joining_p_value: float = tuned(
        0.05,
        unit="probability",
        meaning="of no gain, for a place in the model, without correction",
        source="convention",
        most=1.0,
    )
    clearly_worse: float = tuned(
        2.0,
        unit="standard errors over stretches",
        meaning="that whole held-out runs replay worse with a number, before it is withdrawn: sticking joints scatter",
        source="convention",
        least=0.0,
    )
    calm_share: float = tuned(
        0.6,
        unit="of the torque limit",
        meaning="that a drive may reach in a calm window, where no limit acts: it may be lower than stated",
        most=1.0,
    )
    min_calm_windows: int = tuned(4, unit="windows", meaning="calm ones that can refute a number", least=2)
    least_confirmed: float = tuned(
        0.5,
        unit="of what a number explains where a limit acts",
        meaning="that it has to explain in calm windows, within two standard errors: half way from false to true",
        source="convention",
        most=1.0,
    )
    odd_factor: float = tuned(
        4.0, unit="times the median error", meaning="a window that something else than the servo has moved", least=1.0
    )
    max_odd_share: float = tuned(0.1, unit="of the windows", meaning="most windows that are left out so", most=0.5)
    min_motion: float = tuned(0.01, unit="rad (m)", meaning="windows with less travel say nothing of the usual error")
    min_windows_for_odd: int = tuned(
        8, unit="windows", meaning="with fewer windows in motion none is left out", least=1
    )
    max_unexplained: float = tuned(
        0.7,
        unit="of the error of a servo without gain",
        meaning="above it the command did not move the joint",
        most=1.0,
    )
    at_floor: float = tuned(
        3.0, unit="times the encoder's noise", meaning="an error that needs no explanation", least=1.0
    )
    same_error: float = tuned(
        1.25,
        meaning="ratio of the error before to that after, or to the encoder's noise, that counts as right",
        least=1.0,
    )
    class_factor: float = tuned(
        3.0,
        unit="times a standard error",
        meaning="growth with one more free number that makes the two a class; size of an integral gain that is there",
        least=1.0,
    )
    class_correlation: float = tuned(
        0.95, meaning="correlation of two fitted numbers that makes them a class", most=1.0
    )
    min_load_share: float = tuned(
        0.1,
        unit="of the drive's torque",
        meaning="gravity below it does not set the scale of torques",
        most=1.0,
    )


DEFAULT = MotionTuning()
