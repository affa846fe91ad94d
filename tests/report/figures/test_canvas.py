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


def test_a_label_of_two_lines_is_not_cut_off_beside_wide_numbers():
    """It was: by the width of the numbers it stood farther to the left than the figure reaches."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with canvas.look():
        figure, (panel,) = canvas.panels([2.0])
        panel.set_ylim(-0.025, 0.025)
        canvas.label_upright(panel, "error of the vertical profile,\nmm")
        pen = FigureCanvasAgg(figure).get_renderer()
        figure.draw(pen)
        box = panel.yaxis.label.get_window_extent(pen)
    assert 0.0 <= box.x0 < box.x1
    # And it keeps clear of numbers of three places.
    assert box.x1 <= min(tick.get_window_extent(pen).x0 for tick in panel.get_yticklabels()) + 8.0


@pytest.mark.parametrize("width", [canvas.WIDE_IN, canvas.NARROW_IN])
def test_names_of_the_parts_of_an_error_are_not_cut_off(width, monkeypatch):
    """On a phone they began outside of the figure."""
    import pandas as pd
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from simrail.campaign.budget import FLOOR, TOGETHER
    from simrail.report.campaign.verdicts import budget_chart

    figures = []
    monkeypatch.setattr(canvas, "to_svg", lambda figure, **more: figures.append(figure) or "")
    monkeypatch.setattr(canvas, "width_in", lambda: width)
    terms = ["accel_turn_on_bias", FLOOR, TOGETHER]
    budget = pd.DataFrame({"term": terms, "share": 0.3, "low95": 0.2, "high95": 0.4})
    budget_chart(budget, "shares")
    (figure,) = figures
    pen = FigureCanvasAgg(figure).get_renderer()
    figure.draw(pen)
    names = figure.axes[0].get_yticklabels()
    assert len(names) == 3
    assert all(name.get_window_extent(pen).x0 >= 0.0 for name in names)


def test_a_dark_line_is_another_by_night_and_areas_stay_as_they_are():
    with canvas.look():
        figure, (panel,) = canvas.panels([1.0])
        panel.plot([0, 1], [0, 1], color="#00507c")
        panel.axvspan(0.2, 0.4, color="#00507c", lw=0)
        text = canvas.to_svg(figure, description="line")
    night = canvas.by_night("#00507c")
    assert canvas.contrast(night, canvas.NIGHT) > 3.0 > canvas.contrast("#00507c", canvas.NIGHT)
    assert f"stroke: #00507c; stroke: light-dark(#00507c, {night})" in text
    assert "fill: light-dark" not in text
    # As a file it has the colour of paper alone.
    assert "light-dark" not in canvas.by_itself(text) and "stroke: #00507c" in canvas.by_itself(text)
