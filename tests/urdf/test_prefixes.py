"""Prefixes of XML namespaces."""

import xml.etree.ElementTree as ET

from twolink.urdf.prefixes import prefixes_in, use_prefixes

TEXT = (
    '<robot xmlns:drake="http://d" xmlns:idle="http://i"><drake:a drake:x="1" y="2"/><b>'
    '<other:c xmlns:other="o"/><drake:c xmlns:drake="http://second"/></b></robot>'
)


def written(text):
    robot = ET.fromstring(text)
    use_prefixes(robot, prefixes_in(text))
    return ET.tostring(robot, encoding="unicode")


def test_names_keep_their_prefixes():
    text = written(TEXT)
    assert '<drake:a drake:x="1" y="2" />' in text
    assert "<other:c />" in text
    assert 'xmlns:drake="http://d" xmlns:other="o"><drake:a' in text
    assert "idle" not in text


def test_a_prefix_of_two_namespaces_is_that_of_the_first():
    """The other one is declared as any other."""
    assert prefixes_in(TEXT) == {"http://d": "drake", "http://i": "idle", "o": "other"}
    assert "http://second" in written(TEXT)


def test_the_meaning_is_the_same():
    def names(text):
        return [(each.tag, each.attrib) for each in ET.fromstring(text).iter()]

    assert names(written(TEXT)) == names(TEXT)
