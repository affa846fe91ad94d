"""SVG as matplotlib writes it made short: a page holds forty figures, each for a desk and for a phone.

What is left out cannot be seen. Places are kept to a tenth of a point (0.13 CSS pixels), paths go by relative
steps, a style is a class of the figure, groups that say nothing are gone, and of many points above one pixel
the lowest and the highest are kept. The figure is still whole by itself.
"""

import re
from base64 import b32encode
from functools import cache
from hashlib import blake2s
from itertools import groupby, pairwise

PIXEL_PT = 0.75
"""Width of a CSS pixel in points: lines are thinned to it."""

LONG = 100
"""Points from which on a line is thinned; what has fewer may be a shape, and stays as it is."""

SLACK_PT = 0.06
"""So much a path may seem to reach beyond its frame, by rounding alone."""

_RECT = ("x", "y", "width", "height")

_TENTHS, _HUNDREDTHS = 10, 100
"""Steps to a point: of lines, and of what has curves, which is a mark of some points in size."""

Place = tuple[int, int]
"""In steps."""


def shorter(svg: str) -> str:
    """An SVG element made short.

    Parameters
    ----------
    svg : str
        As matplotlib writes it, without comments and metadata.

    Returns
    -------
    str
        What looks the same. A class is named by a hash of its style: the rules of an inline figure hold for
        the whole page, so equal names must say equal things.
    """
    svg = re.sub(r' transform="rotate\(-?0 [^)]*\)"', "", svg)
    svg = re.sub(r' (x|y)="(-?[\d.]+)"', lambda at: f' {at[1]}="{_tenths(at[2])}"', svg)
    svg = _without_idle_frames(svg)
    svg = re.sub(r' d="([^"]*)"', lambda found: f' d="{short_path(found[1])}"', svg)
    return _joined_strokes(_with_classes(_without_idle_groups(svg)))


def short_path(path: str) -> str:
    """Data of a path by relative steps; a long line has the extremes of each pixel.

    Parameters
    ----------
    path : str
        Of the absolute commands M, L, Q, C and z, as matplotlib writes them.
    """
    per_point = _HUNDREDTHS if re.search("[QC]", path) else _TENTHS
    return "".join(_one_stroke(stroke, per_point) for stroke in re.findall("M[^M]*", path))


def _one_stroke(stroke: str, per_point: int) -> str:
    """What follows one M, up to the next."""
    (_, first), *commands = re.findall(r"([MLQCz])([^MLQCz]*)", stroke)
    begin = at = _places(first, per_point)[0]
    out = "M" + _joined(begin, per_point)
    for name, run in groupby(commands, key=lambda command: command[0]):
        numbers = [_places(text, per_point) for _, text in run]
        if name == "z":
            out, at = f"{out}z", begin
        elif name == "L":
            line = [at, *(place for (place,) in numbers)]
            out += _steps(thinned(line, round(PIXEL_PT * per_point)) if len(line) > LONG else line, per_point)
            at = line[-1]
        else:
            for places in numbers:
                relative = [coordinate for x, y in places for coordinate in (x - at[0], y - at[1])]
                out += name.lower() + _joined(relative, per_point)
                at = places[-1]
    return out


def thinned(line: list[Place], width: int) -> list[Place]:
    """Points of a line: of neighbours in one column of a width the lowest and the highest, and both ends."""
    kept = [line[0]]
    for _, run in groupby(line[1:-1], key=lambda place: place[0] // width):
        column = list(run)
        heights = [y for _, y in column]
        ends = sorted({heights.index(min(heights)), heights.index(max(heights))})
        kept += [column[end] for end in ends]
    return [*kept, line[-1]]


def _steps(line: list[Place], per_point: int) -> str:
    """Strokes of a line: along an axis by one number; the same letter is not repeated."""
    steps = [(x - a, y - b) for (a, b), (x, y) in pairwise(line)]
    # A line of no length is a dot, if its ends are round; beside other strokes it is nothing.
    steps = [step for step in steps if step != (0, 0)] or steps[:1]
    named = [("v", (y,)) if x == 0 else ("h", (x,)) if y == 0 else ("l", (x, y)) for x, y in steps]
    out = ""
    for name, run in groupby(named, key=lambda step: step[0]):
        out += name + _joined([number for _, numbers in run for number in numbers], per_point)
    return out


def _places(numbers: str, per_point: int) -> list[Place]:
    """Pairs of numbers, in steps."""
    values = [_step(text, per_point) for text in numbers.split()]
    return list(zip(values[::2], values[1::2], strict=True))


def _step(text: str, per_point: int) -> int:
    return round(float(text) * per_point)


@cache
def _written(steps: int, per_point: int) -> str:
    """Decimal of a number of steps, in points: without a zero before its point."""
    return re.sub(r"^(-?)0\.", r"\1.", f"{steps / per_point:.10g}")


def _tenths(text: str) -> str:
    return _written(_step(text, _TENTHS), _TENTHS)


def _joined(steps: list[int] | Place, per_point: int) -> str:
    """Numbers of a path, with a blank only where they would run together."""
    out, last = "", "."
    for number in steps:
        text = _written(number, per_point)
        parts_itself = text[0] == "-" or (text[0] == "." and "." in last)
        out += text if not out or parts_itself else f" {text}"
        last = text
    return out


def _without_idle_frames(svg: str) -> str:
    """Paths that lie in the frame that cuts them off without it: a grid, or a line without spikes."""
    frames = {}
    for name, tag in re.findall(r'<clipPath id="([\w-]+)">\s*(<rect[^>]*>)', svg):
        x, y, wide, tall = (float(re.search(rf' {key}="([^"]*)"', tag)[1]) for key in _RECT)  # type: ignore[index]
        frames[name] = (x, y, x + wide, y + tall)

    def freed(tag: re.Match[str]) -> str:
        path, cut = re.search(r' d="([^"]*)"', tag[0]), re.search(r' clip-path="url\(#([\w-]+)\)"', tag[0])
        if path is None or cut is None or cut[1] not in frames:
            return tag[0]
        numbers = [float(text) for text in re.findall(r"-?\d[\d.]*", path[1])]
        low_x, low_y, high_x, high_y = frames[cut[1]]
        inside = low_x - SLACK_PT <= min(numbers[::2]) and max(numbers[::2]) <= high_x + SLACK_PT
        inside = inside and low_y - SLACK_PT <= min(numbers[1::2]) and max(numbers[1::2]) <= high_y + SLACK_PT
        return tag[0].replace(cut[0], "") if inside else tag[0]

    svg = re.sub(r"<path [^>]*>", freed, svg)
    idle = [name for name in frames if f"url(#{name})" not in svg]
    for name in idle:
        svg = re.sub(rf'<clipPath id="{name}">.*?</clipPath>', "", svg, flags=re.DOTALL)
    return svg


def _joined_strokes(svg: str) -> str:
    """Strokes of one look that follow each other as one path; areas and what is seen through stay apart."""
    rules = dict(re.findall(r"\.(s[a-z2-7]{6})\{([^}]*)\}", svg))

    def joined(run: re.Match[str]) -> str:
        rule = rules[run[1]]
        if "fill: none" not in rule or "opacity" in rule:
            return run[0]
        strokes = "".join(re.findall(r' d="([^"]*)"', run[0]))
        return f'<path class="{run[1]}" d="{strokes}"/>'

    return re.sub(r'<path class="(s[a-z2-7]{6})" d="[^"]*"/>(?:<path class="\1" d="[^"]*"/>)+', joined, svg)


def _without_idle_groups(svg: str) -> str:
    """Without groups that have no attributes, and without line breaks between elements."""
    out, idle = [], []
    for part in re.findall(r"<[^>]+>|[^<]+", svg):
        if part == "<g/>" or (part.isspace() and "\n" in part):
            continue
        if re.match(r"<g\b[^/]*>$", part) or part.startswith("<g "):
            idle.append(part == "<g>")
        if part == "<g>" or (part == "</g>" and idle.pop()):
            continue
        out.append(part)
    return "".join(out).replace("<defs></defs>", "")


def _with_classes(svg: str) -> str:
    """With styles, and what is cut off by which frame, as classes of the figure."""
    rules: dict[str, str] = {}

    def classed(tag: re.Match[str]) -> str:
        style, frame = (re.search(rf' {name}="([^"]*)"', tag[0]) for name in ("style", "clip-path"))
        if style is None and frame is None:
            return tag[0]
        words = [] if style is None else [style[1].rstrip("; ")]
        words += [] if frame is None else [f"clip-path: {frame[1]}"]
        rule = "; ".join(words)
        name = "s" + b32encode(blake2s(rule.encode(), digest_size=5).digest()).decode()[:6].lower()
        rules[name] = rule
        bare = re.sub(r' (style|clip-path)="[^"]*"', "", tag[0])
        return re.sub(r"^<(\w+)", rf'<\1 class="{name}"', bare)

    svg = re.sub(r"<[a-zA-Z][^>]*>", classed, svg)
    sheet = "".join(f".{name}{{{rule}}}" for name, rule in rules.items())
    return svg.replace("</style>", f"{sheet}</style>", 1)
