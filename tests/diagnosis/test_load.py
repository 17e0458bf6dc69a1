"""The load of an arm beside its robot file, with all that the diagnosis names."""

import hashlib
import pickle
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from example_log import record_example
from public_copies import needs_copies
from refusals import refusal

from armlab.common.documents import Document
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.carried_load import find_gains, nominal_gains_lines, nominal_payload_lines
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.search.fitted_model import Progress
from armlab.diagnosis.torque.stages import find_names
from armlab.identification.payload import PayloadSetting, Place
from armlab.recordings.load import load_recording
from armlab.recordings.public import fetch_recording
from problem.pseudo_inertia import link_from_centre_of_mass

TRUTH = {"m": 1.5, "mcx": 0.075, "mcz": 0.12, "Ixx": 0.0136, "Iyy": 0.01735, "Izz": 0.00775, "Ixz": -0.006}


@pytest.fixture(scope="module", autouse=True)
def names_found_once() -> Iterator[None]:
    """The names of a recording are found once: each load, and a diagnosis, begins with them."""
    known: dict[str, Belief] = {}

    def find_once(design: DesignMatrix, seed: int, progress: Progress) -> Belief:
        key = hashlib.sha256(pickle.dumps((design, seed))).hexdigest()
        if key not in known:
            known[key] = find_names(design, seed, progress)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        for user in ("carried_load", "diagnose"):
            patch.setattr(f"armlab.diagnosis.torque.{user}.find_names", find_once)
        yield


@pytest.fixture(scope="module")
def example_recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording of `armlab recording example`, the second run held out."""
    return record_example(tmp_path_factory.mktemp("example"))


def found_load(folder: Path, setting: PayloadSetting) -> tuple[list[str], Document]:
    """Lines and document of the load of a recording."""
    lines, told = [], nominal_payload_lines(folder, setting, lambda message: None)
    while True:
        try:
            lines.append(next(told))
        except StopIteration as stop:
            return lines, stop.value


def test_the_load_of_the_example_is_that_of_its_diagnosis_and_of_the_truth(example_recording: Path) -> None:
    _, found = found_load(example_recording, PayloadSetting(Place()))
    assert found["link"] == 3
    assert found["not_determined"] == []
    for name, true in TRUTH.items():
        low, high = found["parameters"][name]["ci95"]
        assert low < true < high, name
    claims = {each.effect: each for each in diagnose(load_recording(example_recording)).claims}
    mass = claims["payload"].parameters[0]
    low, high = found["parameters"]["m"]["ci95"]
    assert mass.value == pytest.approx(found["parameters"]["m"]["value"], rel=0.002)
    assert low < mass.value < high
    assert sorted(found["beside"]) == [
        f"{kind} friction at joint {joint}" for kind in ("Coulomb", "viscous") for joint in (1, 2, 3)
    ]


def test_a_known_place_leaves_only_the_mass(example_recording: Path) -> None:
    lines, found = found_load(example_recording, PayloadSetting(Place(None, (0.05, 0.0, 0.08))))
    assert list(found["parameters"]) == ["m"]
    assert found["parameters"]["m"]["value"] == pytest.approx(1.5, rel=0.02)  # the load is not a point, as this says
    assert lines[0].startswith("m = 1.5")


@pytest.mark.parametrize("too_large", [1.0, 1.1])
def test_a_known_load_shows_how_much_too_large_torque_is_read(example_recording: Path, too_large: float) -> None:
    where = PayloadSetting(Place(None, (0.05, 0.0, 0.08)))
    lines = list(nominal_gains_lines(example_recording, TRUTH["m"] / too_large, where, lambda message: None))
    assert [each.split(":")[0] for each in lines] == ["joint 1", "joint 2", "joint 3"]
    load = link_from_centre_of_mass(TRUTH["m"] / too_large, np.array(where.place.centre), np.zeros((3, 3)))
    found = find_gains(load_recording(example_recording), load.parameters, where, lambda message: None)
    assert np.all(np.abs(found.gains - too_large) < 0.03)  # the load is not a point, as this says
    assert np.all(found.half_widths < 0.1)


def test_a_load_on_the_first_axis_shows_no_gain(example_recording: Path) -> None:
    place = PayloadSetting(Place(1, (0.0, 0.0, 0.1)))
    message = refusal(lambda: list(nominal_gains_lines(example_recording, 1.5, place, lambda message: None)))
    assert "do not determine the gains: no joint feels the load enough" in message


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (PayloadSetting(Place(1)), "do not determine the mass of the load: no joint feels the mass of link 1 alone"),
        (PayloadSetting(Place(4)), "--link 4 should be one from 1 to 3"),
        (PayloadSetting(Place(), counterbalanced=5), "--counterbalance 5 should be one from 1 to 3"),
    ],
)
def test_what_cannot_be_told_is_refused_in_one_line(
    example_recording: Path, setting: PayloadSetting, message: str
) -> None:
    assert message in refusal(lambda: found_load(example_recording, setting))


@needs_copies("kuka-kr300")
def test_the_payload_of_the_kuka_is_found_beside_what_its_diagnosis_names(tmp_path: Path) -> None:
    """Its mass is not published; a fit of others with its counterbalance gave 157 kg."""
    _, found = found_load(fetch_recording("kuka-kr300", tmp_path / "kuka"), PayloadSetting(Place(), counterbalanced=2))
    low, high = found["parameters"]["m"]["ci95"]
    assert low < 157 < high
    assert high - low < 40
