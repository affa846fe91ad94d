"""A film as an animated picture for slides: drawn by Pillow, which is wherever matplotlib is.

It shows what the page shows (`simrail.report.film.film.js`), smaller and for one method: the vehicle in
perspective with its deviations from the design line enlarged, the horizon, and the roll over time.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from simrail.core.atomic_files import write_whole
from simrail.core.jit import FloatArray
from simrail.core.rotation import rotation_matrix
from simrail.report.film.film import FRAME_HZ, Film
from simrail.report.film.shapes import Box, Disc, boxes_of, discs_of, scale_of

WIDTH, HEIGHT = 720, 405
"""Size of the picture, in dots."""

GIF_HZ = 12.5
"""Pictures per second: a GIF counts hundredths of a second, browsers slow down what is faster than 20, and it
is every second frame of the film."""

MOST_PICTURES = 150
"""Of a longer piece fewer pictures per second of the ride are drawn: it plays faster."""

TIMES = 5.0
"""Deviations from the design line are drawn so much enlarged."""

_FINER = 2
"""Drawn so much larger and then made smaller, which smooths the edges."""

_SKY, _GROUND, _BALLAST, _SLEEPER = "#cfe3f2", "#c6d1b5", "#a39b8f", "#7d7265"
_INK, _TRUE, _ESTIMATED, _LINE = "#1b2430", "#0b7a55", "#d1481b", "#d9dfe7"
_TINTS = {"axle": (89, 99, 111), "frame": (208, 122, 35), "car": (47, 127, 184), "disc": (136, 147, 160)}
_SUN = np.array([0.35, 0.45, 0.82]) / np.linalg.norm([0.35, 0.45, 0.82])
_NEAR_M = 0.3


def write_gif(path: Path, film: Film) -> Path:
    """Write a film as an animated picture.

    Parameters
    ----------
    path : Path
        File to write.
    film : Film
        What is shown; its first method is.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    rows = range(0, len(film.time_s), _every(film))
    pictures = [_picture(film, row) for row in rows]
    # One palette for all: colours that change from picture to picture flicker, and cost place.
    palette = pictures[len(pictures) // 2].quantize(96)
    plain = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    stream = io.BytesIO()
    # Of a piece that is thinned out each picture still stays as long as any other.
    plain[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=plain[1:],
        duration=round(1e3 / GIF_HZ),
        loop=0,
        optimize=False,
    )
    return write_whole(path, stream.getvalue(), what="film")


def pace(film: Film) -> float:
    """How much faster than the ride the picture plays."""
    return _every(film) * GIF_HZ / FRAME_HZ


def _every(film: Film) -> int:
    """Frames of the film from one picture to the next."""
    return max(round(FRAME_HZ / GIF_HZ), -(-len(film.time_s) // MOST_PICTURES))


@dataclass(frozen=True)
class _Camera:
    """An eye behind and above the vehicle; projects points of the world (n, 3) into the picture."""

    place: FloatArray
    axes: FloatArray
    focal: float

    def depth(self, points: FloatArray) -> FloatArray:
        depth: FloatArray = (points - self.place) @ self.axes[0]
        return depth

    def project(self, points: FloatArray) -> FloatArray:
        """Dots (n, 2); NaN behind the eye."""
        seen = (points - self.place) @ self.axes.T
        far = np.where(seen[:, 0] > _NEAR_M, seen[:, 0], np.nan)
        x = _FINER * WIDTH / 2 + self.focal * seen[:, 1] / far
        y = _FINER * HEIGHT * 0.42 - self.focal * seen[:, 2] / far
        return np.column_stack([x, y])


def _picture(film: Film, row: int) -> Image.Image:
    """One picture."""
    image = Image.new("RGB", (_FINER * WIDTH, _FINER * HEIGHT), _GROUND)
    pen = ImageDraw.Draw(image, "RGBA")
    camera = _camera(film, row)
    _draw_line(film, pen, camera, row)
    _draw_vehicle(film, pen, camera, row)
    _draw_horizon(film, pen, row)
    _draw_strip(film, pen, row)
    words = (
        f"{film.scenario}   s = {film.reference_m[row]:.0f} m   deviations \N{MULTIPLICATION SIGN} {TIMES:g}"
    )
    pen.text((_FINER * 12, _FINER * 8), words, fill=_INK, font=_font(13))
    return image.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)


@cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    """The font that comes with matplotlib."""
    return ImageFont.truetype(
        str(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"), _FINER * size
    )


def _on_track(film: Film, s: FloatArray, y: FloatArray | float, z: FloatArray | float) -> FloatArray:
    """Points (n, 3) of the world from places along the track, to the left and over the rails."""
    track = film.rails.design
    frame = track.frame(np.clip(s, track.start_m, track.end_m))
    beside = np.column_stack(np.broadcast_arrays(0.0 * s, y, z))
    points: FloatArray = frame.position + np.einsum("nij,nj->ni", frame.rotation, beside)
    return points


def _camera(film: Film, row: int) -> _Camera:
    size, reach = scale_of(film.vehicle), film.vehicle.reach_m
    s = film.reference_m[row]
    frame = film.rails.design.frame(np.array([s]))
    target = frame.position[0] + np.array([0.0, 0.0, 0.8 * size])
    far, azimuth, elevation = (6.2 + 1.9 * (reach[1] - reach[0]) / size) * size, frame.yaw_rad[0] + 0.62, 0.27
    place = target + far * np.array(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)]
    )
    forward = (target - place) / far
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return _Camera(place, np.stack([forward, right, np.cross(right, forward)]), 0.9 * _FINER * WIDTH)


def _fill(pen: ImageDraw.ImageDraw, dots: FloatArray, fill: str | tuple[int, ...]) -> None:
    """A polygon, unless a corner is behind the eye."""
    if np.isfinite(dots).all():
        pen.polygon([tuple(dot) for dot in dots], fill=fill)


def _ribbon(pen: ImageDraw.ImageDraw, camera: _Camera, a: FloatArray, b: FloatArray, fill: str) -> None:
    """A strip between two edges, those parts of it that are before the eye."""
    left, right = camera.project(a), camera.project(b)
    both: FloatArray = left.sum(axis=1) + right.sum(axis=1)  # NaN where one of them is
    good = np.isfinite(both)
    for first in np.flatnonzero(np.logical_and(good[:-1], good[1:])):
        _fill(pen, np.array([left[first], left[first + 1], right[first + 1], right[first]]), fill)


def _draw_line(film: Film, pen: ImageDraw.ImageDraw, camera: _Camera, row: int) -> None:
    """Sky, ballast, sleepers and rails."""
    size, s = scale_of(film.vehicle), film.reference_m[row]
    forward, up = camera.axes[0], camera.axes[2]
    level = np.array([forward[0], forward[1], 0.0]) / np.hypot(forward[0], forward[1])
    horizon = _FINER * HEIGHT * 0.42 - camera.focal * (up @ level) / (forward @ level)
    pen.rectangle((0, 0, _FINER * WIDTH, max(horizon, 0.0)), fill=_SKY)
    track = film.rails.design
    grid = s + size * np.concatenate([np.arange(-90.0, -16.0, 2.0), np.arange(-16.0, 16.0, 0.4)])
    grid = grid[(grid > track.start_m) & (grid < track.end_m)]
    _ribbon(
        pen,
        camera,
        _on_track(film, grid, 1.7 * size, -0.2 * size),
        _on_track(film, grid, -1.7 * size, -0.2 * size),
        _BALLAST,
    )
    step = 0.6 * size
    sleepers = step * np.arange(np.ceil((s - 40.0 * size) / step), np.floor((s + 16.0 * size) / step))
    sleepers = sleepers[(sleepers > track.start_m) & (sleepers < track.end_m - size)]
    corners = [
        camera.project(_on_track(film, sleepers + x * size, y * size, -0.18 * size))
        for x, y in ((-0.12, -1.28), (0.12, -1.28), (0.12, 1.28), (-0.12, 1.28))
    ]
    for quad in np.stack(corners, axis=1):
        _fill(pen, quad, _SLEEPER)
    half, wide = film.vehicle.wheel_rail.tape_circle_half_m, 0.036 * size
    bent = TIMES * film.rails.rails(grid)
    for side, k in ((1.0, 0), (-1.0, 2)):
        y, z = side * half + bent[:, k], bent[:, k + 1]
        for edge in (wide, -wide):
            _ribbon(
                pen,
                camera,
                _on_track(film, grid, y + edge, z),
                _on_track(film, grid, y + 0.5 * edge, z - 0.16 * size),
                "#454d57",
            )
        _ribbon(
            pen, camera, _on_track(film, grid, y + wide, z), _on_track(film, grid, y - wide, z), "#e8edf2"
        )


def _draw_vehicle(film: Film, pen: ImageDraw.ImageDraw, camera: _Camera, row: int) -> None:
    """Frames, axles and wheels from the farthest on, then the car bodies as glass."""
    poses = {name: _pose(film, name, row) for name in film.poses}
    boxes = [box for box in boxes_of(film.vehicle) if box.body in poses]
    items: list[tuple[float, Box | Disc]] = [
        (float(camera.depth(_placed(poses[box.body], box.corners).mean(axis=0))), box)
        for box in boxes
        if box.kind in ("axle", "frame")
    ]
    for disc in discs_of(film.vehicle):
        if disc.body in poses:
            middle = _placed(poses[disc.body], np.array([disc.middle_m]))
            items.append((float(camera.depth(middle)[0]), disc))
    for _, item in sorted(items, key=lambda pair: -pair[0]):
        if isinstance(item, Box):
            _draw_box(pen, camera, poses[item.body], item)
        else:
            _draw_disc(pen, camera, poses[item.body], item, film.turns_rad[item.wheel][row])
    for box in boxes:
        if box.kind == "car":
            _draw_box(pen, camera, poses[box.body], box, glass=True)


def _pose(film: Film, name: str, row: int) -> tuple[FloatArray, FloatArray]:
    """Place and axes of a body, its deviations enlarged."""
    s, lateral, vertical, *angles = film.poses[name][row]
    rest = film.vehicle.body(name).position_m[2]
    track = film.rails.design
    frame = track.frame(np.array([np.clip(s, track.start_m, track.end_m)]))
    turned = rotation_matrix(TIMES * np.array([angles]))[0]
    place = np.array([0.0, TIMES * lateral, rest + TIMES * (vertical - rest)])
    return frame.position[0] + frame.rotation[0] @ place, frame.rotation[0] @ turned


def _placed(pose: tuple[FloatArray, FloatArray], points: FloatArray) -> FloatArray:
    placed: FloatArray = pose[0] + points @ pose[1].T
    return placed


def _shade(kind: str, normal: FloatArray, alpha: int = 255) -> tuple[int, ...]:
    light = 0.62 + 0.48 * max(float(normal @ _SUN), -0.2)
    return (*(min(255, int(light * value)) for value in _TINTS[kind]), alpha)


def _draw_box(
    pen: ImageDraw.ImageDraw,
    camera: _Camera,
    pose: tuple[FloatArray, FloatArray],
    box: Box,
    *,
    glass: bool = False,
) -> None:
    corners = _placed(pose, box.corners)
    for face in box.faces:
        points = corners[list(face)]
        normal = np.cross(points[1] - points[0], points[2] - points[1])
        normal /= np.linalg.norm(normal)
        if normal @ (points[0] - camera.place) > 0.0:
            continue
        dots = camera.project(points)
        if not np.isfinite(dots).all():
            continue
        fill = _shade(box.kind, normal, 90 if glass else 255)
        pen.polygon([tuple(dot) for dot in dots], fill=fill, outline=(30, 85, 125, 255) if glass else fill)


def _draw_disc(
    pen: ImageDraw.ImageDraw, camera: _Camera, pose: tuple[FloatArray, FloatArray], disc: Disc, turn: float
) -> None:
    """A wheel: flange, tread and the face that is seen, with spokes and a mark."""
    around = np.linspace(0.0, 2.0 * np.pi, 33)[:-1]
    outer, inner = 0.5 * disc.side * disc.width_m, -0.5 * disc.side * disc.width_m

    def ring(offset: float, radius: float) -> FloatArray:
        points = np.column_stack([np.sin(around), 0.0 * around, np.cos(around)]) * radius
        return _placed(pose, points + np.array(disc.middle_m) + np.array([0.0, offset, 0.0]))

    axis = disc.side * pose[1][:, 1]
    is_outside = axis @ (camera.place - _placed(pose, np.array([disc.middle_m]))[0]) > 0.0
    near, far = (outer, inner) if is_outside else (inner, outer)
    flange = disc.radius_m + disc.flange_m
    radii = (flange, disc.radius_m) if is_outside else (disc.radius_m, flange)
    normal = axis if is_outside else -axis
    _fill(pen, camera.project(ring(far, radii[0])), (90, 98, 108))
    a, b = camera.project(ring(far, disc.radius_m)), camera.project(ring(near, disc.radius_m))
    for i in range(len(around)):
        j = (i + 1) % len(around)
        _fill(pen, np.array([a[i], a[j], b[j], b[i]]), (112, 121, 133))
    _fill(pen, camera.project(ring(near, radii[1])), _shade("disc", normal))
    for k in range(6):
        angle = turn + k * np.pi / 3.0 + np.array([-0.22, -0.3, 0.3, 0.22])
        radius = disc.radius_m * np.array([0.26, 0.76, 0.76, 0.26])
        blade = np.column_stack([radius * np.sin(angle), 0.0 * angle, radius * np.cos(angle)])
        points = _placed(pose, blade + np.array(disc.middle_m) + np.array([0.0, near, 0.0]))
        _fill(pen, camera.project(points), (236, 240, 245) if k == 0 else (78, 86, 96))


def _draw_horizon(film: Film, pen: ImageDraw.ImageDraw, row: int) -> None:
    """True and estimated horizon of the IMU's body in a round window, enlarged ten times."""
    x, y, r = _FINER * (WIDTH - 78), _FINER * 82, _FINER * 62
    pen.ellipse((x - r, y - r, x + r, y + r), fill=(255, 255, 255, 235), outline=_LINE, width=3)
    lines = [(film.true_rad, _TRUE, 6)]
    lines += [(values, _ESTIMATED, 4) for values in list(film.estimated_rad.values())[:1]]
    for values, colour, width in lines:
        roll, pitch = 10.0 * values[row]
        dx, dy = r * np.cos(roll), -r * np.sin(roll)
        up = -np.clip(pitch, -0.5, 0.5) * r
        pen.line((x - dx, y - dy + up, x + dx, y + dy + up), fill=colour, width=width)
    pen.line((x - r // 3, y, x + r // 3, y), fill=_INK, width=4)
    true, *estimated = (np.rad2deg(values[row, 0]) for values, _, _ in lines)
    pen.text((x, y + r + 8), f"roll {true:+.2f}\N{DEGREE SIGN}", fill=_TRUE, font=_font(11), anchor="ma")
    for angle in estimated:
        words = f"{next(iter(film.estimated_rad))} {angle:+.2f}\N{DEGREE SIGN}"
        pen.text((x + r + 8, y + r + 42), words, fill=_ESTIMATED, font=_font(11), anchor="ra")


def _draw_strip(film: Film, pen: ImageDraw.ImageDraw, row: int) -> None:
    """Roll, true and estimated, over the piece, with a cursor."""
    left, right, top, bottom = (_FINER * v for v in (12, WIDTH - 12, HEIGHT - 92, HEIGHT - 10))
    pen.rectangle((left, top, right, bottom), fill=(255, 255, 255, 225), outline=_LINE)
    lines = [(film.true_rad[:, 0], _TRUE, 5)]
    lines += [(values[:, 0], _ESTIMATED, 3) for values in list(film.estimated_rad.values())[:1]]
    low, high = (f(values.min() if f is min else values.max() for values, _, _ in lines) for f in (min, max))
    span = max(high - low, 1e-4)
    every = max(1, len(film.time_s) // 700)
    x = np.linspace(left, right, len(film.time_s))
    for values, colour, width in lines:
        y = bottom - (0.1 + 0.74 * (values - low) / span) * (bottom - top)
        pen.line(list(zip(x[::every], y[::every], strict=True)), fill=colour, width=width, joint="curve")
    pen.line((x[row], top, x[row], bottom), fill=_INK, width=3)
    pen.text((left + 8, top + 4), "roll", fill=_INK, font=_font(11))
