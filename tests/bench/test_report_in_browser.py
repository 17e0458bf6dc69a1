"""The report as a reader has it before them: opened in headless Chromium, clicked through, on a phone and on paper."""

import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from small_results import ran

from bench.report.page import write_report
from bench.result_sets.formats import share_results

playwright = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium on this machine")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("report")
    list(write_report(*ran(folder), folder / "page.html"))
    return (folder / "page.html").as_uri()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as session:
        browser = session.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture
def page(browser: Any, address: str) -> Iterator[Any]:
    """The report on a desk, without network; no request and no error is tolerated."""
    page, complaints = _opened(browser, address, 1200)
    yield page
    page.close()
    assert complaints == []


def _opened(browser: Any, address: str, width: int) -> tuple[Any, list[str]]:
    page = browser.new_page(viewport={"width": width, "height": 800})
    complaints: list[str] = []
    page.context.set_offline(True)
    page.on("request", lambda request: complaints.append(request.url) if request.url != address else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.goto(address)
    complaints[:] = [complaint for complaint in complaints if not complaint.startswith("data:")]
    return page, complaints


def lines(page: Any, chart: str) -> int:
    return int(page.locator(f'figure[data-chart="{chart}"] path[data-algorithm]').count())


def test_every_chart_is_drawn_with_a_line_an_algorithm(page: Any) -> None:
    assert [lines(page, chart) for chart in ("overall-reached", "profile", "convergence", "reached")] == [3] * 4
    assert page.locator('figure[data-chart="ends"] circle').count() == 3 * 7


def test_a_click_on_a_button_hides_an_algorithm_in_all_charts_and_shows_it_again(page: Any) -> None:
    button = page.get_by_role("button", name="l-shade")
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    assert [lines(page, chart) for chart in ("overall-reached", "profile", "convergence", "reached")] == [2] * 4
    button.click()
    assert lines(page, "convergence") == 3


def test_all_algorithms_can_be_hidden(page: Any) -> None:
    for button in page.locator(".legend button").all():
        button.click()
    assert lines(page, "convergence") == 0
    assert page.locator('figure[data-chart="ends"] circle').count() == 0


def test_another_problem_has_its_own_charts_and_tables(page: Any) -> None:
    before = page.locator('figure[data-chart="convergence"] path[data-algorithm]').first.get_attribute("d")
    page.get_by_label("Problem", exact=True).select_option("rastrigin")
    assert page.locator('figure[data-chart="convergence"] path[data-algorithm]').first.get_attribute("d") != before
    assert [part.is_visible() for part in page.locator(".problem").all()] == [False, True]
    page.get_by_role("button", name="next").click()
    assert [part.is_visible() for part in page.locator(".problem").all()] == [True, False]
    page.get_by_role("button", name="previous").click()
    assert page.locator("#problem").input_value() == "1"


def test_values_can_be_read_with_the_mouse_and_with_the_keyboard(page: Any) -> None:
    figure = page.locator('figure[data-chart="convergence"]')
    figure.locator("svg").hover()
    assert figure.locator(".readout span").count() == 3
    figure.locator("svg").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    first = figure.locator(".readout").inner_text()
    page.keyboard.press("ArrowLeft")
    assert figure.locator(".readout").inner_text() != first
    assert first.startswith("evaluations ")


def test_the_page_of_an_algorithm_without_a_feasible_point_has_no_error(browser: Any, tmp_path: Path) -> None:
    small = ran(tmp_path)
    share_results(small.config, small.store, "csv", tmp_path / "tables")
    for table in ("trials.csv", "curves.csv"):
        rows = pd.read_csv(tmp_path / "tables" / table)
        rows.loc[rows["algorithm"] == "spso", "violation"] = 1.0
        rows.to_csv(tmp_path / "tables" / table, index=False)
    list(write_report(tmp_path / "tables", small.store, tmp_path / "page.html"))
    page, complaints = _opened(browser, (tmp_path / "page.html").as_uri(), 1200)
    assert lines(page, "convergence") == 3
    assert complaints == []
    page.close()


def test_labels_of_an_axis_do_not_run_into_each_other(browser: Any, tmp_path: Path) -> None:
    sphere = "name: wide\nproblem: {preset: sphere, dimension: 3}\nalgorithms: [l-shade, spso, random-search]\n"
    small = ran(tmp_path, sphere + "swarm_size: 10\niterations: 300\nrepetitions: 5\nseed: 1\n")
    list(write_report(*small, tmp_path / "page.html"))
    page, _ = _opened(browser, (tmp_path / "page.html").as_uri(), 360)
    labels = page.locator('figure[data-chart="ends"] text[text-anchor="middle"]').all()[:-1]  # the last is the axis's
    edges = [(box["x"], box["x"] + box["width"]) for box in (label.bounding_box() for label in labels)]
    assert len(edges) > 2
    assert all(right < left for (_, right), (left, _) in pairwise(edges))
    page.close()


def test_every_picture_says_in_words_what_it_shows(page: Any) -> None:
    pictures = page.locator('svg[role="img"]').all()
    assert len(pictures) == 8
    assert all(len(picture.get_attribute("aria-label")) > 15 for picture in pictures)


def test_on_a_phone_nothing_is_wider_than_the_screen_and_text_is_not_shrunk(browser: Any, address: str) -> None:
    page, complaints = _opened(browser, address, 360)
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    chart = page.locator('figure[data-chart="convergence"] svg').bounding_box()
    assert 250 <= chart["width"] <= 360
    drawn = page.locator('figure[data-chart="convergence"] svg').get_attribute("width")
    assert float(drawn) == pytest.approx(chart["width"], abs=1)  # one unit is one pixel: 12 px stay 12 px
    assert complaints == []
    page.close()


def test_on_paper_the_charts_stay_and_the_controls_go(page: Any, tmp_path: Path) -> None:
    page.emulate_media(media="print")
    assert not page.locator("#next").is_visible()
    assert page.locator('figure[data-chart="convergence"] svg').is_visible()
    page.pdf(path=tmp_path / "page.pdf", format="A4")
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
