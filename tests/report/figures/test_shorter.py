"""Figures are made short, and look as they did."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from simrail.report.figures import canvas
from simrail.report.figures.shorter import LONG, PIXEL_PT, short_path, shorter

NUMBER = r"-?(?:\d+\.?\d*|\.\d+)"
SVG = '<svg viewBox="0 0 9 9"><defs><style>*{{}}</style></defs>{}</svg>'


def strokes_of(path):
    """Places of each stroke of a path by relative steps, as a browser reads them."""
    strokes, at = [], np.zeros(2)
    for name, text in re.findall(r"([MlhvzcqLQC])([^MlhvzcqLQC]*)", path):
        numbers = [float(number) for number in re.findall(NUMBER, text)]
        assert "".join(re.findall(NUMBER, text)) == text.replace(" ", ""), "nothing but numbers"
        if name == "M":
            at = np.array(numbers)
            strokes.append([at])
        elif name in "hv":
            for number in numbers:
                at = at + ([number, 0.0] if name == "h" else [0.0, number])
                strokes[-1].append(at)
        elif name in "lcq":
            size = {"l": 2, "q": 4, "c": 6}[name]
            for step in np.reshape(numbers, (-1, size)):
                strokes[-1] += [at + step[i : i + 2] for i in range(0, size, 2)]
                at = strokes[-1][-1]
        else:
            assert name == "z"
            at = strokes[-1][0]
    return [np.array(stroke) for stroke in strokes]


def path_of(x, y):
    return "M " + "L ".join(f"{a:.6f} {b:.6f}" for a, b in zip(x, y, strict=True))


def test_a_path_by_steps_leads_through_the_same_places():
    """Errors of rounding do not add up: each place is rounded, not each step."""
    random = np.random.default_rng(1)
    x, y = random.uniform(-3.0, 3.0, (2, LONG - 1)).cumsum(axis=1)
    (stroke,) = strokes_of(short_path(path_of(x, y)))
    steps = np.round(np.column_stack((x, y)), 1)
    kept = np.append(True, (np.diff(steps, axis=0) != 0.0).any(axis=1))
    np.testing.assert_allclose(stroke, steps[kept], atol=1e-9)
    np.testing.assert_allclose(steps, np.column_stack((x, y)), atol=0.05 + 1e-9)


def test_shapes_marks_and_dots_stay():
    square = short_path("M 60.48 141.84L 795.6 141.84L 795.6 30.24L 60.48 30.24z")
    assert square == "M60.5 141.8h735.1v-111.6h-735.1z"
    # A mark has curves, and a hundredth of a point.
    (circle,) = strokes_of(short_path("M 0 1.53C 0.41 1.53 0.79 1.37 1.08 1.08z"))
    np.testing.assert_allclose(circle, [[0.0, 1.53], [0.41, 1.53], [0.79, 1.37], [1.08, 1.08]], atol=1e-9)
    # A line of no length with round ends is a dot; two strokes stay two.
    assert short_path("M 5 5L 5.01 5M 6 5L 6.01 5") == "M5 5v0M6 5v0"
    # After z a path goes on at its beginning.
    assert strokes_of(short_path("M 1 1L 3 1L 3 2zM 4 4L 5 5"))[1].tolist() == [[4.0, 4.0], [5.0, 5.0]]


def test_a_long_line_keeps_the_extremes_of_each_pixel():
    random = np.random.default_rng(2)
    x = np.linspace(60.0, 250.0, 4000)
    y = 100.0 + random.normal(0.0, 5.0, len(x))
    y[1234] = 7.0  # one spike
    (stroke,) = strokes_of(short_path(path_of(x, y)))
    pixels = int(190.0 / 0.7)  # of 7 or 8 tenths
    assert len(stroke) < 2 * pixels + 4 and stroke[:, 1].min() == pytest.approx(7.0)
    width = round(10 * PIXEL_PT) / 10
    column, kept = (np.floor(np.round(10.0 * at) / (10.0 * width) + 1e-9) for at in (x, stroke[:, 0]))
    for one in np.unique(column)[1:-1]:
        before, after = np.round(y[column == one], 1), stroke[kept == one, 1]
        assert (after.min(), after.max()) == pytest.approx((before.min(), before.max()))
    # Both ends are where they were.
    np.testing.assert_allclose(stroke[[0, -1], 0], [60.0, 250.0], atol=0.05)


def test_styles_are_classes_which_mean_the_same_in_every_figure():
    line = '<path d="M 0 0L 1 1" style="fill: none; stroke: red"/>'
    area = '<path d="M 0 0L 1 1z" style="fill: red"/>'
    one, other = shorter(SVG.format(line + area)), shorter(SVG.format(area))
    rules = [dict(re.findall(r"\.(\w+)\{(.*?)\}", svg)) for svg in (one, other)]
    assert "style=" not in one and sorted(rules[0].values()) == ["fill: none; stroke: red", "fill: red"]
    assert set(rules[1].items()) <= set(rules[0].items())
    assert re.findall(r'class="(\w+)"', one) == list(rules[0])


def test_what_is_inside_of_its_frame_needs_none():
    frame = '<clipPath id="f"><rect x="1" y="1" width="4" height="4"/></clipPath>'
    path = '<path d="M 1 2L 5 {}" clip-path="url(#f)" style="fill: none"/>'
    assert "url(#f)" not in shorter(SVG.format(frame + path.format(5)))
    assert "{fill: none; clip-path: url(#f)}" in shorter(SVG.format(frame + path.format(5.2)))


def test_strokes_of_one_look_are_one_path_unless_they_are_seen_through():
    for style, count in (("fill: none", 1), ("fill: red", 2), ("fill: none; stroke-opacity: 0.5", 2)):
        path = f'<g><g/><path d="M 0 0L 1 0" style="{style}"/></g>\n<path d="M 0 1L 1 1" style="{style}"/>'
        svg = shorter(SVG.format(path))
        assert svg.count("<path") == count and "<g" not in svg and "\n" not in svg
    kept = shorter(SVG.format('<g id="a"><g><path d="M 0 0L 1 0"/></g><use xlink:href="#a"/></g>'))
    assert kept.count("<g") == kept.count("</g>") == 1


def test_a_figure_over_distance_is_small_and_whole():
    """Three panels of four lines of 1,400 points."""
    random = np.random.default_rng(3)
    x = np.linspace(0.0, 2000.0, 1400)
    with canvas.look():
        figure, axes = canvas.panels([1.4] * 3)
        for number, panel in enumerate(axes):
            for colour in ("#0072b2", "#d55e00", "#009e73", "#cc79a7"):
                panel.plot(x, random.normal(0.0, 1.0, len(x)), color=colour, label=f"{colour} {number}")
            panel.fill_between(x, -1.0, 1.0, alpha=0.3, lw=0)
        canvas.legend_above(*axes)
        text = canvas.to_svg(figure, description="<many> & long lines")
    assert len(text) < 125_000
    root = ElementTree.fromstring(text)
    assert {"style", "d"} & {name for one in root.iter() for name in one.attrib} == {"d"}
    references = set(re.findall(r"#([mp][0-9a-f]{10})\b", text))
    assert references == {one.attrib["id"] for one in root.iter() if "id" in one.attrib}
    used = {one.attrib["class"] for one in root.iter() if "class" in one.attrib}
    assert used == set(re.findall(r"\.(s\w{6})\{", text))
