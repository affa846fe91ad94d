"""The plan of a track: what is written on it stays on it."""

from __future__ import annotations

import re

import pytest

from simrail.report.figures.canvas import NARROW_IN, WIDE_IN, drawn
from simrail.report.figures.track import plan_figure
from simrail.track.file import track_by_name

LETTER_PT = 0.6
"""Width of a letter in its size."""


@pytest.mark.parametrize("name", ["metro_line", "condequinto_olivar"])
def test_words_stay_inside_of_the_plan_and_off_each_other(name: str) -> None:
    track = track_by_name(name)
    stops = {"start": track.start_m + 5.0, "end": track.end_m - 5.0}
    both = drawn("plan", lambda: plan_figure(track, stops=stops)).split('class="narrow"')
    for svg, wide_in in zip(both, (WIDE_IN, NARROW_IN), strict=True):
        wide = 72.0 * wide_in
        sizes = dict(re.findall(r"\.(\w+)\{[^}]*font-size: ([\d.]+)px", svg))
        words = re.findall(r'class="(\w+)"[^>]*translate\(([\d.-]+) ([\d.-]+)\)">(cant[^<]*)<', svg)
        found = [(sizes[look], x, y, word) for look, x, y, word in words]
        names = [
            (float(x), float(x) + LETTER_PT * float(size) * len(word), float(y)) for size, x, y, word in found
        ]
        assert len(names) >= 4
        assert min(names)[0] >= 0.0 and max(right for _, right, _ in names) <= wide + 1.0
        for i, (left, right, y) in enumerate(names):
            for other_left, other_right, other_y in names[:i]:
                assert min(right, other_right) - max(left, other_left) < 1.0 or abs(y - other_y) > 7.0
