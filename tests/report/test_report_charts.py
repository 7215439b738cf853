from xml.etree import ElementTree as ET

from hypothesis import given
from hypothesis import strategies as st

from gcs.report.charts import Curve, line_chart, slot_labels


def test_a_chart_is_xml_without_scripts_or_dates():
    text = str(line_chart([1, 2, 3], [Curve("a <b> & c", [1.0, 4.0, 2.0])], name="one"))
    root = ET.fromstring(text)
    assert root.tag.endswith("svg")
    assert "<script" not in text
    assert "<!--" not in text


def test_two_charts_in_one_page_do_not_share_ids():
    first, second = (str(line_chart([1, 2], [Curve("x", [1.0, 2.0])], name=name)) for name in ("one", "two"))
    ids = [{e.attrib["id"] for e in ET.fromstring(t).iter() if "id" in e.attrib} for t in (first, second)]
    assert ids[0]
    assert not ids[0] & ids[1]


def test_a_chart_without_slots_says_so():
    assert "no slot was finished" in str(line_chart([], [Curve("x", [])], name="none"))


@given(st.integers(1, 100_000))
def test_slot_labels_are_few_and_within_the_campaign(last: int):
    labels = slot_labels(last)
    assert labels[0] == 0
    assert labels[-1] <= last
    assert 2 <= len(labels) <= 8
