"""Drawings of simulated vehicles against figures worked out by hand from their files, and against rides."""

from dataclasses import astuple, replace
from types import SimpleNamespace

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.core.toml_files import load, shipped
from simrail.recording.sheets.vehicle_sheet import Support
from simrail.ride.ride import Ride, simulate
from simrail.ride.truth import Truth
from simrail.scenario.build import NO_IRREGULARITY
from simrail.sensors.drawing import _bearings, drawing
from simrail.track.design import Curve, Straight, TrackDesign, Transition
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.model import Body, Rod, SeriesDamper, Suspension, VehicleModel
from simrail.vehicle.speed_profile import SpeedProfile


def model_of(name: str) -> VehicleModel:
    return load(VehicleFile, "vehicle", name).model(name)


def four_axled(half: float, bogie: float) -> dict[str, tuple[float, float, float, float]]:
    """Car on two bogies: half the distance of its pivots, half the wheelbase of a bogie."""
    leading, trailing = (-bogie, bogie, 0.0, bogie), (bogie, bogie, 0.0, bogie)
    frame = (0.0, bogie, 0.0, bogie)
    return {
        "axle_f1": leading,
        "axle_f2": trailing,
        "axle_r1": leading,
        "axle_r2": trailing,
        "frame_front": frame,
        "frame_rear": frame,
        "body": (0.0, half, bogie, 0.0),
    }


TANGENT = (0.0, 0.0, 0.0, 0.0)

CHORDS = {
    # One axle under one body: each points along the track at its place.
    "irw_axle": {"axle": TANGENT, "body": TANGENT},
    # Air springs at +-8.75; axles at 10 and 7.5.
    "irw_car": four_axled(8.75, 1.25),
    # Secondary springs at +-9.5; axles at 10.78 and 8.22.
    "manchester_1": four_axled(9.5, 1.28),
    # Air springs at +-7.85; axles at 9.1 and 6.6.
    "metro_car_gz18": four_axled(7.85, 1.25),
    # Springs at 0.5 and -0.5 bear in the middle: the body rests on its one bogie, at 0.
    "metro_irw_bogie": {
        "front": (-0.9, 0.9, 0.0, 0.9),
        "rear": (0.9, 0.9, 0.0, 0.9),
        "frame": (0.0, 0.9, 0.0, 0.9),
        "body": (0.0, 0.9, 0.0, 0.9),
    },
    # End bodies have their reference points at +-6.64 and their bogies at +-5.8. The middle hangs at +-3 of
    # bodies that turn about 5.8: once these turn by 0.9 kappa, its joints move by 0.9 (5.8 - 3) kappa to both
    # sides, and it turns by 2 * 2.52 / 6 = 0.84 kappa the other way.
    "metro_irw_train": four_axled(0.0, 0.9)
    | {
        "body_front": (-0.84, 0.9, 0.0, 0.9),
        "body_rear": (0.84, 0.9, 0.0, 0.9),
        "body_middle": (0.0, 3.0, 0.0, -0.84),
    },
    # Springs at +-0.5; axles at 0.6 and 0.4.
    "scale_vehicle": four_axled(0.5, 0.1),
    # The guide holds the carrier, no spring bears.
    "suspended_wheelset": {"axle": TANGENT, "carrier": TANGENT},
    "two_axle_wagon": {
        "front": (-3.0, 3.0, 0.0, 3.0),
        "rear": (3.0, 3.0, 0.0, 3.0),
        "body": (0.0, 3.0, 0.0, 3.0),
    },
}
"""Centre, half length, half the wheelbase below, play of the chord of every body."""
del CHORDS["metro_irw_train"]["body"]

PRIMARY = {
    "irw_axle": (4 * 300e3, 4 * 6e3),
    "irw_car": (4 * 830e3, 4 * 7e3),
    "manchester_1": (2 * 1.22e6, 2 * 4e3),  # its damper is on elastic mounts
    "metro_car_gz18": (2 * 1.4e6, 2 * 10e3),  # its trailing arms bear nothing
    "metro_irw_bogie": (4 * 0.6e6, 4 * 4e3),
    "metro_irw_train": (4 * 0.6e6, 4 * 4e3),
    "scale_vehicle": (2 * 12e3, 2 * 20.0),
    "suspended_wheelset": (None, None),
    "two_axle_wagon": (2 * 1e6, 2 * 5e3),  # dry friction apart
}
"""Vertical stiffness and damping over an axle."""


def test_every_shipped_vehicle_is_here() -> None:
    assert set(CHORDS) == set(PRIMARY) == set(shipped("vehicle"))


@pytest.mark.parametrize("name", CHORDS)
def test_every_mount_of_every_shipped_vehicle_has_its_chord(name: str) -> None:
    model = model_of(name)
    sheet = drawing(model)
    assert {body.name for body in sheet.bodies} == set(CHORDS[name]) == set(model.body_names)
    sd = 0.002 if name == "scale_vehicle" else 0.02
    assert sheet.place_sd_m == pytest.approx(sd)
    for body, (centre, half, wheelbase, play) in CHORDS[name].items():
        chord = replace(sheet, bodies=tuple(replace(b, turned_by=()) for b in sheet.bodies)).chord(body)
        assert chord is not None
        assert astuple(chord)[:5] == pytest.approx((centre, half, wheelbase, sd, play), abs=1e-9), body


def test_only_where_axles_yaw_in_their_rods_stiffness_turns_a_body() -> None:
    turned = {
        (name, body.name) for name in CHORDS for body in drawing(model_of(name)).bodies if body.turned_by
    }
    axles = {f"axle_{end}{number}" for end in "fr" for number in "12"}
    assert turned == {("irw_car", name) for name in axles | {"frame_front", "frame_rear"}}


@pytest.mark.parametrize("name", PRIMARY)
def test_primary_stiffness_and_damping_are_those_of_an_axle(name: str) -> None:
    model = model_of(name)
    for body in drawing(model).bodies:
        expected = PRIMARY[name] if body.name in model.axle_names else (None, None)
        assert (body.primary_stiffness_npm, body.primary_damping_nspm) == pytest.approx(expected), body.name


def test_which_axles_are_wheelsets() -> None:
    """By the vehicle files: fixed wheels on both cars and on the wagon, independent ones on the others."""
    for name, fixed in (("manchester_1", True), ("metro_car_gz18", True), ("metro_irw_train", False)):
        axles = [body for body in drawing(model_of(name)).bodies if not body.supports]
        assert {axle.wheelset for axle in axles} == {fixed}
        assert {body.wheelset for body in drawing(model_of(name)).bodies if body.supports} == {None}


def test_bodies_stand_after_those_that_they_rest_on() -> None:
    """Whatever the order of the model: here the body that hangs between its neighbours comes first."""
    model = model_of("metro_irw_train")
    turned = replace(model, bodies=model.bodies[::-1])
    sheet = drawing(turned)
    names = [body.name for body in sheet.bodies]
    for body in sheet.bodies:
        assert all(names.index(s.on) < names.index(body.name) for s in body.supports)
    assert {body.name: body for body in sheet.bodies} == {body.name: body for body in drawing(model).bodies}


def test_the_order_of_two_bodies_in_a_spring_does_not_matter() -> None:
    """Nor do springs between the same two bodies that are written either way round."""
    model = model_of("manchester_1")
    turned = tuple(
        replace(spring, inner=spring.outer, outer=spring.inner) if i % 2 else spring
        for i, spring in enumerate(model.suspensions)
    )
    assert drawing(replace(model, suspensions=turned)) == drawing(model)


def test_a_damper_beside_the_spring_counts() -> None:
    """As an entry of its own, without stiffness."""
    model = model_of("two_axle_wagon")
    beside = Suspension("damper", "front", "body", (3.0, 0.0, 0.46), (0.0, 0.0, 0.0), (0.0, 0.0, 7e3))
    lateral = SeriesDamper("lateral", "front", "body", (3.0, 0.0, 0.46), 1, 1e6, 5e4)  # and one that does not
    sheet = drawing(replace(model, suspensions=(*model.suspensions, beside), series=(lateral,)))
    assert sheet.body("front").primary_damping_nspm == 17e3
    assert sheet.body("front").primary_stiffness_npm == 2e6
    assert sheet.body("body").supports == (Support("front", 3.0), Support("rear", -3.0))


def carried(*, rods: bool) -> VehicleModel:
    """The bogie with an added box: in front of its body on two springs, its rear end on the body's roof.

    Hung on rods instead of standing on springs if ``rods``.
    """
    model = model_of("metro_irw_bogie")
    box = Body("box", 600.0, (200.0, 200.0, 200.0), (0.4, 0.0, 3.0))
    places = [(x, y) for x in (1.0, -0.2) for y in (0.5, -0.5)]
    springs = tuple(
        Suspension(f"box {i}", "body", "box", (x, y, 2.5), (1e5, 1e5, 1e5), (0.0, 0.0, 0.0))
        for i, (x, y) in enumerate(places)
    )
    hangers = tuple(
        Rod(f"hanger {i}", "box", "body", (x, y, 3.0), (x, y, 3.5), 1e6, 0.0)
        for i, (x, y) in enumerate(places)
    )
    level = tuple(
        replace(spring, stiffness_npm=(1e5, 1e5, 0.0), name=f"level {i}") for i, spring in enumerate(springs)
    )
    return replace(
        model,
        bodies=(*model.bodies, box),
        suspensions=(*model.suspensions, *(level if rods else springs)),
        rods=hangers if rods else (),
        guide=replace(model.guide, pitch_stiffness_nmprad=1e9),
    )


@pytest.mark.parametrize("rods", [False, True])
def test_what_hangs_is_carried_like_what_stands(rods: bool) -> None:
    """Four bearers around x = 0.4 of the vehicle, where the box has its reference point."""
    box = drawing(carried(rods=rods)).body("box")
    assert box is not None
    assert box.supports == (Support("body", 0.0),)


def test_a_slanted_rod_pushes_along_each_axis_by_the_square_of_its_cosine() -> None:
    """Hangers that lean by 3 : 4 : 5: .36 of their stiffness aside and .64 up; level springs push, too."""
    model = carried(rods=True)
    leaning = tuple(
        replace(
            rod,
            outer_position_m=(rod.inner_position_m[0], 1.75 * rod.inner_position_m[1], 3.5),
            damping_nspm=1e3,
        )
        for rod in model.rods
    )
    (springs,) = drawing(replace(model, rods=leaning)).body("box").springs
    side, up, level = 4 * 0.36e6, 4 * 0.64e6, 4 * 1e5
    assert (springs.lateral_npm, springs.vertical_npm) == pytest.approx((side + level, up))
    assert (springs.lateral_nspm, springs.vertical_nspm) == pytest.approx((1.44e3, 2.56e3))
    height = (3.0 * side + 2.5 * level) / (side + level)
    assert springs.height_m == pytest.approx(height)
    roll = up * 0.5**2 + side * (3.0 - height) ** 2 + level * (2.5 - height) ** 2
    assert springs.roll_nmprad == pytest.approx(roll)
    assert springs.roll_nmsprad == pytest.approx(2.56e3 * 0.5**2 + 1.44e3 * (3.0 - height) ** 2)


def test_an_axle_that_carries_two_bodies_has_the_springs_of_both() -> None:
    model = model_of("metro_irw_bogie")
    box = Body("box", 600.0, (200.0, 200.0, 200.0), (0.9, 0.0, 1.0))
    springs = tuple(
        Suspension(f"box {x} {y}", "front", "box", (0.9 + x, y, 0.6), (1e5, 1e5, 1e5), (1e3, 1e3, 1e3))
        for x in (0.2, -0.2)
        for y in (0.5, -0.5)
    )
    both = replace(model, bodies=(*model.bodies, box), suspensions=(*model.suspensions, *springs))
    front, rear = (drawing(both).body(name) for name in ("front", "rear"))
    assert (rear.primary_stiffness_npm, rear.primary_damping_nspm) == PRIMARY["metro_irw_bogie"]
    assert front.primary_stiffness_npm == pytest.approx(PRIMARY["metro_irw_bogie"][0] + 4e5)
    assert front.primary_damping_nspm == pytest.approx(PRIMARY["metro_irw_bogie"][1] + 4e3)


def test_a_body_on_its_own_bogie_and_on_its_neighbour() -> None:
    """Two car bodies in a row, the second with one bogie and its front end on the first one's rear end."""
    model = model_of("manchester_1")
    ahead = 19.0
    axles = tuple(
        replace(model.body(f"axle_{end}"), name=f"third_{end}", position_m=(x - ahead, 0.0, 0.46))
        for end, x in (("r1", -8.22), ("r2", -10.78))
    )
    frame = replace(model.body("frame_rear"), name="third", position_m=(-9.5 - ahead, 0.0, 0.6))
    second = Body("second", 20000.0, (4e4, 1e6, 1e6), (-21.25, 0.0, 1.8))

    def moved(spring: Suspension) -> Suspension:
        names = {"frame_rear": "third", "body": "second", "axle_r1": "third_r1", "axle_r2": "third_r2"}
        x, y, z = spring.position_m
        return replace(
            spring,
            name=f"{spring.name} third",
            inner=names[spring.inner],
            outer=names[spring.outer],
            position_m=(x - ahead, y, z),
        )

    joint = [
        Suspension(f"joint {y}", "second", "body", (-14.0, y, 1.0), (1e7, 1e7, 1e7), (0.0, 0.0, 0.0))
        for y in (0.02, -0.02)
    ]
    rear = [moved(s) for s in model.suspensions if {s.inner, s.outer} & {"frame_rear"}]
    wheels = tuple(
        replace(w, name=w.name.replace("axle", "third"), axle=w.axle.replace("axle", "third"), spin="third")
        for w in model.wheels
        if w.axle.startswith("axle_r")
    )
    # The first body must bear what the joint puts on it: its guide holds its pitch.
    train = replace(
        model,
        bodies=(second, *model.bodies, *axles, frame),
        suspensions=(*model.suspensions, *joint, *rear),
        wheels=(*model.wheels, *wheels),
        guide=replace(model.guide, pitch_stiffness_nmprad=1e9),
    )
    sheet = drawing(train)
    on = {support.on: support.x_m for support in sheet.body("second").supports}
    assert on == {"third": pytest.approx(-7.25), "body": pytest.approx(7.25)}
    # Its rear end on a bogie of 2.56 m, its front end on a body. On an arc y = x^2 / 2 that is parallel to
    # the tangent in its middle, so that the joint is as far out as its pivots: (9.5^2 + 1.28^2) / 2.
    chord, x = sheet.chord("second"), sheet.body("second").x_m
    assert (chord.half_m, chord.half_wheelbase_m) == pytest.approx((7.25, 0.64))
    turn = (9.5**2 - (x - 7.25) ** 2) / 2.0 / 14.5
    assert chord.centre_m == pytest.approx(turn - x, abs=0.15)


def test_bodies_that_follow_the_rails_by_themselves_rest_on_nothing() -> None:
    sheet = drawing(model_of("manchester_1"), each_by_itself=True)
    assert len(sheet.bodies) == 7
    for body in sheet.bodies:
        assert body.supports == () and body.primary_stiffness_npm is None
        assert astuple(sheet.chord(body.name))[:2] == (0.0, 0.0)


def test_a_vehicle_that_cannot_rest_has_no_drawing() -> None:
    model = model_of("two_axle_wagon")
    soft = tuple(replace(s, stiffness_npm=(1e6, 1e6, 0.0)) for s in model.suspensions)
    with pytest.raises(InputError, match="cannot rest"):
        drawing(replace(model, suspensions=soft))


RADIUS_M = 300.0


@pytest.fixture(scope="module", params=["manchester_1", "metro_irw_train"])
def curve(request: pytest.FixtureRequest) -> tuple[VehicleModel, Truth]:
    """Without irregularities through a curve with cant for its speed."""
    model = model_of(request.param)
    track = TrackDesign(
        "curve",
        -50.0,
        (
            Straight(130.0),
            Transition(60.0),
            Curve(150.0, RADIUS_M, 10.0**2 / RADIUS_M / 9.81 * 1.5),
            Transition(60.0),
            Straight(150.0),
        ),
    )
    profile = SpeedProfile(start_m=0.0, end_m=430.0, speed_mps=10.0, rest_s=1.0)
    return model, simulate(Ride("curve", track, NO_IRREGULARITY, 1, model, profile, engine="compiled"))


@pytest.mark.slow
def test_simulated_bodies_point_along_their_chords(curve: tuple[VehicleModel, Truth]) -> None:
    """In the whole curve bogies move their chords by 0.8 to 1.3 times the play, as `Chord` says; a car body
    on two bogies keeps to its chord in the transitions, twice as well as to the tangent."""
    model, truth = curve
    sheet = drawing(model)
    s = np.linspace(-45.0, 500.0, 20001)
    frame = truth.track.frame(s)
    x, y = frame.position[:, 0], frame.position[:, 1]

    def chord_yaw(place: np.ndarray, half: float, wheelbase: float) -> np.ndarray:
        def at(where: np.ndarray) -> np.ndarray:
            return np.stack([np.interp(where, s, x), np.interp(where, s, y)])

        span = (
            at(place + half - wheelbase)
            + at(place + half + wheelbase)
            - at(place - half - wheelbase)
            - at(place - half + wheelbase)
        )
        return np.arctan2(span[1], span[0])

    reference = truth.reference_position_m
    whole = (reference > 165.0) & (reference < 270.0)
    for body in model.bodies:
        chord = sheet.chord(body.name)
        place = reference + body.position_m[0] + chord.centre_m
        yaw = truth.bodies[body.name].angles[:, 2]
        off = yaw - chord_yaw(place, chord.half_m, chord.half_wheelbase_m)
        moved = -RADIUS_M * off[whole].mean()
        if chord.play_m == 0.0:
            assert abs(moved) < 0.1
            tangent = yaw - np.interp(place, s, frame.yaw_rad)
            moving = (reference > 10.0) & (reference < 400.0)
            assert np.std(off[moving]) < 0.5 * np.std(tangent[moving])
        else:
            assert 0.8 < moved / chord.play_m < 1.3, body.name


@pytest.mark.slow
def test_a_frame_whose_axles_yaw_points_where_stiffness_turns_it() -> None:
    """On an arc, both ways; what play does changes its sign with the direction, so that the mean is the
    drawing's: 5.8 m behind the front frame, where its supports say 0. Within a third of the play."""
    model = model_of("irw_car")
    elements = (
        Straight(130.0),
        Transition(60.0),
        Curve(150.0, RADIUS_M, 0.0),
        Transition(60.0),
        Straight(150.0),
    )
    track = TrackDesign("curve", -50.0, elements)
    chord, x = drawing(model).chord("frame_front"), model.body("frame_front").position_m[0]
    behind = []
    for ends in ((0.0, 430.0), (430.0, 0.0)):
        profile = SpeedProfile(start_m=ends[0], end_m=ends[1], speed_mps=5.0, rest_s=1.0)
        truth = simulate(Ride("curve", track, NO_IRREGULARITY, 1, model, profile, engine="compiled"))
        place = truth.reference_position_m + x
        whole = (place > 165.0) & (place < 270.0)
        yaw = truth.bodies["frame_front"].angles[whole, 2]
        tangent = truth.track.frame(place[whole]).yaw_rad
        behind.append(RADIUS_M * float(np.mean(yaw - tangent)))
    assert np.mean(behind) == pytest.approx(chord.centre_m, abs=chord.play_m / 3.0)
    assert abs(chord.centre_m) > 5.0


def test_a_rod_bears_by_its_rise_and_a_damper_where_it_is_upright() -> None:
    """A rod of 1 m that rises by 0.6 m: 0.6 of its tension, 0.36 of its stiffness and of its damping."""
    rod = Rod("rod", "low", "high", (0.0, 0.0, 1.0), (0.8, 0.0, 1.6), 1e6, 1e4)
    dampers = tuple(
        SeriesDamper(str(axis), "low", "high", (2.0, 0.0, 1.0), axis, 1e6, 5e3) for axis in (0, 1, 2)
    )
    vehicle = SimpleNamespace(
        suspensions=(), series=dampers, rods=(rod,), preload_n=lambda _: (), rod_tension_n=lambda _: (100.0,)
    )
    *beside, bearing = _bearings(vehicle)  # type: ignore[arg-type]
    assert bearing.x_m == {"low": 0.0, "high": 0.8}
    assert bearing.load_n == pytest.approx({"low": 60.0, "high": -60.0})
    assert tuple(bearing)[2:4] == pytest.approx((0.36e6, 0.36e4))
    assert [tuple(one)[2:4] for one in beside] == [(0.0, 0.0), (0.0, 0.0), (0.0, 5e3)]
    assert all(one.x_m == {"low": 2.0, "high": 2.0} for one in beside)
