"""Rides that shake: lines where they belong, derivatives that agree, and silence that stays silent."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from dead_reckoning import dead_reckon
from scipy.signal import lfilter

from simrail.core.columns import ACCEL, ATTITUDE, GYRO, POSITION
from simrail.core.errors import InputError
from simrail.core.toml_files import load
from simrail.recording.sheets.imu_file import ImuFile
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, is_cached, simulate
from simrail.ride.truth import BodyMotion, Mount, Truth
from simrail.ride.vibration.files import read_short_waves, write_short_waves
from simrail.ride.vibration.floor import Floor
from simrail.ride.vibration.run import Piece, Shaker, linear_vehicle_of
from simrail.ride.vibration.short_waves import ShortWaves, superposed
from simrail.ride.vibration.sources import (
    CarBending,
    Equipment,
    Passengers,
    Traction,
    Vibration,
)
from simrail.sensors.imu import device_of
from simrail.sensors.measure import measure
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.track.rail_surface import STEP_M, Dips, RailSources, RailSurface, Roughness, SleeperPassing
from simrail.track.roughness import TABLES
from simrail.track.sections import SectionGain
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile
from simrail.vehicle.vibration.linear_model import Bending, TrackSupport
from simrail.vehicle.vibration.wheels import OutOfRound, drawn_orders

SUPPORT = TrackSupport(150.0, 7e7, 1e5)
RADIUS_M = 0.46
ALL = Vibration(
    rails=RailSources(
        Roughness(TABLES["eu_2021_1226_m"]),
        Dips(18.0, 1.5e-4, 1e-4),
        None,
        SleeperPassing(),
        None,
        SectionGain(0.4),
    ),
    wheels=OutOfRound(),
    support=SUPPORT,
    bending=CarBending(),
    structure_borne=0.02,
    equipment=Equipment(),
    traction=Traction(),
    passengers=Passengers(),
)


@pytest.fixture(scope="module")
def coach():
    return load(VehicleFile, "vehicle", "manchester_1").model("manchester_1")


@pytest.fixture(scope="module")
def line():
    return load(TrackFile, "track", "level_straight").design("level_straight")


def gliding(coach, line, speed_mps, *, duration_s=10.0, rate_hz=2000.0, start_m=200.0):
    """A truth of a vehicle that glides along at a constant speed, its wheels rolling without slip."""
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    zeros = np.zeros((len(t), 3))
    place = start_m + speed_mps * t
    bodies = {}
    for body in coach.bodies:
        x, _, z = body.position_m
        position = np.column_stack([place + x, zeros[:, 1], np.full(len(t), z)])
        velocity = np.column_stack([np.full(len(t), speed_mps), zeros[:, 1:]])
        bodies[body.name] = BodyMotion(x, z, position, velocity, zeros, zeros, zeros, zeros)
    radii = {wheel.name: RADIUS_M for wheel in coach.wheels}
    angles = dict.fromkeys(radii, speed_mps * t / RADIUS_M)
    return Truth(t, line, place, bodies, angles, {}, radii, 9.81, {})


def shaken(vibration, truth, coach, *, seed=1):
    """Motions (n, 12) of every body, and loads (n, w)."""
    pieces = list(Shaker(vibration, truth, coach, seed=seed).run())
    motions = {name: np.concatenate([p.motions[name] for p in pieces]) for name in coach.body_names}
    return motions, np.concatenate([p.loads for p in pieces])


def amplitude_at(values, frequency_hz, rate_hz=2000.0):
    """Amplitude of a line over a whole number of its periods at the end."""
    periods = np.floor(len(values) / 2 / rate_hz * frequency_hz)
    tail = values[-round(periods * rate_hz / frequency_hz) :]
    t = np.arange(len(tail)) / rate_hz
    return 2.0 * np.abs(np.mean((tail - tail.mean()) * np.exp(-2j * np.pi * frequency_hz * t)))


def test_sleepers_pass_at_speed_over_spacing(coach, line):
    """Even sleepers shake all axles at V/0.6 m, as M, C and K answer to a wave that reaches them in turn."""
    speed, spacing, size = 12.0, 0.6, 10e-6
    frequency = speed / spacing
    vibration = Vibration(
        rails=RailSources(sleepers=SleeperPassing(spacing, 0.0, size, 0.0)), support=SUPPORT
    )
    truth = gliding(coach, line, speed)
    motions, _ = shaken(vibration, truth, coach)
    shaker = Shaker(vibration, truth, coach, seed=1)
    ahead = np.array([coach.body(wheel.axle).position_m[0] for wheel in coach.wheels])
    wave = size * np.exp(2j * np.pi * ahead / spacing)
    answer = shaker.vehicle.response(frequency) @ wave
    for body in ("axle_f1", "frame_front", "body"):
        expected = np.abs(shaker.vehicle.row(body, 2) @ answer)
        if body != "body":  # whose own slow swing from the start is a thousand times this line
            assert amplitude_at(motions[body][:, 0], frequency) == pytest.approx(expected, rel=2e-3)
        acceleration = (2.0 * np.pi * frequency) ** 2 * expected
        assert amplitude_at(motions[body][:, 2], frequency) == pytest.approx(acceleration, rel=2e-3)
    # The axle's line stands above everything else of its spectrum.
    spectrum = np.abs(np.fft.rfft(motions["axle_f1"][4000:, 2]))
    found = np.fft.rfftfreq(len(motions["axle_f1"]) - 4000, 1 / 2000.0)[1:][np.argmax(spectrum[1:])]
    assert found == pytest.approx(frequency, abs=0.2)


@pytest.mark.parametrize("order", [1, 3, 7])
def test_order_of_a_wheel(coach, line, order):
    """Order n of every wheel shakes at n V/(2 pi r): of one wheel alone, by the response to that wheel."""
    speed = 2.0 * np.pi * RADIUS_M * 4.0  # four turns a second
    shape = OutOfRound(60e-6, 1.3, 0.4, 10)
    truth = gliding(coach, line, speed)
    shaker = Shaker(Vibration(wheels=shape, support=SUPPORT), truth, coach, seed=1)
    motions, loads = shaken(Vibration(wheels=shape, support=SUPPORT), truth, coach)
    waves = [drawn_orders(shape, wheel.name, seed=1) for wheel in coach.wheels]
    push = np.array([a[order - 1] * np.exp(1j * p[order - 1]) for a, p in waves])
    answer = shaker.vehicle.response(4.0 * order) @ push
    for motion, column in ((2, 0), (3, 3)):  # heave and roll: both wheels of an axle act apart
        expected = np.abs(shaker.vehicle.row("axle_f1", motion) @ answer)
        found = amplitude_at(motions["axle_f1"][:, column], 4.0 * order)
        assert found == pytest.approx(expected, rel=2e-3)
    load = shaker.vehicle.load @ answer + shaker.vehicle.contact_npm * push
    assert amplitude_at(loads[:, 0], 4.0 * order) == pytest.approx(np.abs(load[0]), rel=5e-3)


def test_weld_rings_at_p2(coach, line):
    """After a weld the load of the wheel swings at P2, the axle on its track: two masses on two springs."""
    welds = Vibration(rails=RailSources(welds=Dips(400.0, 1e-3, 0.0, 0.05, 0.3)), support=SUPPORT)
    truth = gliding(coach, line, 20.0, duration_s=2.0, start_m=585.0)
    _, loads = shaken(welds, truth, coach)
    first = int(np.argmin(loads[:, 0])) + 60  # the contact has ceased to ring
    after = loads[first : first + 1500, 0]
    spectrum = np.abs(np.fft.rfft(after - after.mean(), 1 << 16))
    found = np.fft.rfftfreq(1 << 16, 1 / 2000.0)[np.argmax(spectrum)]
    m, damping, k = 1813.0 / 2 + 150.0, 1e5, 7e7
    # The primary springs lie beside the track, 1.22e6 + 1e6 N/m each.
    undamped = np.sqrt((k + 2.2e6) / m)
    damped = np.sqrt(undamped**2 - (damping / (2.0 * m)) ** 2) / (2.0 * np.pi)
    assert found == pytest.approx(damped, rel=0.06)


def test_both_rails_act_apart(coach, line):
    """One rough rail rolls the axles; two alike do not."""
    truth = gliding(coach, line, 15.0, duration_s=3.0)
    one, both = (
        RailSources(sleepers=SleeperPassing()),
        RailSources(Roughness(TABLES["eu_2021_1226_m"])),
    )
    alike, apart = (shaken(Vibration(rails=rails, support=SUPPORT), truth, coach)[0] for rails in (one, both))
    assert np.abs(alike["axle_f1"][:, 3]).max() < 1e-12
    half = 0.75
    heave, roll = apart["axle_f1"][1000:, 2].std(), half * apart["axle_f1"][1000:, 5].std()
    assert 0.3 < roll / heave < 3.0


def test_left_is_left(coach, line):
    """A slow rise of the left rail alone lifts the left side: roll is positive (left side up)."""
    truth = gliding(coach, line, 5.0, duration_s=6.0)
    s = np.arange(0.0, 400.0, STEP_M)
    rise = 1e-3 / (1.0 + np.exp(-(s - 215.0) / 1.0))
    surface = RailSurface(0.0, np.ascontiguousarray(np.stack([rise, 0.0 * rise])))
    shaker = Shaker(Vibration(support=SUPPORT), truth, coach, seed=1, surface=surface)
    roll = np.concatenate([piece.motions["axle_f1"][:, 3] for piece in shaker.run()])
    # The contact at the left has risen by nearly all of it: springs above take a little back.
    assert roll[-1000:].mean() == pytest.approx(1e-3 / 1.5, rel=0.05)


def test_bent_body_is_one_line():
    """The pitch of a bent body at a place is the slope of its rise there, nose down positive."""
    bent, rng = Bending("body", 10.0, 0.02, 26.0), np.random.default_rng(1)
    motions, coordinate = {"body": rng.standard_normal((5, 12))}, rng.standard_normal((5, 3))
    short = ShortWaves({}, 1.5, motions, {"body": (bent, coordinate)})

    def rise(x):
        felt = short.of("body", x)
        return felt[:, :3] - x * felt[:, 6:9]  # where a rigid body that moves as felt has its point x

    for x in (-9.5, 0.0, 4.0):
        slope = (rise(x + 1e-4) - rise(x - 1e-4)) / 2e-4
        np.testing.assert_allclose(-slope, short.of("body", x)[:, 6:9], atol=1e-7)
        expected = motions["body"][:, :3] - x * motions["body"][:, 6:9] + bent.shape(x)[0] * coordinate
        np.testing.assert_allclose(rise(x), expected, atol=1e-12)


def test_gains_of_the_floor_keep_the_derivatives(coach, line):
    """Passengers who fall silent as the train starts, motors that grow loud as it pulls: product rule."""
    coarse = np.arange(0.0, 20.0, 0.1)
    speed = np.clip(coarse - 5.0, 0.0, 8.0)
    floor = Floor(
        Vibration(passengers=Passengers(1.0), traction=Traction(1.0, (5.0, 40.0))),
        "body",
        time_s=coarse,
        speed_mps=speed,
        acceleration_mps2=np.gradient(speed, coarse),
        rate_hz=2000.0,
        seed=1,
    )
    rows = floor.at(np.arange(40000))
    for low in (0, 1):
        x, v = rows[:, low], rows[2:-2, low + 1]
        slope = (8.0 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / 12.0 * 2000.0
        # Fourth-order differences at 40 Hz: (2 pi 40/2000)^4/30, 8e-6.
        assert np.abs(slope - v).max() < 1e-4 * np.abs(v).max()
    standing, pulling = rows[:8000, 2], rows[14000:24000, 2]
    assert standing.std() == pytest.approx(1.0, rel=0.25)  # some 14 independent values of 0.5 to 4 Hz
    assert pulling.std() == pytest.approx(1.0, rel=0.1)
    assert rows[30000:, 2].std() < 1e-2


def test_perfect_sensors_find_the_pose_of_a_shaking_truth(tmp_path, monkeypatch):
    """Closure at 1 kHz with everything shaking: the figures of a truth's design, 0.001 deg and 20 mm."""
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)
    bogie = load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie")
    ride = Ride(
        name="closure",
        track=load(TrackFile, "track", "smooth_curve").design("smooth_curve"),
        irregularity=Irregularity("erri_b176_low", (1.5, 100.0), 20.0),
        track_seed=4,
        vehicle=bogie,
        profile=SpeedProfile(30.0, 250.0, 12.0, rest_s=1.0, final_rest_s=0.5),
        engine="kinematic",
        vibration=ALL,
    )
    truth = simulate(ride)
    for body in ("front", "frame", "body"):
        motion = truth.motion(Mount("m", body, (0.3, 0.2, 0.8))).iloc[2000:-1000]
        off = dead_reckon(motion, motion.iloc[0]) - motion
        assert np.abs(off[list(POSITION)].to_numpy()).max() < 20e-3
        assert np.degrees(np.abs(off[list(ATTITUDE)].to_numpy()).max()) < 1e-3


@pytest.mark.parametrize("creeps", [False, True])
def test_second_derivative_of_the_position(coach, line, creeps):
    """Every column is the derivative of the one before, over the whole vibration."""
    truth = gliding(coach, line, 15.0, duration_s=6.0)
    motions, _ = shaken(replace(ALL, lateral_creep=creeps), truth, coach)
    for motion in motions.values():
        for place in range(0, 12, 3):
            if not motion[:, place].any():
                continue
            for low, high in ((place, place + 1), (place + 1, place + 2)):
                # Fourth-order differences over 2 kHz are off by (2 pi f h)^4/30, 0.2 % at 150 Hz.
                x, v = _below(motion[:, low], 150.0), _below(motion[:, high], 150.0)
                slope = (8.0 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / 12.0 * 2000.0
                assert (slope - v[2:-2])[2000:-2000].std() < 0.01 * v[2000:-2000].std()


def _below(values, frequency_hz):
    from scipy import signal

    return signal.sosfiltfilt(signal.butter(4, frequency_hz, fs=2000.0, output="sos"), values)


def test_lower_rate_is_the_low_passed_truth(coach, line):
    """A truth at 500 Hz has what the one at 2 kHz has below 0.4 of its rate, sample by sample in the mean."""
    fine, coarse = (gliding(coach, line, 15.0, duration_s=4.0, rate_hz=rate) for rate in (2000.0, 500.0))
    rough = Vibration(rails=RailSources(Roughness(TABLES["eu_2021_1226_m"])), support=SUPPORT)
    at_2000, at_500 = shaken(rough, fine, coach)[0], shaken(rough, coarse, coach)[0]
    for column in (0, 2):
        one = np.fft.rfft(at_2000["axle_f1"][:8000, column])[:800] / 8000
        other = np.fft.rfft(at_500["axle_f1"][:2000, column])[:800] / 2000
        assert np.abs(other - one)[40:].max() < 0.02 * np.abs(one[40:]).max()


def test_superposed_truth_is_a_motion():
    """Turning and leaning body on a turning frame: rates and accelerations are the pose's derivatives."""
    line = load(TrackFile, "track", "smooth_curve").design("smooth_curve")
    rate_hz = 2000.0
    t = np.arange(8000) / rate_hz
    place, speed = line.start_m + 220.0 + 12.0 * t + 0.4 * t**2, 12.0 + 0.8 * t
    frame = line.frame(place)
    w = 2.0 * np.pi * 0.8
    base = np.column_stack([0.03 * np.sin(w * t), 0.02 * np.cos(w * t), 0.3 * t + 0.01 * np.sin(w * t)])
    first = np.column_stack(
        [0.03 * w * np.cos(w * t), -0.02 * w * np.sin(w * t), 0.3 + 0.01 * w * np.cos(w * t)]
    )
    second = np.column_stack([-0.03 * np.sin(w * t), -0.02 * np.cos(w * t), -0.01 * np.sin(w * t)]) * w**2
    body = BodyMotion(0.0, 0.5, *(np.zeros((len(t), 3)),) * 3, base, *body_rates(base, first, second))
    v = 2.0 * np.pi * 15.0
    wave = np.column_stack([np.sin(v * t), v * np.cos(v * t), -(v**2) * np.sin(v * t)])
    short = np.hstack([1e-3 * wave, 2e-3 * wave, -1e-3 * wave, 5e-4 * wave])
    found = superposed(body, short, frame, speed, np.full(len(t), 0.8))
    expected = body_rates(base + short[:, [3, 6, 0]] * [1, 1, 0], first + short[:, [4, 7, 1]] * [1, 1, 0],
                          second + short[:, [5, 8, 2]] * [1, 1, 0])  # fmt: skip
    np.testing.assert_allclose(found.rate, expected[0], atol=1e-12)
    np.testing.assert_allclose(found.angular_acceleration, expected[1], atol=1e-9)
    for low, high in ((found.position, found.velocity), (found.velocity, found.acceleration)):
        slope = (8.0 * (low[3:-1] - low[1:-3]) - (low[4:] - low[:-4])) / 12.0 * rate_hz
        # (w h)^4/30 of fourth-order differences at 15 Hz: 2e-7.
        assert np.abs(slope - high[2:-2])[10:-10].max() < 1e-6 * np.abs(high).max()


def body_rates(angles, first, second):
    """Body rates and their derivatives of ZYX angles, from the rotation matrix by differences in one step.

    Independent of the code: C^T C' is the cross matrix of the rates; derivatives of C by the chain rule on
    the product of three elementary turns.
    """
    turn, turn1, turn2 = _product(angles, first, second)
    rate = np.einsum("nji,njk->nik", turn, turn1)
    slope = np.einsum("nji,njk->nik", turn1, turn1) + np.einsum("nji,njk->nik", turn, turn2)
    return tuple(np.column_stack([m[:, 2, 1], m[:, 0, 2], m[:, 1, 0]]) for m in (rate, slope))


def _product(angles, first, second):
    """C = Z Y X and its two derivatives."""

    def turn(axis, angle):
        c, s, m = np.cos(angle), np.sin(angle), np.zeros((len(angle), 3, 3))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        m[:, axis, axis] = 1.0
        m[:, i, i] = m[:, j, j] = c
        m[:, j, i], m[:, i, j] = s, -s
        return m

    def parts(axis, k):
        a, a1, a2 = angles[:, k], first[:, k][:, None, None], second[:, k][:, None, None]
        level = np.ones((3, 3))
        level[axis, axis] = 0.0
        d1, d2 = turn(axis, a + 0.5 * np.pi), turn(axis, a + np.pi)
        still = np.zeros((3, 3))
        still[axis, axis] = 1.0
        d1, d2 = d1 - still, d2 - still
        return turn(axis, a), d1 * a1, d2 * a1**2 + d1 * a2

    z, y, x = parts(2, 2), parts(1, 1), parts(0, 0)

    def times(a, b):
        return (a[0] @ b[0], a[1] @ b[0] + a[0] @ b[1], a[2] @ b[0] + 2.0 * a[1] @ b[1] + a[0] @ b[2])

    return times(times(z, y), x)


def test_floor_of_a_standing_train(coach, line):
    """Equipment has its rms, half of it in its lines; passengers walk while the train stands only."""
    standing = gliding(coach, line, 0.0, duration_s=24.0)
    floor = Vibration(equipment=Equipment(0.03), passengers=Passengers(0.0125))
    heave = shaken(floor, standing, coach)[0]["body"]
    assert heave[2000:, 2].std() == pytest.approx(np.hypot(0.03, 0.0125), rel=0.03)
    for frequency in (24.6, 49.2, 98.4):
        # An amplitude of sqrt(2) times an rms of a sixth of the power; the noise adds some percent of it.
        assert amplitude_at(heave[:, 2], frequency) == pytest.approx(0.03 / np.sqrt(3.0), rel=0.1)
    moving = gliding(coach, line, 10.0, duration_s=6.0)
    assert shaken(Vibration(passengers=Passengers()), moving, coach)[0]["body"][:, 2].std() < 1e-12
    assert shaken(Vibration(traction=Traction()), moving, coach)[0]["body"][:, 2].std() < 1e-9


def test_structure_borne_share(coach, line):
    """The floor has 2 % of the mean heave of both frames besides its own."""
    truth = gliding(coach, line, 15.0, duration_s=2.0)
    rough = Vibration(rails=RailSources(Roughness(TABLES["eu_2021_1226_m"])), support=SUPPORT)
    without = shaken(rough, truth, coach)[0]
    with_it = shaken(replace(rough, structure_borne=0.02), truth, coach)[0]
    frames = 0.5 * (without["frame_front"] + without["frame_rear"])[:, :3]
    np.testing.assert_allclose(with_it["body"][:, :3] - without["body"][:, :3], 0.02 * frames, atol=1e-12)


def test_creep_is_that_of_the_speed_over_the_way(coach, line):
    """At a constant speed it is that; of halves of the way at V and 3 V it is 2 V; at rest contacts hold."""
    creeps = Vibration(lateral_creep=True)

    def damping(speed_mps):
        return linear_vehicle_of(creeps, coach, gravity_mps2=9.81, speed_mps=speed_mps).damping

    steady = gliding(coach, line, 12.0, duration_s=4.0)
    np.testing.assert_allclose(
        Shaker(creeps, steady, coach, seed=1).vehicle.damping, damping(12.0), rtol=1e-6
    )
    t = steady.time_s
    place = 200.0 + np.where(t < 3.0, 6.0 * t, 18.0 + 18.0 * (t - 3.0))  # 18 m at 6, 18 m at 18 m/s
    mixed = replace(steady, reference_position_m=place)
    np.testing.assert_allclose(Shaker(creeps, mixed, coach, seed=1).vehicle.damping, damping(12.0), rtol=1e-6)
    at_rest = replace(steady, reference_position_m=np.full(len(t), 200.0))
    held = linear_vehicle_of(Vibration(), coach, gravity_mps2=9.81, speed_mps=12.0)
    assert Shaker(creeps, at_rest, coach, seed=1).vehicle.coordinates == held.coordinates


def running_mean_square(force, rate_hz, averaging_s):
    """Running means of a force (n,) and of the square of what it has beside them, as linear filters."""
    kept = np.exp(-1.0 / (rate_hz * averaging_s))
    smooth = ([1.0 - kept], [1.0, -kept])
    mean = force[0] + lfilter(*smooth, force - force[0])
    before = np.append(force[0], mean[:-1])
    return lfilter(*smooth, (force - before) * (force - mean))


def test_rectification_is_the_devices_own_coefficient_times_the_mean_square(coach, line):
    """An IMU on a shaking axle: an axis moves by its own coefficient times its mean square vibration.

    The closed form is g^2 times the coefficient. The device takes a running mean of it, which is known sample
    by sample; over many of its time constants it is the variance of the force, but for vibration slower than
    those, and but for a time constant at either end of 6 s: within 0.5 s / 6 s.
    """
    truth = gliding(coach, line, 15.0, duration_s=8.0)
    motions, _ = shaken(replace(ALL, bending=None), truth, coach)
    truth = replace(truth, short_waves=ShortWaves({}, 1.5, motions))
    ideal = load(ImuFile, "imu", "ideal").grade("ideal")
    sheet = replace(
        ideal,
        accel_vibration_rectification_s2pm=1e-3,
        gyro_vibration_rectification_rads3pm2=1e-4,
        vibration_averaging_s=0.5,
    )
    mount = Mount("axle", "axle_f1", (0.0, 1.0, 0.46))
    device = device_of(sheet, seed=1, draw=0, name=mount.name)
    perfect, rectifying = (
        measure(truth, name="r", mount=mount, grade=grade, seed=1, draw=0).imu for grade in (ideal, sheet)
    )
    felt, rate_hz = truth.motion(mount), truth.rate_hz
    at = np.searchsorted(felt.index.to_numpy(), perfect.index.to_numpy() - 0.25 / rate_hz)
    for i, (force, gyro) in enumerate(zip(ACCEL, GYRO, strict=True)):
        square = running_mean_square(felt[force].to_numpy(), rate_hz, 0.5)[at]
        for column, triad in ((force, device.accel), (gyro, device.gyro)):
            added = (rectifying[column] - perfect[column]).to_numpy()
            np.testing.assert_allclose(
                added, triad.rectification[i] * square, rtol=1e-6, atol=1e-9 * abs(added).max() + 1e-13
            )
    late = len(perfect) // 4
    added = (rectifying[ACCEL[2]] - perfect[ACCEL[2]]).to_numpy()[late:].mean()
    variance = felt[ACCEL[2]].to_numpy()[at[late] :].var()
    assert variance > 1.0
    assert added == pytest.approx(device.accel.rectification[2] * variance, rel=0.5 / 6.0)
    assert np.all(np.abs(device.accel.rectification) <= 1e-3)
    assert np.all(np.abs(device.gyro.rectification) <= 1e-4)
    assert (
        device_of(sheet, seed=1, draw=1, name=mount.name).accel.rectification[2]
        != device.accel.rectification[2]
    )


@pytest.fixture
def ride(coach, line, tmp_path, monkeypatch):
    monkeypatch.setattr(ride_cache, "cache_folder", lambda: tmp_path)
    return Ride(
        name="short",
        track=line,
        irregularity=Irregularity("erri_b176_low", (1.5, 100.0), 20.0),
        track_seed=4,
        vehicle=coach,
        profile=SpeedProfile(50.0, 90.0, 10.0, rest_s=1.0, final_rest_s=0.5),
        engine="kinematic",
    )


def test_silence_is_silent_to_the_bit(ride):
    """With and without vibration the engine's own ride is one and the same, in memory and on disk."""
    silent, loud = simulate(ride), simulate(replace(ride, vibration=ALL))
    assert silent.short_waves is None
    for name, body in silent.bodies.items():
        for field in ("position", "velocity", "acceleration", "angles", "rate", "angular_acceleration"):
            np.testing.assert_array_equal(getattr(body, field), getattr(loud.bodies[name], field))
    # A vibration of nothing adds nothing, to the bit.
    nothing = simulate(replace(ride, vibration=Vibration()))
    mount = Mount("m", "body", (2.0, 0.3, 1.0))
    quiet, still = silent.motion(mount), nothing.motion(mount)
    np.testing.assert_allclose(still.to_numpy(), quiet.to_numpy(), atol=1e-12)
    difference = loud.motion(mount) - quiet
    assert difference["accel_z_mps2"].std() > 0.01
    assert difference["accel_x_mps2"].std() < 0.5 * difference["accel_z_mps2"].std()


def test_cached_beside_the_ride(ride):
    loud = replace(ride, vibration=ALL)
    assert not is_cached(loud)
    first = simulate(loud)
    assert is_cached(loud) and is_cached(ride)
    again = simulate(loud)
    for name, motion in first.short_waves.motions.items():
        np.testing.assert_array_equal(motion, again.short_waves.motions[name])
    # Another vibration is another part of the same ride.
    other = replace(loud, vibration=replace(ALL, wheels=None))
    assert not is_cached(other)
    simulate(other)
    assert len([r for r in ride_cache.rides() if "vibration" in r.name]) == 2
    # A damaged part is worked out again, be it one bit.
    key = ride_cache.key_of(loud.describe())
    damaged = ride_cache.folder() / key / "motion_6.npy"
    before = np.array(first.short_waves.motions["body"])  # what is mapped is damaged with its file
    content = bytearray(damaged.read_bytes())
    content[-1] ^= 1
    damaged.write_bytes(content)
    told = []
    mended = simulate(loud, told=told.append)
    assert "damaged" in told[0]
    np.testing.assert_array_equal(mended.short_waves.motions["body"], before)


def test_a_wheel_that_would_leave_the_rail_is_told_of(coach, line, tmp_path):
    """A dip of 5 mm at 20 m/s takes off more than the wheel's load."""
    truth = gliding(coach, line, 20.0, duration_s=2.0, rate_hz=1000.0)
    vibration = Vibration(rails=RailSources(welds=Dips(18.0, 5e-3, 0.0)), support=SUPPORT)
    write_short_waves(vibration, truth, coach, tmp_path, seed=1, manifest={})
    short = read_short_waves(tmp_path, len(truth.time_s))
    assert min(short.least_share_of_load.values()) < 0.0
    (line_of_it,) = short.warnings()
    assert "would leave the rail" in line_of_it
    assert ShortWaves({}, 1.5, {}, least_share_of_load={"w": 0.2}).warnings() == []


@pytest.mark.parametrize("cuts", [(0, 1001), (0, 7, 400, 1001), (0, 3, 10, 11, 700, 1001)])
def test_pieces_are_kept_as_one(coach, line, tmp_path, monkeypatch, cuts):
    """Loads of every 7th row of the ride, wherever pieces begin; the least share is that of any of them."""
    wheels = coach.wheel_names
    truth = gliding(coach, line, 20.0, duration_s=1.0, rate_hz=1000.0)
    contact = np.zeros((143, 12))
    truth = replace(truth, contacts=dict.fromkeys(wheels, contact), contact_every=7)
    rng = np.random.default_rng(2)
    loads = rng.normal(0.0, 1e3, (1001, len(wheels)))
    loads[2, 0] = -9e3
    motions = {body: rng.normal(size=(1001, 12)) for body in truth.body_names}

    def pieces():
        for first, last in pairwise(cuts):
            here = slice(first, last)
            yield Piece(first, {body: motion[here] for body, motion in motions.items()}, {}, loads[here])

    shaker = SimpleNamespace(bendings=(), run=pieces)
    monkeypatch.setattr("simrail.ride.vibration.files.Shaker", lambda *_, **__: shaker)
    write_short_waves(ALL, truth, coach, tmp_path, seed=1, manifest={})
    short = read_short_waves(tmp_path, 1001)
    for w, wheel in enumerate(wheels):
        np.testing.assert_allclose(short.loads[wheel], loads[::7, w], rtol=1e-6, atol=1e-3)
    static = coach.wheel_load_n(truth.gravity_mps2)
    least = {wheel: 1.0 + loads[:, w].min() / static[w] for w, wheel in enumerate(wheels)}
    assert short.least_share_of_load == pytest.approx(least)
    for body, motion in motions.items():
        np.testing.assert_allclose(short.motions[body], motion, rtol=1e-6, atol=1e-6)
    shaking = replace(truth, short_waves=short)
    np.testing.assert_allclose(shaking.short_wave_load(wheels[1]), loads[::7, 1], rtol=1e-6, atol=1e-3)
    still = truth.short_wave_load(wheels[0])
    assert len(still) == len(contact) and not still.any()


def test_rates_must_fit(coach, line):
    truth = gliding(coach, line, 10.0, duration_s=1.0, rate_hz=1000.0)
    with pytest.raises(InputError, match="no multiple of the rate of the truth"):
        Shaker(Vibration(rate_hz=1500.0), truth, coach, seed=1)
