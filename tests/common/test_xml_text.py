"""XML that keeps its text: only what is changed is written otherwise."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from refusals import refusal

from armlab.common.xml_text import MAX_DEPTH, parse_xml_text, read_xml_text

ODD = """<?xml version="1.0"?>
<!-- a > b -->
<robot name='x "y"'  a = "b>c"
   q='z'><!-- in --><b/>
  <links>
    <link name="é">
      <mass   value=".1" /> text <![CDATA[ <x> ]]>
    </link>
    <link name="n"/>
  </links   >
</robot>
<!-- end -->
"""


def test_a_text_that_is_not_changed_stays_as_it_is() -> None:
    assert parse_xml_text(ODD, "x").text() == ODD


def test_two_hyphens_in_a_comment_are_taken_as_mujoco_takes_them() -> None:
    text = "<a><!-- ---- links ---- --><b/></a>"
    assert parse_xml_text(text, "x").text() == text


def test_changes_touch_their_own_places_alone() -> None:
    document = parse_xml_text(ODD, "x")
    document.root.set({"a": '1 < "2"', "q": None, "new": "v"})
    links = document.root.find("links")
    assert links is not None
    first, second = links.children
    first.add("inertial", {"mass": "1.0"}, first=True)
    second.add("inertial", {"mass": "2"})
    first.remove(first.children[1])
    assert document.text() == ODD.replace("a = \"b>c\"\n   q='z'>", 'a=\'1 &lt; "2"\' new="v">').replace(
        '<mass   value=".1" />', '<inertial mass="1.0"/>'
    ).replace('<link name="n"/>', '<link name="n">\n      <inertial mass="2"/>\n    </link>')
    assert [node.line for node in parse_xml_text(ODD, "x").root.walk()] == [3, 4, 5, 6, 7, 9]


def test_numbers_that_differ_by_rounding_stay_as_written() -> None:
    document = parse_xml_text('<a x="0.10 2e0" y="1" z="q"/>', "x")
    document.root.set_numbers({"x": "0.10000000000000002 2.0", "y": "1.1", "z": "3", "w": "4"})
    assert document.text() == '<a x="0.10 2e0" y="1.1" z="3" w="4"/>'


@settings(deadline=None)
@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"], exclude_characters="\ufffe\uffff")))
def test_any_value_of_an_attribute_is_read_back(value: str) -> None:
    document = parse_xml_text('<a><b c="1" d="2"/></a>', "x")
    document.root.children[0].set({"c": value, "e": value})
    read = ElementTree.fromstring(document.text())[0].attrib
    assert read == {"c": value, "d": "2", "e": value}


@pytest.mark.parametrize(
    ("encoding", "declared"), [("utf-8-sig", "UTF-8"), ("utf-16", "utf-16"), ("latin-1", "latin-1")]
)
def test_other_encodings_become_utf_8(tmp_path: Path, encoding: str, declared: str) -> None:
    path = tmp_path / "a.xml"
    path.write_bytes(f'<?xml version="1.0" encoding="{declared}"?><a b="é"/>'.encode(encoding))
    assert read_xml_text(path).text() == '<?xml version="1.0"?><a b="é"/>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a>", "is not valid XML"),
        ('<!DOCTYPE a [<!ENTITY x "y">]><a/>', "with XML entities"),
        ("<a>" * (MAX_DEPTH + 1), f"more than {MAX_DEPTH} elements inside each other"),
        ("", "is not valid XML"),
        ('<?xml version="1.0" encoding="undefined"?><a/>', "is not text in undefined"),
    ],
)
def test_what_is_no_document_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.xml"
    path.write_text(text)
    assert message in refusal(read_xml_text, path)
