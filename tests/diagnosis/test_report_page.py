"""The report as its reader has it: in Chromium on a desk, on a phone and on paper, without network or script."""

import json
import re
import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from markupsafe import escape
from small_recordings import frame, recording_in

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.report import palette
from armlab.common.report.charts import (
    FLOOR_LOOK,
    FOUND_LOOK,
    GIVEN_LOOK,
    MEASURED_LOOK,
    REFITTED_LOOK,
)
from armlab.common.report.page import keep_units
from armlab.diagnosis.result import Diagnosis, Member, Part, Removal, Rival, Unexplained
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.effects.contract import Effect
from armlab.effects.friction import CoulombFriction
from armlab.effects.parameters import ParameterValue
from armlab.effects.timing import TimeDelay
from armlab.recordings.load import load_recording
from armlab.report.account.account import account_of
from armlab.report.account.next_steps import next_steps
from armlab.report.torque import write
from armlab.report.torque.content import cause_table, error_note, left_table, uses
from armlab.report.torque.gallery import draw_gallery
from armlab.report.torque.measured import body_sentences, joint_table
from armlab.report.torque.residuals import correlation_seconds, filter_correlation_seconds, select_residuals
from armlab.report.torque.torque_pictures import evidence_variable
from armlab.report.torque.torque_verdict import first_screen, verdict_lines
from armlab.report.torque.write import report_texts, write_report
from armlab.report.verdict_files import verdict_texts
from armlab.report.words import effect_in_words, format_gap, format_measured, format_share, shorten_name
from problem.robot_file import load_arm

HOSTILE = "x<script>alert(1)<!script>\"&'<img src=y onerror=alert(2)>"
ARM_FILE = Path(__file__).parents[2] / "problem" / "robots" / "irb120-arm.yaml"


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """A diagnosis with friction and a load, of a recording whose names want to be HTML."""
    folder = tmp_path_factory.mktemp("made") / HOSTILE
    recording_in(folder, frame(0, 6, mass=0.4), frame(1, 6, mass=0.4), names=f"<b>{HOSTILE}", robot="robot.yaml")
    robot = yaml.safe_load(ARM_FILE.read_text())
    robot["name"] = HOSTILE
    for number, joint in enumerate(robot["joints"]):
        joint["name"] = f"j{number}{HOSTILE}"
    (folder / "robot.yaml").write_text(yaml.safe_dump(robot))
    return diagnose(load_recording(folder))


@pytest.fixture(scope="module")
def texts(found: Diagnosis) -> dict[str, str]:
    return report_texts(found, "armlab diagnose 'a b' --out c")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("there is no Chromium on this machine")
    with playwright.sync_playwright() as session:
        browser = session.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def address(texts: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(texts["report.html"], encoding="utf-8")
    return path.as_uri()


def opened(browser: Any, address: str, width: int) -> tuple[Any, list[str]]:
    page = browser.new_page(viewport={"width": width, "height": 900})
    complaints: list[str] = []
    page.context.set_offline(True)
    page.on("request", lambda request: complaints.append(request.url) if request.url != address else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("dialog", lambda dialog: complaints.append(dialog.message))
    page.on("console", lambda message: complaints.append(message.text))
    page.goto(address)
    page.evaluate("for (const each of document.querySelectorAll('details')) each.open = true")
    complaints[:] = [complaint for complaint in complaints if not complaint.startswith("data:")]
    return page, complaints


OVERLAPS = """() => [...document.querySelectorAll('svg')].flatMap(svg => {
  const boxes = [...svg.querySelectorAll('text')].map(text => [text.textContent, text.getBoundingClientRect()]);
  return boxes.flatMap(([one, a], index) => boxes.slice(index + 1).flatMap(([other, b]) => {
    const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    return across > 2 && down > 3.5 ? [`${one} | ${other}`] : [];
  }));
})"""
OUTSIDE = """() => [...document.querySelectorAll('svg')].flatMap(svg => {
  const whole = svg.getBoundingClientRect();
  return [...svg.querySelectorAll('text')].filter(text => {
    const box = text.getBoundingClientRect();
    return box.left < whole.left - 2 || box.right > whole.right + 3;
  }).map(text => text.textContent);
})"""


@pytest.mark.parametrize("width", [1200, 360])
def test_the_page_fits_its_screen_asks_for_nothing_and_no_words_in_its_pictures_overlap(
    browser: Any, address: str, width: int
) -> None:
    page, complaints = opened(browser, address, width)
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.evaluate(OVERLAPS) == []
    assert page.evaluate(OUTSIDE) == []
    assert complaints == []
    page.close()


def test_names_from_files_are_shown_as_they_are_and_never_become_elements(browser: Any, address: str) -> None:
    page, complaints = opened(browser, address, 1200)
    assert page.locator("h1").inner_text() == f"Diagnosis of {HOSTILE} ({HOSTILE})"
    assert page.locator("img, script, b").count() == 0
    assert complaints == []
    page.close()


def test_on_paper_the_way_through_the_page_goes_and_the_charts_stay(browser: Any, address: str) -> None:
    page, _ = opened(browser, address, 1200)
    page.emulate_media(media="print")
    assert not page.locator("nav").is_visible()
    assert page.locator("svg").first.is_visible()
    page.close()


def test_every_picture_says_in_words_what_it_shows(browser: Any, address: str) -> None:
    page, _ = opened(browser, address, 1200)
    pictures = page.locator('svg[role="img"]').all()
    assert len(pictures) == page.locator("svg").count() > 10
    assert all(len(each.get_attribute("aria-label")) > 15 for each in pictures)
    page.close()


def test_the_verdict_says_where_the_error_comes_from_how_large_it_is_and_what_is_gained(
    browser: Any, address: str
) -> None:
    page, _ = opened(browser, address, 1200)
    verdict = page.locator(".verdict").inner_text().replace("\N{NO-BREAK SPACE}", " ")
    assert re.match(r"[\w ]*\d+ % of the error comes from ", verdict)
    gain = r"the simulation falls most at [^:]+: from [\d.]+ to [\d.]+ N m \([\d.]+ % of its torque\)\."
    assert re.search(gain, verdict)
    page.close()


def test_errors_say_below_which_frequency_their_torque_is(found: Diagnosis) -> None:
    data = select_residuals(found)
    assert data is not None
    filtered = f"filtered below {data.observed.cutoff_hz:.3g} Hz"
    assert f"  errors on held-out data, rms of torque {filtered}:" in verdict_lines(found, verbose=True)
    assert f"both {filtered}. All on held-out data." in error_note(found, data)


CUT_CELLS = """() => [...document.querySelectorAll('th, td')].filter(cell =>
  cell.textContent.trim() && cell.closest('thead, .stacked') === null
  && cell.getBoundingClientRect().right > cell.closest('.wide').getBoundingClientRect().right + 1
).map(cell => cell.textContent)"""


def test_no_cell_of_a_table_is_cut_on_a_phone(browser: Any, address: str) -> None:
    page, _ = opened(browser, address, 390)
    assert page.evaluate(CUT_CELLS) == []
    assert page.evaluate("[...document.querySelectorAll('.stacked')].every(it => it.scrollWidth <= innerWidth - 32)")
    page.close()


def test_the_story_stands_beside_the_arm_on_a_wide_screen_and_above_it_on_a_phone(browser: Any, address: str) -> None:
    for width, is_beside in ((1280, True), (390, False)):
        page, _ = opened(browser, address, width)
        story, arm = (page.locator(each).first.bounding_box() for each in (".verdict", ".beside svg"))
        assert (arm["x"] > story["x"] + story["width"] and arm["y"] < story["y"] + story["height"]) == is_beside
        assert story["width"] <= 44 * 16
        steps, causes = (page.locator(each).first.bounding_box() for each in ("#next", ".front table"))
        assert (steps["y"] > causes["y"]) == is_beside  # on a phone the table is long
        page.close()


def test_the_arm_drawing_names_every_finding_that_is_told(found: Diagnosis) -> None:
    picture = draw_gallery(found, select_residuals(found)).arm  # type: ignore[arg-type]
    said = " ".join(re.findall(r"<text[^>]*>([^<]*)</text>", str(picture)))
    for each in account_of(found).findings:
        assert effect_in_words(each.claim.effect) in said
    assert " more" not in said


def test_what_is_left_stands_beside_the_noise_with_what_it_depends_on(found: Diagnosis) -> None:
    unknown = replace(found, unexplained=(Unexplained(2, 0.9, ("velocity_2",)),))
    (row,) = [each for each in left_table(unknown).rows if str(each[0]).startswith("2")]
    assert str(row[4]).startswith("velocity of j1")
    assert row[5] == "as real arms leave"
    large = replace(found.fit[1], filtered=replace(found.fit[1].filtered, after=1e3))
    worse = replace(found, fit=(found.fit[0], large, found.fit[2]))
    assert left_table(worse).rows[1][5] == "more than real arms leave"


def test_a_share_of_nearly_all_is_not_called_all() -> None:
    assert [format_share(value) for value in (1.0, 0.9997, 0.5, 0.0002)] == [
        "100.0 %",
        "above 99.9 %",
        "50.0 %",
        "below 0.1 %",
    ]


def test_every_finding_has_its_equation_numbers_and_evidence(found: Diagnosis, texts: dict[str, str]) -> None:
    page = texts["report.html"]
    assert found.claims
    assert page.count('<details class="finding">') == len(found.claims)
    for claim in found.claims:
        assert f"<code>{claim.equation}</code>" in page
    assert page.count("fitted law") >= len(found.claims)


def test_minor_findings_are_folded_behind_those_that_are_told(found: Diagnosis) -> None:
    first, *others = found.claims
    page = report_texts(replace(found, claims=(replace(first, minor=True), *others)))["report.html"]
    folded = page.index("1 more, small or beside larger ones")
    assert page.index(f"<code>{others[0].equation}</code>") < folded < page.index(f"<code>{first.equation}</code>")


@pytest.mark.parametrize(
    ("axis", "label"),
    [
        ("position", f"position of {shorten_name(f'j1{HOSTILE}')}, rad"),
        ("velocity", f"velocity of {shorten_name(f'j1{HOSTILE}')}, rad/s"),
        ("time", "time from the start of the run, s"),
        ("", "torque that it predicts, N m"),
    ],
)
def test_an_effect_of_a_user_is_drawn_against_its_own_axis(found: Diagnosis, axis: Any, label: str) -> None:
    class Seal(CoulombFriction):
        facts = Effect("sticky_seal", "a seal that sticks", axis=axis)

    data = select_residuals(found)
    assert data is not None
    own = replace(found.claims[0], effect="sticky_seal", joint=2, joints=(2,), candidate=Seal(2, (2,), (1,)))
    assert evidence_variable(found, data, own)[0] == label


def test_the_page_repeats_the_command(texts: dict[str, str]) -> None:
    assert "armlab diagnose &#39;a b&#39; --out c" in texts["report.html"]


def test_details_are_folded_and_the_largest_share_of_the_error_comes_first(found: Diagnosis) -> None:
    page = report_texts(found)["report.html"]
    findings = sorted(account_of(found).findings, key=lambda each: -each.share)
    places = [page.index(f"<code>{each.claim.equation}</code>") for each in findings]
    assert places == sorted(places)
    assert page.index('id="next"') < page.index('id="details"') < page.index('<details class="finding">')
    assert "<details open" not in page


def test_the_first_screen_has_a_row_a_joint_with_its_friction_units_and_intervals(found: Diagnosis) -> None:
    table = joint_table(found)
    assert table.headings[:4] == ["joint", "All friction", "Coulomb friction", "Viscous friction"]
    assert [int(row[0].split("\N{NO-BREAK SPACE}")[0]) for row in table.rows] == [1, 2, 3]
    claim = next(each for each in found.claims if each.effect == "coulomb_friction")
    (level,) = claim.parameters
    assert claim.joint is not None
    assert re.match(r"[\d.]+\sN\sm\sat\s[\d.]+\srad/s, [\d.]+\sN\sm\sat", table.rows[claim.joint - 1][1])
    assert re.match(r"[\d.]+\s%,\s[\d.]+\sN\sm", table.rows[claim.joint - 1][-1])
    cell = table.rows[claim.joint - 1][2]
    assert cell.startswith(format_measured(level).replace(" ", "\N{NO-BREAK SPACE}"))
    assert re.match(r"\d[\d.]*\sN\sm\s\([\d.]+\sto\s[\d.]+\)", cell)


def test_friction_beside_the_findings_of_a_joint_is_named_so_that_they_are_not_taken_for_all_of_it(
    found: Diagnosis,
) -> None:
    named = [each for each in found.claims if each.effect != "viscous_friction"]
    table = joint_table(replace(found, claims=tuple(named), parts=()))
    place = table.headings.index("Other")
    assert [row[place] for row in table.rows] == ["also viscous friction (small or not sure)"] * 3
    assert "Other" not in joint_table(found).headings


def test_no_line_breaks_between_a_number_and_its_unit() -> None:
    text = "5.3 N m (joint 2) at 0.41 rad/s, 2 kg at (−30, 173, 60) mm of link 3 in 3 stretches, 12 % of 4 m"
    kept = "5.3~N~m (joint 2) at 0.41~rad/s, 2~kg at (−30,~173,~60)~mm of link 3 in 3 stretches, 12~% of 4~m"
    assert keep_units(text).replace("\N{NO-BREAK SPACE}", "~") == kept


def test_what_to_do_next_names_the_joint_in_its_sentence(found: Diagnosis) -> None:
    spring = replace(found.claims[0], effect="cable_stiffness", joint=2, joints=(2,), rivals=(Rival("payload", 2),))
    alone = replace(found, claims=(spring,), parts=())
    (step,) = next_steps(alone, account_of(alone))
    assert step.startswith("To tell cable stiffness from payload: ")
    assert step.endswith(f": move j1{HOSTILE} slowly over its full range in both directions.")


def test_the_table_of_joints_is_written_for_a_paper(
    found: Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(write, "load_recording", lambda folder: found.recording)
    monkeypatch.setattr(write, "diagnose", lambda *options: found)
    lines = list(write.diagnose_recording(Path("r"), tmp_path / "out", None, 0, tables=("latex", "pdf")))
    assert any("joints.tex, joints.pdf" in line for line in lines)
    heading = (tmp_path / "out" / "joints.tex").read_text().splitlines()[2]
    assert heading.startswith("joint & All friction & Coulomb friction & Viscous friction")
    assert (tmp_path / "out" / "joints.pdf").read_bytes().startswith(b"%PDF")
    assert "--table latex --table pdf" in (tmp_path / "out" / "report.html").read_text()
    monkeypatch.setattr(write, "diagnose", lambda *options: replace(found, claims=(), parts=(), status="none"))
    lines = list(write.diagnose_recording(Path("r"), tmp_path / "none", None, 0, tables=("svg",)))
    assert "no table of joints: nothing was found" in lines
    assert not (tmp_path / "none" / "joints.svg").exists()


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [
        (2.0, (1.9976, 2.0031), "2.00 kg (1.998 to 2.003)"),
        (-0.5, (-0.61, -0.39), "−0.500 kg (−0.6 to −0.4)"),
        (0.05, None, "0.0500 kg"),
        (12345.0, (12000.0, 12690.0), "12345 kg (12000 to 12690)"),
    ],
)
def test_a_number_has_three_digits_and_an_interval_as_fine_as_it_is_wide(value: Any, interval: Any, text: str) -> None:
    assert format_measured(ParameterValue("mass", value, interval, "kg")) == text


def test_a_payload_is_told_by_mass_and_centre_in_the_frame_of_its_joint(found: Diagnosis) -> None:
    numbers = (
        ParameterValue("mass", 2.0, (1.9976, 2.0031), "kg"),
        ParameterValue("centre", (-1e-9, 0.02, 0.06), ((-0.002, 0.002), (0.018, 0.022), (0.05, 0.07)), "m"),
    )
    claim = replace(found.claims[0], effect="payload", joint=1, joints=(1,), parameters=numbers)
    (sentence,) = body_sentences(replace(found, claims=(claim,), parts=()))
    load = "2.00 kg (1.998 to 2.003) at (0, 20, 60) mm from j0"
    assert sentence.startswith(f"The arm carries a load that the simulation does not have: {load}")


def test_a_cause_without_numbers_is_worth_the_error_without_it(found: Diagnosis) -> None:
    removal = Removal(0, growth=0.5, rms=2.0, torque=10.0)
    claim = replace(found.claims[0], effect="inertial_parameter_error", parameters=(), candidate=None, removal=removal)
    parts = (Part("links", None, (), (), (0,), removal, 0.9, (0.9,)),)
    table = cause_table(replace(found, claims=(claim,), parts=parts))
    assert table is not None
    assert str(table.rows[0][2]).endswith(": 3 N m without, 2 N m with it")


def test_an_export_is_recommended_only_where_a_simulator_takes_the_links(
    found: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: object) -> None:
        raise InputError("link 1 is no body")

    monkeypatch.setattr("armlab.report.torque.content.build_simulator_model", refuse)
    assert "--method physical" in uses(found)[-1]


def test_words_of_the_field_lead_to_their_meaning_once(texts: dict[str, str]) -> None:
    page = texts["report.html"]
    targets = re.findall(r'<a class="word" href="#([\w-]+)"', page)
    assert "word-noise-floor" in targets
    assert len(targets) == len(set(targets))
    assert sorted(targets) == sorted(re.findall(r'<dt id="([\w-]+)"', page))


def test_no_more_than_the_whole_gap_is_closed() -> None:
    assert [format_gap(each) for each in (1.001, 0.5, None)] == ["100.0 %", "50.0 %", "–"]


def test_a_shift_back_in_time_has_one_sign() -> None:
    delay = TimeDelay.at(load_arm("irb120-arm"), 1)
    assert delay.equation(np.array([-0.0005])) == "tau(t) = tau_model(t + 0.0005 s)"


def test_on_paper_the_page_is_short_until_its_details(browser: Any, address: str) -> None:
    page = browser.new_page()
    page.goto(address)
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(format="A4"))) <= 4
    page.close()


def test_rivals_say_why_they_cannot_be_told_and_what_would_tell_them(found: Diagnosis) -> None:
    rivals = (Rival("rotor_inertia", 1, (1,), identical=True), Rival("cable_stiffness", 2, (2,)))
    members = (Member("cable_stiffness", 2, (2,), 0.31), Member("unknown", 1, (1,), 0.07))
    first = found.claims[0]
    claim = replace(first, rivals=rivals, members=members, probability=0.62, next_experiment="weigh the link")
    part = Part("friction", 1, (), (first.effect,), (0,), first.removal, 1.0, (1.0,))
    page = re.sub(r"</?a\b[^>]*>", "", report_texts(replace(found, claims=(claim,), parts=(part,)))["report.html"])
    assert f"rotor inertia at {escape(f'j0{HOSTILE}')}: no motion of that joint alone can tell the two apart" in page
    assert f"cable stiffness at {escape(f'j1{HOSTILE}')}: probability 0.31" in page
    assert "Its law is not certain, the cause has probability 0.62" in page
    assert "To tell: weigh the link." in page


def test_each_picture_is_a_file_that_stands_by_itself(texts: dict[str, str]) -> None:
    pictures = {name: text for name, text in texts.items() if name.endswith(".svg")}
    assert {"figures/arm.svg", "figures/errors.svg", "figures/torque_joint3.svg"} <= set(pictures)
    for text in pictures.values():
        assert ElementTree.fromstring(text).tag == "{http://www.w3.org/2000/svg}svg"
        assert text.strip() in texts["report.html"]


def test_series_differ_by_more_than_their_colour() -> None:
    looks = [MEASURED_LOOK, GIVEN_LOOK, REFITTED_LOOK, FOUND_LOOK, FLOOR_LOOK]
    assert len({(each.width, each.dash) for each in looks}) == len(looks)


def test_the_terminal_answers_in_thirty_lines_and_tells_all_where_that_is_asked(found: Diagnosis) -> None:
    lines, more = list(verdict_lines(found)), list(verdict_lines(found, verbose=True))
    assert lines[0].startswith("MISMATCH: ")
    assert max(map(len, [*lines, *more])) <= 110
    assert len(lines) <= 30
    assert sum("N m at" in line and "%" in line for line in lines) == len(found.friction)
    law = next(each.equation for each in found.claims if each.effect == "coulomb_friction")
    assert law not in " ".join(line.strip() for line in lines)
    assert law in " ".join(line.strip() for line in more)


def test_files_of_others_in_the_folder_stay_and_nothing_is_left_half_written(found: Diagnosis, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    write_report(found, tmp_path)
    write_texts(verdict_texts(found, tmp_path), tmp_path)
    names = {each.name for each in tmp_path.iterdir()}
    assert names == {"notes.txt", "report.html", "figures", "verdict.json", "model.yaml"}
    assert json.loads((tmp_path / "verdict.json").read_text())["status"] == "mismatch"


def test_where_one_file_cannot_be_written_none_is(found: Diagnosis, tmp_path: Path) -> None:
    (tmp_path / "figures").write_text("a file where the folder of pictures should be")
    with pytest.raises(InputError, match="cannot write into"):
        write_report(found, tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["figures"]


def test_a_folder_that_stands_where_a_file_should_stand_stops_all_of_them(found: Diagnosis, tmp_path: Path) -> None:
    (tmp_path / "report.html").mkdir()
    with pytest.raises(InputError, match="is a folder, where a file should be written"):
        write_texts(verdict_texts(found, tmp_path) | report_texts(found), tmp_path)
    assert [each.name for each in tmp_path.rglob("*.*")] == ["report.html"]


def test_a_report_is_the_same_when_it_is_written_again(found: Diagnosis, texts: dict[str, str]) -> None:
    assert report_texts(found, "armlab diagnose 'a b' --out c") == texts


def test_what_is_left_is_called_white_or_not_by_how_long_it_remembers_itself(found: Diagnosis) -> None:
    assert found.observed is not None
    observed, rng = found.observed, np.random.default_rng(0)
    low_pass = observed.signals[0].filter
    white = np.concatenate([low_pass(rng.standard_normal((each.run.samples, 1))) for each in observed.signals])[:, 0]
    slow = np.convolve(rng.standard_normal(len(white)), np.ones(40), mode="same")
    expected = filter_correlation_seconds(observed)
    assert 0.3 * expected < correlation_seconds(white, 0, observed) < 2.5 * expected
    assert correlation_seconds(slow, 0, observed) > 5 * expected


def test_every_link_of_the_page_leads_somewhere(browser: Any, address: str) -> None:
    page, _ = opened(browser, address, 1200)
    targets = [each.get_attribute("href") for each in page.locator("nav a").all()]
    assert targets
    assert all(page.locator(str(each)).count() == 1 for each in targets)
    page.close()


def test_an_unknown_is_shown_with_its_surrogate_over_what_it_depends_on_and_marked_apart(found: Diagnosis) -> None:
    claim = replace(found.claims[0], effect="unknown", joint=2, joints=(2,), candidate=None, depends_on=("time",))
    part = Part("unknown", 2, (), ("unknown",), (0,), None, 0.4, (0.4,))
    told = replace(found, claims=(claim,), parts=(part,), unexplained=(Unexplained(2, 0.4, ("time",)),))
    texts = report_texts(told)
    assert "surrogate" in texts["figures/finding1_unknown.svg"]
    assert "time from the start of the run, s" in texts["figures/finding1_unknown.svg"]
    assert palette.PURPLE in texts["figures/arm.svg"]
    first = f"40\N{NO-BREAK SPACE}% of the error comes from something without a name at {escape(f'j1{HOSTILE}')}"
    assert first in re.sub(r"</?a\b[^>]*>", "", texts["report.html"])


def test_a_wrong_reading_is_the_headline_and_nothing_is_told_twice(found: Diagnosis) -> None:
    wrong = "The recording is read wrongly: joint 1 counts the other way round."
    answer: Any = SimpleNamespace(sentences=(wrong,), mistakes=("joint_direction",))
    shown = first_screen(replace(found, setup=answer))
    assert shown.headline == wrong
    assert shown.paragraphs[0].startswith("Of the recording read rightly: ")
    assert " ".join((shown.headline, *shown.paragraphs)).count("% of the error comes from") == 1
