"""Line numbers of keys."""

import pytest

from policy.mission_file.key_lines import dotted, line_of

TEXT = '''\
# comment
title = """
[not.a.header]
slots = 3
"""
[campaign]   # here
name = "x # no comment ["
"slots" = 4
[area]
obstacles = [
  [1, 2],
  { height_m = 1, "polygon_m" = [
    [3]
  ] },
  { height_m = 2 },
]
size.east = 3
[[more.entry]]
a = 1
[[more.entry]]
a = 2
'''


@pytest.mark.parametrize(
    ("key", "line"),
    [
        (("title",), 2),
        (("campaign",), 6),
        (("campaign", "name"), 7),
        (("campaign", "slots"), 8),
        (("area", "obstacles"), 10),
        (("area", "obstacles", 0, "height_m"), 12),
        (("area", "obstacles", 1, "height_m"), 15),
        (("area", "obstacles", 0, "absent"), 10),
        (("area", "size", "east"), 17),
        (("more", "entry", 1, "a"), 21),
        (("campaign", "absent"), 6),
        (("absent",), None),
    ],
)
def test_lines(key, line):
    assert line_of(TEXT, key) == line


def test_spelling():
    assert dotted(("area", "obstacles", 0, "height_m")) == "[area] obstacles[0].height_m"
    assert dotted(("area",)) == "[area]"
