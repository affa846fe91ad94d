"""How figures become SVG, and the ticks of logarithmic axes."""

import re

import pytest

from simrail.report.figures import canvas


def labels_of(low, high, *, tall=2.0):
    """Words of the y axis, as they stand in the SVG."""
    with canvas.look():
        figure, (panel,) = canvas.panels([tall])
        panel.set_ylim(low, high)
        canvas.log_scale(panel.yaxis)
        panel.set_xticks([])
        text = canvas.to_svg(figure, description="ticks")
    return [float(words) for words in re.findall(r">([\d.e+-]+)</text>", text)], text


def test_small_numbers_of_an_axis_are_written_in_full():
    """Places are cut to a tenth of a point, words are not: 0.0001 was 0.0."""
    labels, text = labels_of(1e-4, 1.0)
    assert labels == pytest.approx([1e-4, 1e-3, 1e-2, 0.1, 1.0])
    assert not re.search(r'[ "]\d+\.\d{4,}[ "]', text)


@pytest.mark.parametrize(("low", "high"), [(0.45, 0.486), (2.9e-3, 8.3e-3), (0.11, 0.19), (0.9, 3.0)])
def test_a_narrow_range_has_few_marks(low, high):
    """Two to four, all of them in sight."""
    labels, _ = labels_of(low, high)
    assert 2 <= len(labels) <= 4
    assert all(low <= value <= high for value in labels)
