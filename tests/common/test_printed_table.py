"""Tables for papers: what a reader of the PDF and the SVG finds in them."""

import re
from xml.etree import ElementTree

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from armlab.common.markdown import latex_table
from armlab.common.report import printed_table
from armlab.common.report.page import Table
from armlab.common.report.printed_table import TABLE_FORMS, table_files, table_pdf, table_svg

SHORT = Table(["algorithm", "minimum"], [["spso", "1.2"], ["$a_b$ & <c>", "3"]])
LONG = Table(["row", "number"], [[f"name {number}", str(number)] for number in range(200)])
WIDE = Table(["joint", "a", "Other"], [["1 j", "2 N m", "word " * 80], ["2 j", "–", "x" * 1000]], (2,))


def pages_of(pdf: bytes) -> list[tuple[float, float]]:
    """Width and height of each page, points."""
    boxes = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", pdf)
    return [(float(width), float(height)) for width, height in boxes]


def svg_texts(table: Table) -> list[str]:
    return [
        node.text or "" for node in ElementTree.fromstring(table_svg(table)).iter("{http://www.w3.org/2000/svg}text")
    ]


def test_the_pdf_has_a_font_of_type_42_and_no_other() -> None:
    pdf = table_pdf(SHORT)
    assert pdf.startswith(b"%PDF")
    assert b"/CIDFontType2" in pdf
    assert b"/Type3" not in pdf


def test_the_same_table_has_the_same_bytes() -> None:
    assert table_pdf(SHORT) == table_pdf(SHORT)
    assert table_svg(SHORT) == table_svg(SHORT)


def test_many_rows_go_on_several_pages_of_a4_and_none_is_lost() -> None:
    pdf = table_pdf(LONG)
    sizes = pages_of(pdf)
    assert len(sizes) > 3
    assert all(width <= 841.9 and height <= 595.3 for width, height in sizes)
    assert len(re.findall(rb"/Type /Page\b", pdf)) == len(sizes)


def test_all_cells_are_text_in_the_svg_and_signs_of_latex_stand_as_they_are() -> None:
    assert svg_texts(SHORT) == ["algorithm", "minimum", "spso", "1.2", "$a_b$ & <c>", "3"]
    assert len(svg_texts(LONG)) == 402


@pytest.mark.parametrize("table", [SHORT, LONG, WIDE])
def test_every_word_is_inside_of_the_page(table: Table) -> None:
    figure = printed_table._draw(printed_table._lay_out(table))
    renderer = FigureCanvasAgg(figure).get_renderer()
    for text in figure.texts:
        box = text.get_window_extent(renderer)
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= figure.bbox.width
        assert box.y1 <= figure.bbox.height


def test_long_cells_take_several_lines_and_keep_all_their_words() -> None:
    shown = svg_texts(WIDE)
    assert " ".join(shown).count("word") == 80
    assert "".join(shown).count("x") == 1000
    assert pages_of(table_pdf(WIDE))[0][0] <= 841.9


def test_a_column_of_long_words_is_a_paragraph_in_latex() -> None:
    assert latex_table(WIDE.headings, WIDE.rows, WIDE.texts).startswith(r"\begin{tabular}{lrp{0.33\linewidth}}")
    assert "0.1~N m $-$1" in latex_table(["a"], [["0.1\N{NO-BREAK SPACE}N m \N{MINUS SIGN}1"]])


def test_a_table_has_one_file_for_each_form() -> None:
    assert sorted(table_files("joints", SHORT, list(TABLE_FORMS))) == ["joints.pdf", "joints.svg", "joints.tex"]
