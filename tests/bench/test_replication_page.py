"""The replication report as a page."""

from bench.studies.paper.replication_page import markdown_to_html


def test_tables_of_the_replication_page_bear_their_headings_on_a_phone() -> None:
    page = markdown_to_html("Claims", "| where | verdict |\n| --- | --- |\n| Table 1 | **reproduced** |\n", {})
    assert '<div class="wide" tabindex="0"><table class="stacked">' in page
    assert '<td class="text" data-label="verdict"><strong>reproduced</strong></td>' in page
