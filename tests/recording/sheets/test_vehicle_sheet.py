"""Chords of a drawing against bodies that are laid on a line by hand: axles on it, frames on axles."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from simrail.recording.sheets.vehicle_sheet import Chord, SheetBody, Support, VehicleSheet


def bogie(name: str, x: float, half: float) -> tuple[SheetBody, ...]:
    axles = (SheetBody(f"{name}.f", x + half), SheetBody(f"{name}.r", x - half))
    supports = (Support(f"{name}.f", half), Support(f"{name}.r", -half))
    return (*axles, SheetBody(name, x, supports))


CAR = VehicleSheet(
    (
        *bogie("front", 9.0, 1.2),
        *bogie("rear", -7.0, 0.8),
        SheetBody("body", 0.5, (Support("front", 8.5), Support("rear", -7.5))),
    )
)
BOGIES = (("front", 9.0), ("rear", -7.0))
ARTICULATED = VehicleSheet(
    (
        *bogie("one", 6.0, 0.9),
        *bogie("two", -5.0, 0.7),
        SheetBody("head", 7.0, (Support("one", -1.0),)),
        SheetBody("tail", -6.0, (Support("two", 1.0),)),
        SheetBody("middle", 0.25, (Support("head", 2.75), Support("tail", -3.25))),
    )
)


def cubic(x: float) -> float:
    return 1e-4 * x**3 + 3e-3 * x**2 - 0.02 * x + 0.3


def same(chord: Chord | None, *numbers: float) -> bool:
    return chord is not None and astuple(chord)[:5] == pytest.approx(numbers, abs=1e-12)


def straight_through(places: list[float], offsets: list[float]) -> tuple[float, float]:
    """Offset and slope of the straight line through two points."""
    slope = (offsets[0] - offsets[1]) / (places[0] - places[1])
    return offsets[0] - slope * places[0], slope


def laid(sheet: VehicleSheet, line) -> dict[str, tuple[float, float]]:
    """Each body of two supports as a straight line (offset, slope) along the vehicle, from the axles up."""
    lines: dict[str, tuple[float, float]] = {}
    for body in sheet.bodies:
        places, offsets = [], []
        for support in body.supports:
            x = body.x_m + support.x_m
            places.append(x)
            offsets.append(np.polyval(lines[support.on][::-1], x) if support.on in lines else line(x))
        if len(body.supports) == 2:
            lines[body.name] = straight_through(places, offsets)
        elif len(body.supports) == 1 and body.supports[0].on in lines:
            lines[body.name] = lines[body.supports[0].on]
    return lines


def heading(chord: Chord, x_m: float, line) -> float:
    """Heading of a body at x along the vehicle by the formula in the docstring of `Chord`."""
    c, h, w = x_m + chord.centre_m, chord.half_m, chord.half_wheelbase_m
    front = 0.5 * (line(c + h - w) + line(c + h + w))
    return (front - 0.5 * (line(c - h - w) + line(c - h + w))) / (2.0 * h)


@pytest.mark.parametrize("name", ["front", "rear", "body"])
def test_a_body_points_from_support_to_support(name: str) -> None:
    """On a cubic. Bogies of unlike wheelbase (1.2, 0.8) count as two of their mean: the exact heading has
    1.2^2 and 0.8^2 where the chord has 1.0^2, an error of y''/2 (1.44 - 0.64) / (2 h) at most."""
    chord = CAR.chord(name)
    x = CAR.body(name).x_m
    exact = laid(CAR, cubic)[name][1]
    unlike = 0.5 * (6e-3 + 6e-4 * 10.0) * 0.8 / (2.0 * chord.half_m) if name == "body" else 0.0
    assert heading(chord, x, cubic) == pytest.approx(exact, abs=unlike + 1e-12)


def test_a_body_on_alike_bogies_is_exact_on_a_cubic() -> None:
    alike = VehicleSheet(
        (
            *bogie("front", 9.0, 1.2),
            *bogie("rear", -7.0, 1.2),
            SheetBody("body", 0.5, (Support("rear", -7.5), Support("front", 8.5))),
        )
    )
    assert same(alike.chord("body"), 0.5, 8.0, 1.2, 0.02, 0.0)
    assert heading(alike.chord("body"), 0.5, cubic) == pytest.approx(laid(alike, cubic)["body"][1], abs=1e-12)


def test_an_axle_points_along_its_frame() -> None:
    """The leading axle of a bogie has its frame's middle behind it."""
    frame = CAR.chord("front")
    assert same(CAR.chord("front.f"), -1.2, 1.2, 0.0, 0.02, frame.play_m)
    assert same(CAR.chord("front.r"), 1.2, 1.2, 0.0, 0.02, frame.play_m)
    axle, place = CAR.chord("rear.r"), CAR.body("rear.r").x_m
    assert heading(axle, place, cubic) == pytest.approx(heading(CAR.chord("rear"), -7.0, cubic), abs=1e-15)


def test_a_body_on_one_bogie_points_along_it() -> None:
    chord = ARTICULATED.chord("head")
    assert same(chord, -1.0, 0.9, 0.0, 0.02, 0.9)
    assert heading(chord, 7.0, cubic) == pytest.approx(laid(ARTICULATED, cubic)["head"][1], abs=1e-12)


def test_a_body_between_two_points_from_joint_to_joint() -> None:
    chord = ARTICULATED.chord("middle")
    assert (chord.centre_m, chord.half_m, chord.half_wheelbase_m) == (-0.25, 3.0, 0.0)


def test_hung_bodies_on_two_bogies_are_a_section() -> None:
    """From bogie to bogie, seen from each body; of a bogie, an axle and a car by itself there is none."""
    for name, x in (("head", 7.0), ("middle", 0.25), ("tail", -6.0)):
        assert same(ARTICULATED.section(name), 0.5 - x, 5.5, 0.8, 0.02, 0.0), name
    assert [ARTICULATED.section(name) for name in ("one", "one.f", "nobody")] == [None] * 3
    assert [CAR.section(name) for name in ("body", "front")] == [None] * 2


def test_hung_bodies_on_more_bogies_lie_by_least_squares() -> None:
    """On a cubic, through the bogies' middles: numpy's straight line."""
    hung = SheetBody("more", -9.5, (Support("tail", -2.5), Support("last", 1.5)))
    more = (
        *bogie("three", -13.0, 0.7),
        *ARTICULATED.bodies,
        SheetBody("last", -12.0, (Support("three", -1.0),)),
    )
    longer, places = VehicleSheet((*more, hung)), np.array([6.0, -5.0, -13.0])
    for name, x in (("head", 7.0), ("tail", -6.0), ("last", -12.0), ("more", -9.5)):
        section = longer.section(name)
        slope = sum(weight * cubic(x + at) for at, weight in section.weights)
        assert slope == pytest.approx(np.polyfit(places, cubic(places), 1)[0], abs=1e-12), name


def test_what_lies_right_over_its_support_does_not_hang() -> None:
    """A car body on bolsters over its bogies is no section."""
    bolsters = tuple(SheetBody(f"{name} bolster", x, (Support(name, 0.0),)) for name, x in BOGIES)
    body = SheetBody("body", 0.5, (Support("front bolster", 8.5), Support("rear bolster", -7.5)))
    sheet = VehicleSheet((*CAR.bodies[:6], *bolsters, body))
    assert [sheet.section(name) for name in ("body", "front bolster")] == [None] * 2


def test_stiffness_turns_a_body_where_the_drawing_says_it() -> None:
    """A frame that points half along its own axles and half along the car: the sum over the axles."""
    own, car = 1.0 / 2.4, 1.0 / 32.0
    turned = (
        ("front.f", 0.5 * own + 0.5 * car),
        ("front.r", -0.5 * own + 0.5 * car),
        ("rear.f", -0.5 * car),
        ("rear.r", -0.5 * car),
    )
    bodies = tuple(replace(body, turned_by=turned) if body.name == "front" else body for body in CAR.bodies)
    sheet = VehicleSheet(bodies)
    chord, plain, x = sheet.chord("front"), CAR.chord("front"), 9.0
    at = {body.name: body.x_m for body in bodies}
    wanted = sum(weight * cubic(at[axle]) for axle, weight in turned)
    found = sum(weight * cubic(x + chord.centre_m + offset) for offset, weight in chord.held_at)
    assert found == pytest.approx(wanted, abs=1e-14)
    # On an arc y = x^2 / 2 about the body: the tangent at the chord's centre.
    assert sum(0.5 * w * (o + chord.centre_m) ** 2 for o, w in chord.held_at) == pytest.approx(chord.centre_m)
    assert chord.shift_sd_m == pytest.approx(0.2 * abs(chord.centre_m - plain.centre_m))
    assert (chord.half_m, chord.play_m) == (plain.half_m, plain.play_m)
    # The axles of a turned frame keep their own, and by their supports a chord's formula is the same sum.
    assert sheet.chord("front.f") == CAR.chord("front.f")
    chord = CAR.chord("body")
    sums = sum(weight * cubic(0.5 + chord.centre_m + offset) for offset, weight in chord.held_at)
    assert sums == pytest.approx(heading(chord, 0.5, cubic), abs=1e-14)


def test_what_nothing_guides_points_along_the_track() -> None:
    tangent = Chord(0.0, 0.0, 0.0, 0.05)
    shared = VehicleSheet(
        (
            SheetBody("axle", 4.0),
            SheetBody("a", 0.0, (Support("axle", 4.0),)),
            SheetBody("b", 8.0, (Support("axle", -4.0),)),
        ),
        place_sd_m=0.05,
    )
    assert shared.chord("axle") == tangent  # two bodies share it, none guides it
    assert shared.chord("a") == Chord(4.0, 0.0, 0.0, 0.05)
    assert VehicleSheet((SheetBody("wheelset"),), 0.05).chord("wheelset") == tangent


def test_nothing_is_known_of_a_body_off_the_drawing() -> None:
    assert CAR.chord("roof") is None
    assert CAR.body("roof") is None


def test_bearers_abreast_are_one() -> None:
    sheet = VehicleSheet(
        (
            *bogie("l", 0.0, 1.0),
            *bogie("r", 0.0, 1.0),
            SheetBody("body", 1.0, (Support("l", -1.0), Support("r", -1.0))),
        )
    )
    assert same(sheet.chord("body"), -1.0, 1.0, 0.0, 0.02, 1.0)


@pytest.mark.parametrize("sheet", [CAR, ARTICULATED])
@pytest.mark.parametrize("forward", [1.0, -1.0])
def test_play_is_how_far_the_chord_moves_once_trailing_axles_stand_radially(sheet, forward: float) -> None:
    """In a curve of unit curvature, where a place that is d farther back has a heading smaller by d."""

    def arc(x: float) -> float:
        return 0.5 * x**2

    middle = laid(sheet, arc)
    lines: dict[str, tuple[float, float]] = {}
    for body in sheet.bodies:
        on_axles = body.supports and all(not sheet.body(s.on).supports for s in body.supports)
        if on_axles:  # turned about its middle, to the tangent at its trailing axle
            trailing = min(s.x_m for s in body.supports) if forward > 0 else max(s.x_m for s in body.supports)
            slope = body.x_m + trailing  # y' = x
            offset, held = middle[body.name]
            lines[body.name] = offset + (held - slope) * body.x_m, slope
        elif len(body.supports) == 1:
            lines[body.name] = lines[body.supports[0].on]
        elif body.supports:
            places = [body.x_m + s.x_m for s in body.supports]
            offsets = [
                lines[s.on][0] + lines[s.on][1] * x for s, x in zip(body.supports, places, strict=True)
            ]
            lines[body.name] = straight_through(places, offsets)
    for name in lines:
        moved = lines[name][1] - middle[name][1]
        assert moved == pytest.approx(-forward * sheet.chord(name).play_m, abs=1e-12), name
