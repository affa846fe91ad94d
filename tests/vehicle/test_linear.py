"""Linear analysis against closed forms and against Exudyn's own linearised system."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.track.design import TrackDesign
from simrail.track.elements import Straight
from simrail.track.irregularity import Irregularity
from simrail.track.laid_track import lay
from simrail.vehicle.contact.contact_tables import contacts_of
from simrail.vehicle.contact.wheelset import rolling_radius_difference
from simrail.vehicle.engines.records import GUIDE, SPRING
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.linear import running_vehicle, state_matrix
from simrail.vehicle.model import Body, Guide, Suspension, VehicleModel, Wheel, WheelRail
from simrail.vehicle.speed_profile import SpeedProfile
from simrail.vehicle.stability import (
    critical_speed,
    first_crossing,
    growth_1ps,
    modes_of,
    root_locus,
    standstill_modes,
)
from simrail.vehicle.study import SLOWEST_MPS, SPEEDS, contact_over_shift

M, IZ, R0, B, F11, F22 = 1500.0, 1000.0, 0.45, 0.75, 1e7, 1e7
"""Reference wheelset A of FACTS 1.2."""

# lambda: critical speed in m/s for (ky, kpsi) of the columns; the frequency does not depend on lambda.
COLUMNS = {(1e6, 1e6): 4.6332, (2e6, 2e6): 6.5523, (2e6, 8e6): 11.1966}
SHEET = {
    0.05: (75.680, 107.228, 257.56),
    0.10: (53.497, 75.727, 149.057),
    0.15: (43.676, 61.805, 115.514),
    0.20: (37.822, 53.514, 97.647),
    0.30: (30.880, 43.685, 77.910),
}


def closed_form(conicity, ky, kpsi):
    """Critical speed and circular frequency of the suspended wheelset (Hopf point of its 2 DOF)."""
    square = (ky * F11 * B**2 + kpsi * F22) / (M * F11 * B**2 + IZ * F22)
    speed = np.sqrt(
        4 * F11 * F22 * B**2 * square
        / ((ky - M * square) * (kpsi - IZ * square) + 4 * F11 * F22 * B * conicity / R0)
    )  # fmt: skip
    return speed, np.sqrt(square)


def wheelset_rates(conicity, ky, kpsi, speed):
    """Right-hand side of the suspended wheelset: (y, psi, y', psi')."""

    def rates(x):
        y, psi, y1, psi1 = x
        y2 = (-2 * F22 / speed * y1 - ky * y + 2 * F22 * psi) / M
        psi2 = (-2 * F11 * B**2 / speed * psi1 - kpsi * psi - 2 * F11 * B * conicity / R0 * y) / IZ
        return np.array([y1, psi1, y2, psi2])

    return rates


def eigenvalues_of_wheelset(conicity, ky, kpsi):
    steps = np.array([1e-6, 1e-6, 1e-5, 1e-5])
    return lambda v: np.linalg.eigvals(
        state_matrix(wheelset_rates(conicity, ky, kpsi, v), np.zeros(4), steps)
    ).astype(complex)


@pytest.mark.parametrize("column", range(3))
@pytest.mark.parametrize("conicity", SHEET)
def test_hopf_point_of_the_suspended_wheelset(conicity, column):
    """Critical speed and frequency to 1e-6 of the closed form, which is the sheet's to its digits."""
    ky, kpsi = list(COLUMNS)[column]
    speed, omega = closed_form(conicity, ky, kpsi)
    assert speed == pytest.approx(SHEET[conicity][column], rel=2e-5)
    found = first_crossing(eigenvalues_of_wheelset(conicity, ky, kpsi), np.linspace(2.0, 300.0, 60))
    assert found.speed_mps == pytest.approx(speed, rel=1e-6)
    assert found.frequency_hz == pytest.approx(omega / (2 * np.pi), rel=1e-6)
    assert found.frequency_hz == pytest.approx(COLUMNS[ky, kpsi], abs=6e-5)
    # Three per cent below is stable, above is not: of the motion itself, after 200 s.
    for factor, grows in ((0.97, False), (1.03, True)):
        matrix = state_matrix(
            wheelset_rates(conicity, ky, kpsi, factor * speed), np.zeros(4), np.full(4, 1e-5)
        )
        later = np.linalg.norm(expm(200.0 * matrix) @ [1e-3, 0.0, 0.0, 0.0])
        assert (later > 1e-3) == grows


def test_no_crossing_and_one_from_the_start():
    """Stiff and slow: none below the last speed. A free wheelset hunts at any speed."""
    none = first_crossing(eigenvalues_of_wheelset(0.05, 1e6, 1e6), np.linspace(2.0, 70.0, 9))
    assert none.speed_mps is None and none.searched_mps == (2.0, 70.0) and not none.from_the_start
    free = first_crossing(eigenvalues_of_wheelset(0.1, 0.0, 0.0), np.linspace(3.0, 70.0, 9))
    assert free.from_the_start and free.speed_mps == 3.0
    wavelength = 3.0 / free.frequency_hz
    assert wavelength == pytest.approx(2 * np.pi * np.sqrt(B * R0 / 0.1), rel=1e-3)


def suspended(conicity, ky, kpsi):
    """The shipped suspended wheelset at a stiffness pair and conicity.

    Springs at +-a across: ky is their sum, kpsi = ky a^2 by their longitudinal stiffness.
    """
    model = load(VehicleFile, "vehicle", "suspended_wheelset").model("suspended_wheelset")
    arm = np.sqrt(kpsi / ky)
    springs = tuple(
        replace(
            spring,
            position_m=(0.0, float(np.sign(spring.position_m[1]) * arm), 0.45),
            stiffness_npm=(0.5 * ky, 0.5 * ky, 0.0),
        )
        for spring in model.suspensions
    )
    linear = replace(model.wheel_rail.linear, conicity=conicity)
    return replace(
        model,
        suspensions=springs,
        wheel_rail=replace(model.wheel_rail, linear=linear),
    )


SHORT = [(0.1, 0), (0.05, 2)]
ALL = [
    pytest.param(*case, marks=[] if case in SHORT else [pytest.mark.slow])
    for case in ((conicity, column) for conicity in SHEET for column in range(3))
]


@pytest.mark.parametrize(("conicity", "column"), ALL)
def test_vehicle_of_the_closed_form_hunts_at_its_speed(conicity, column):
    """Critical speed and frequency of the suspended wheelset, a vehicle like any other: 1 %."""
    ky, kpsi = list(COLUMNS)[column]
    speed, omega = closed_form(conicity, ky, kpsi)
    vehicle = running_vehicle(suspended(conicity, ky, kpsi))
    found = critical_speed(vehicle, root_locus(vehicle, speed * np.array([0.5, 0.8, 0.97, 1.03])))
    assert found.speed_mps == pytest.approx(speed, rel=0.01)
    assert found.frequency_hz == pytest.approx(omega / (2.0 * np.pi), rel=0.01)


# A vehicle in Python: one axle, a body on four springs and four dampers.
BODY = Body("body", 8000.0, (6000.0, 20000.0, 21000.0), (0.0, 0.0, 1.2))
AXLE = Body("axle", 1400.0, (900.0, 100.0, 950.0), (0.0, 0.0, 0.46))
NO_GUIDE = Guide("body", 1e5, 1e4, 0.0, 0.0, 0.0, 0.0)
RAIL = WheelRail("S1002", "60E1", 1.435, 0.025, 0.3)
KZ, CZ, KY, KX, LX, LY = 300e3, 6e3, 200e3, 500e3, 1.5, 0.9


def on_springs(*, height=1.2, wheels="fixed", guide=NO_GUIDE):
    corners = [(x, y) for x in (LX, -LX) for y in (LY, -LY)]
    springs = tuple(
        Suspension(f"spring {i}", "axle", "body", (x, y, height), (KX, KY, KZ), (0.0, 0.0, CZ))
        for i, (x, y) in enumerate(corners)
    )
    spins = {"axle": 60.0} if wheels == "fixed" else {"l": 30.0, "r": 30.0}
    names = ("axle", "axle") if wheels == "fixed" else ("l", "r")
    return VehicleModel(
        name="made here", title="", source="", synthetic=True, bodies=(AXLE, BODY), suspensions=springs,
        wheels=(Wheel("l", "axle", 1, names[0], 0.46), Wheel("r", "axle", -1, names[1], 0.46)),
        spin_inertia_kgm2=spins, guide=guide, wheel_rail=RAIL,
    )  # fmt: skip


def test_body_on_springs_has_the_frequencies_of_the_closed_form():
    """All six, to 1e-3 (gravity tilts and the springs' sag add less), and the damping of bounce.

    Nothing but its inertia holds the axle in pitch: here that is a mountain's.
    """
    heavy = replace(AXLE, inertia_kgm2=(AXLE.inertia_kgm2[0], 1e9, AXLE.inertia_kgm2[2]))
    found = standstill_modes(running_vehicle(replace(on_springs(), bodies=(heavy, BODY))))
    stiffness = {
        "longitudinal": (4 * KX + NO_GUIDE.stiffness_npm) / BODY.mass_kg,
        "lateral": 4 * KY / BODY.mass_kg,
        "bounce": 4 * KZ / BODY.mass_kg,
        "roll": 4 * KZ * LY**2 / BODY.inertia_kgm2[0],
        "pitch": 4 * KZ * LX**2 / BODY.inertia_kgm2[1],
        "yaw": 4 * (KY * LX**2 + KX * LY**2) / BODY.inertia_kgm2[2],
    }
    assert len(found) == 6
    for direction, square in stiffness.items():
        mode = max(found, key=lambda m: m.shares["body", direction])
        assert mode.shares["body", direction] > 0.99
        assert mode.natural_frequency_hz == pytest.approx(np.sqrt(square) / (2 * np.pi), rel=1e-3)
        if direction == "bounce":
            assert mode.damping == pytest.approx(4 * CZ / (2 * np.sqrt(4 * KZ * BODY.mass_kg)), rel=1e-3)
            assert mode.words() == "body bounce 100 %"


def alone(inclination, *, wheels="fixed"):
    """A loaded axle that nothing holds across the track or in yaw."""
    loaded = Body("axle", 10000.0, (6000.0, 700.0, 6000.0), (0.0, 0.0, 0.46))
    return replace(
        on_springs(wheels=wheels, guide=Guide("axle", 1e4, 1e3, 1e5, 1e4, 0.0, 0.0)),
        bodies=(loaded,),
        suspensions=(),
        wheel_rail=replace(RAIL, rail_inclination=inclination),
    )


@pytest.mark.parametrize(("inclination", "least"), [(0.05, 0.008), (1 / 30, 0.02), (0.0, 0.1)])
def test_free_wheelset_has_the_wavelength_of_klingel(inclination, least):
    """Within 5 % for three conicities at 1 m/s, the conicity read from the contact; IRW: no oscillation."""
    model = alone(inclination)
    shift = 1e-5
    left, right = rolling_radius_difference(contacts_of(model).tables[0], np.array([shift, -shift]))
    slope = (left - right) / (4.0 * shift)
    assert slope > least
    wavelength = 2.0 * np.pi * np.sqrt(B * 0.46 / slope)
    values = np.linalg.eigvals(running_vehicle(model).linearised(1.0))
    hunting = values[values.imag > 0.1]
    klingel = hunting[np.argmin(np.abs(hunting.real))]
    assert 1.0 / (klingel.imag / (2 * np.pi)) == pytest.approx(wavelength, rel=0.05)

    values = np.linalg.eigvals(running_vehicle(alone(inclination, wheels="independent")).linearised(1.0))
    kinematic = 2 * np.pi / wavelength
    near = values[np.abs(np.abs(values.imag) - kinematic) < 0.3 * kinematic]
    assert not np.any(np.abs(near.real) < 0.3 * kinematic)


def test_a_spinning_body_obeys_euler():
    """Free of forces, w' is that of the body's Euler equations, whatever its attitude."""
    vehicle = running_vehicle(on_springs())
    free = replace(vehicle, data=vehicle.data._replace(springs=np.zeros(0, SPRING), guide=np.zeros(1, GUIDE)))
    state = np.zeros(free.size)
    state[9:12] = 0.3, -0.2, 0.5  # turn of the body, in the track's axes
    omega = np.array([1.0, 2.0, -0.7])
    state[21:24] = omega
    slope = free.rates(state, 10.0)[21:24]
    upright, base = state.copy(), Rotation.from_rotvec(state[:12].reshape(2, 6)[:, 3:]).as_matrix()
    upright[9:12] = 0.0  # the same attitude, as the one that turns start from
    assert free.rates(upright, 10.0, base=base) == pytest.approx(free.rates(state, 10.0), rel=1e-9, abs=1e-9)
    turn = Rotation.from_rotvec(state[9:12]).as_matrix()
    inertia = turn @ np.diag(BODY.inertia_kgm2) @ turn.T
    assert slope == pytest.approx(np.linalg.solve(inertia, -np.cross(omega, inertia @ omega)), rel=1e-9)


@pytest.fixture(scope="module")
def bogie():
    return running_vehicle(load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"))


def test_steady_running_is_steady_and_carries_the_weight(bogie):
    state = bogie.equilibrium(20.0)
    assert np.abs(bogie.rates(state, 20.0)).max() < 1e-6
    assert np.abs(state[1:24:6]).max() < 1e-9  # centred
    spins = state[48:52]
    assert spins == pytest.approx(20.0 / 0.29, rel=2e-3)
    with pytest.raises(InputError, match="does not run steadily"):
        lost = replace(bogie.model, suspensions=bogie.model.suspensions[:8])
        statics = bogie.model._statics
        object.__setattr__(lost, "_statics", np.concatenate([statics[:8], statics[-5:]]))
        running_vehicle(lost).equilibrium(20.0)


def test_steady_running_is_found_from_a_speed_nearby():
    """Places fit at once there, the spins of the wheels take another step."""
    wagon = running_vehicle(load(VehicleFile, "vehicle", "two_axle_wagon").model("two_axle_wagon"))
    at = None
    for speed in np.linspace(SLOWEST_MPS, 400.0 / 3.6, SPEEDS):
        at = wagon.equilibrium(speed, start=at)
        assert np.abs(wagon.rates(at, speed)[6 * wagon.bodies : 12 * wagon.bodies]).max() < 1e-6


def test_bogie_with_independent_wheels_does_not_hunt(bogie):
    """No critical speed up to 400 km/h; every oscillation decays; shares of a mode sum to 1."""
    locus = root_locus(bogie, np.linspace(2.0, 111.0, 12))
    assert critical_speed(bogie, locus).speed_mps is None
    assert max(growth_1ps(row) for row in locus.eigenvalues_1ps) < -0.1
    for mode in modes_of(bogie.linearised(20.0), bogie):
        assert sum(mode.shares.values()) == pytest.approx(1.0)
    bounce = max(standstill_modes(bogie), key=lambda mode: mode.shares["body", "bounce"])
    # Body on its secondary springs; the frame below gives way a little.
    alone_hz = np.sqrt(4 * 200e3 / 12000.0) / (2 * np.pi)
    assert 0.85 * alone_hz < bounce.natural_frequency_hz < alone_hz


def test_rigid_wheelsets_make_the_same_bogie_hunt(bogie):
    """One switch: wheels that turn as one bring kinematic hunting back, and a critical speed."""
    text = load(VehicleFile, "vehicle", "metro_irw_bogie")
    axles = [axle.model_copy(update={"wheels": "fixed"}) for axle in text.axle]
    model = text.model_copy(update={"axle": axles}).model("rigid")
    vehicle = running_vehicle(model)
    locus = root_locus(vehicle, np.linspace(2.0, 111.0, 24))
    found = critical_speed(vehicle, locus)
    assert found.speed_mps is not None and not found.from_the_start
    assert growth_1ps(np.linalg.eigvals(vehicle.linearised(0.97 * found.speed_mps))) < 0.0
    assert growth_1ps(np.linalg.eigvals(vehicle.linearised(1.03 * found.speed_mps))) > 0.0


@pytest.mark.slow
def test_exudyns_own_linearised_system_has_the_same_eigenvalues(bogie):
    """Metro bogie at 36 km/h, settled by the engine: all oscillatory eigenvalues to 3e-4, most to 1e-6.

    Exudyn differentiates its own equations (one-sided, along its Lie-group increments, hence the rate
    of a displacement is the velocity), so this checks coordinates, inertia and differences at once.
    """
    from simrail.vehicle.engines.engine import Setup
    from simrail.vehicle.engines.exudyn_engine import ExudynEngine, exu

    speed = 10.0
    laid = lay(TrackDesign("level", 0.0, (Straight(400.0),)), Irregularity("none", fade_m=1.0), seed=0)
    profile = SpeedProfile(20.0, 390.0, speed, acceleration_mps2=3.0, jerk_mps3=6.0, rest_s=0.1)
    engine = ExudynEngine(Setup(bogie.model, laid, profile, settle_s=2.0))
    for _ in engine.run(14.0):
        pass
    mass, stiffness, damping = exu.solver.ComputeLinearizedSystem(engine.mbs, engine._settings)
    n = engine.size
    matrix = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ]
    )
    theirs = np.linalg.eigvals(matrix)
    ours = np.linalg.eigvals(bogie.linearised(speed))
    ours = ours[ours.imag > 0.01]
    error = np.array([np.abs(theirs - value).min() / np.abs(value) for value in ours])
    assert len(ours) >= 28 and error.max() < 3e-4 and np.median(error) < 1e-6


def test_frames_bounce_on_their_springs_though_their_boxes_hang_on_arms():
    """GZ18: sqrt((4 k_z + 2 k_air)/m), 4.0 Hz, with the boxes' inertia, which pitch as their arms swing."""
    vehicle = running_vehicle(load(VehicleFile, "vehicle", "metro_car_gz18").model("metro_car_gz18"))
    found = standstill_modes(vehicle)
    bounces = [m for m in found if m.shares["frame_front", "bounce"] + m.shares["frame_rear", "bounce"] > 0.8]
    assert len(bounces) == 2
    for mode in bounces:
        # Both frames together or against each other; the body stands still to 1 %.
        mass = 8900.0 + 2.0 * 60.0 / 0.48**2
        expected = np.sqrt((4 * 1.4e6 + 2 * 230e3) / mass) / (2.0 * np.pi)
        assert mode.natural_frequency_hz == pytest.approx(expected, rel=0.01)
    pitch = [m for m in found if sum(m.shares[a, "pitch"] for a in vehicle.model.axle_names) > 0.9]
    # An axle's boxes on the bushings of both its arms; the frame, which recoils, makes it some 5 % more.
    expected = np.sqrt(2.0 * 17e6 * (0.48**2 + 0.0135**2) / 60.0) / (2.0 * np.pi)
    assert len(pitch) == 4
    for mode in pitch:
        assert expected < mode.natural_frequency_hz < 1.06 * expected


def test_conicity_belongs_to_wheels_that_turn_together():
    """S1002 on 60E1: some 0.18 at 3 mm under load (FACTS 4.1: 0.18 rigid); none of independent wheels."""
    wagon, bogie = (
        contact_over_shift(
            load(VehicleFile, "vehicle", name).model(name), gravity_mps2=9.81, say=lambda _what, _share: None
        )
        for name in ("two_axle_wagon", "metro_irw_bogie")
    )
    assert wagon.steers and wagon.at_3_mm == pytest.approx(0.18, abs=0.01)
    assert not bogie.steers and bogie.amplitude_m.size == 0
