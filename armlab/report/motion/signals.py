"""Topics of `signals.mcap` where a recording has no torque: commands, measured and replayed positions."""

from armlab.diagnosis.motion.motion_result import MotionDiagnosis
from armlab.report.signals_file import Track, recorded_track, topic_names


def motion_tracks(diagnosis: MotionDiagnosis) -> list[Track]:
    """The topics of a diagnosis without torque.

    `recorded` and `commanded`: as read, on the joint side. Of what is held out, from the same first state: `simulated`,
    the replay of the simulation as given (where its controller is known), and `corrected`, that with what was found.
    """
    runs = diagnosis.recording.runs
    names = topic_names(runs)
    tracks = []
    for run in runs:
        tracks.append(recorded_track(run, names[run.name]))
        commands = (run.reference_position, run.reference_velocity)
        tracks.append(Track(f"/{names[run.name]}/commanded", run.time, *commands))
    replays = {"simulated": diagnosis.replayed_before, "corrected": diagnosis.replayed_after}
    for signal, replayed in replays.items():
        for each in replayed:
            tracks.append(Track(f"/{names[each.run.name]}/validate/{signal}", each.run.time, each.position))
    return tracks
