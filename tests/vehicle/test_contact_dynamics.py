"""The contact in motion: an axle under a sprung mass, integrated by a plain RK4 written here.

Klingel's wavelength, step halving with its negative control, rest, reversal, independent wheels.
"""

from functools import cache

import numpy as np
import pytest

from simrail.core.jit import njit
from simrail.vehicle.contact.contact import Motion, RailHere, static_height, wheel_force
from simrail.vehicle.contact.contact_geometry import build_contact
from simrail.vehicle.contact.creep_laws import CreepLaw
from simrail.vehicle.contact.profiles import conical_wheel, rail_60e1, s1002
from simrail.vehicle.contact.wheelset import conicity, contact_state, push_sideways

AXLE_KG, FRAME_KG, ROLL_KGM2, SPIN_KGM2 = 1500.0, 9300.0, 700.0, 60.0
LOAD_N = 0.5 * (AXLE_KG + FRAME_KG) * 9.81
# y z phi psi (axle), y z (frame), two spins, then their rates, then eight creep states.


@cache
def table(**options):
    return build_contact(s1002(), rail_60e1(), static_load_n=LOAD_N, **options)


@njit
def rails(s, fade_m, waves, out):
    # Per wave: amplitude, wave number, phase; y_left, z_left, y_right, z_right and derivatives,
    # fading in over fade_m: a hard start rings for seconds, differently for every step size.
    out[:] = 0.0
    q = min(max(s / fade_m, 0.0), 1.0)
    fade, slope = q * q * q * (10.0 - 15.0 * q + 6.0 * q * q), 30.0 * (q * (1.0 - q)) ** 2 / fade_m
    for k in range(4):
        for n in range(waves.shape[1]):
            a, w, p = waves[k, n]
            out[k] += fade * a * np.sin(w * s + p)
            out[4 + k] += fade * a * w * np.cos(w * s + p) + slope * a * np.sin(w * s + p)
    return fade


@njit
def rates(s, V, x, dx, patches, const, par, waves, rail):
    fade = rails(s, par[11], waves, rail)
    y, z, phi, psi, yf, zf = x[0], x[1], x[2], x[3], x[4], x[5]
    v = x[6:14]
    kappa, outward, rigid, kx, ky, kz, free = (
        fade * par[0],
        fade * par[1],
        par[2],
        par[3],
        par[4],
        par[5],
        par[6],
    )
    for i in range(6):
        dx[i] = v[i]
    fy = fz = mx = mz = 0.0
    tx = 0.0
    for n in range(2):
        side = 1.0 - 2.0 * n
        motion = Motion(y, z, phi, psi, V, V * (1.0 - kappa * y), v[0], v[1], v[2], v[3], v[6 + n], kappa)
        here = RailHere(const.friction, rail[2 * n], rail[2 * n + 1], rail[4 + 2 * n], rail[5 + 2 * n])
        creep, creep_rate = x[14 + 4 * n : 18 + 4 * n], dx[14 + 4 * n : 18 + 4 * n]
        wheel = wheel_force(patches, const, side, motion, here, creep, creep_rate)
        rail[8] = max(rail[8], wheel.flag)
        fy += wheel.fy
        fz += wheel.fz
        mx += wheel.mx
        mz += wheel.mz
        torque = -psi * wheel.mx + wheel.my + phi * wheel.mz
        dx[6 + 6 + n] = torque / 60.0
        tx += torque / 60.0
    if rigid > 0.0:
        dx[12] = dx[13] = 0.5 * tx
    # Springs at +-1 m between axle and frame; frame follows the track in all but y and z.
    qy = ky * (yf - y) + par[7] * (v[4] - v[0])
    qz = kz * (zf - z) + par[8] * (v[5] - v[1])
    dx[6] = (fy + free * qy - 1500.0 * outward) / 1500.0
    dx[7] = (fz + qz - 1500.0 * 9.81) / 1500.0
    dx[8] = (mx - (kz * phi + par[8] * v[2]) * 1.0) / 700.0
    dx[9] = (mz - kx * psi) / 700.0
    dx[10] = (-qy - 9300.0 * outward - par[9] * v[4] - par[10] * yf) / 9300.0
    dx[11] = (-qz - 9300.0 * 9.81) / 9300.0


@njit
def ride(x, h, steps, every, speeds, patches, const, par, waves):
    # speeds: V at start, acceleration, time at which it ends. RK4 with V(t) given.
    n = x.size
    k1, k2, k3, k4 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    rail = np.zeros(9)
    out = np.zeros((steps // every, 6))
    s = 0.0
    V0, a, turn = speeds[0], speeds[1], speeds[2]
    for i in range(steps):
        t = i * h
        Va = V0 + a * min(t, turn)
        Vb = V0 + a * min(t + 0.5 * h, turn)
        Vc = V0 + a * min(t + h, turn)
        rates(s, Va, x, k1, patches, const, par, waves, rail)
        if i % every == 0:
            j = i // every
            out[j] = k1[6], k1[7], x[0], s, Va, rail[8]
        sb, sc = s + 0.25 * h * (Va + Vb), s + h * (Va + 4.0 * Vb + Vc) / 6.0
        rates(sb, Vb, x + 0.5 * h * k1, k2, patches, const, par, waves, rail)
        rates(sb, Vb, x + 0.5 * h * k2, k3, patches, const, par, waves, rail)
        rates(sc, Vc, x + h * k3, k4, patches, const, par, waves, rail)
        for j in range(n):
            x[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
        s = sc
    return out


def start(contact, V, kz, y=0.0):
    x = np.zeros(22)
    x[0] = y
    x[1] = static_height(contact)
    x[4] = y
    x[5] = x[1] - FRAME_KG * 9.81 / kz
    x[12:14] = V / contact.const["wheel_radius_m"]
    return x


def run(contact, *, seconds, h, V, amplitude=0.0, lengths=(), y=0.0, outward=0.0, radius=np.inf,
        rigid=False, acceleration=0.0, turn=0.0, free=1.0, soft=(2 * 8e6, 2 * 4e6, 2 * 1.2e6), seed=3,
        frame_stiffness=0.0, fade_m=30.0, push=0.0, every_s=1e-3):  # fmt: skip
    kx, ky, kz = soft
    waves = np.zeros((4, max(len(lengths), 1), 3))
    waves[:, :, 1] = 1.0
    if len(lengths):
        rng = np.random.default_rng(seed)
        waves[:, :, 0] = amplitude / np.sqrt(len(lengths)) * np.array([1.0, 0.5, 1.0, 0.5])[:, None]
        waves[:, :, 1] = 2.0 * np.pi / np.asarray(lengths)
        waves[:, :, 2] = rng.uniform(0.0, 2.0 * np.pi, (4, len(lengths)))
        waves[2, :, 2] = waves[0, :, 2] + 0.5  # alignment more than gauge
    kappa = 0.0 if np.isinf(radius) else 1.0 / radius
    par = np.array(
        [kappa, outward, float(rigid), kx, ky, kz, free, 2 * 2e4, 2 * 1.5e4, 3e4, frame_stiffness, fade_m]
    )
    x = start(contact, V, kz, y)
    x[6] = push
    steps = round(seconds / h)
    return ride(
        x, h, steps, round(every_s / h), np.array([V, acceleration, turn]), contact.patches, contact.const,
        par, waves,
    )  # fmt: skip


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


WAVES = {"lengths": (3.3, 5.1, 9.7, 17.0)}
# Peak of the four waves in words; each has a quarter of it. With it the lateral acceleration that the case
# was first measured with (rms, m/s2), independent wheels, and what 0.5 against 0.25 ms may differ by.
CASES = {
    "smooth curve, 1 mm": (
        {"V": 20.0, "radius": 300.0, "amplitude": 0.5e-3, **WAVES}, 0.15, 1e-4),
    "sharp curve with 2 m/s2 uncompensated, 2.5 mm: on the flange": (
        {"V": 20.0, "radius": 200.0, "outward": 2.0, "amplitude": 1.25e-3, **WAVES}, 0.60, 2e-3),
    "straight at 40 m/s, 4 mm": (
        {"V": 40.0, "amplitude": 2e-3, "lengths": (4.1, 6.3, 11.0, 19.0)}, 2.2, 2e-3),
    "curve, 2 mm in 1.5 to 8 m: the flange hammers": (
        {"V": 20.0, "radius": 300.0, "outward": 2.0, "amplitude": 1e-3, "lengths": (1.5, 2.4, 4.3, 8.0)},
        2.3, 5e-3),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("rigid", [False, True])
def test_halving_the_step_divides_the_error_by_sixteen(case, rigid):
    """Successive halvings: ratio 10 to 24. 0.5 against 0.25 ms: 1e-4, 2e-3 on the flange, 5e-3 hammering."""
    options, signal, limit = CASES[case]
    runs = [run(table(), seconds=4.0, h=h, rigid=rigid, **options)[1500:] for h in (1e-3, 5e-4, 2.5e-4)]
    coarse, fine = (rms(step) for step in np.diff([r[:, 0] for r in runs], axis=0))
    assert fine < limit
    assert 10.0 < coarse / fine < 24.0
    # As hard a case as it says.
    flange = np.mean(runs[2][:, 5] > 1.0)
    if "flange" in case:
        assert 0.01 < flange < 0.6
    else:
        assert flange == 0.0
    if not rigid:
        assert rms(runs[2][:, 0]) == pytest.approx(signal, rel=0.25)


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize("case", list(CASES)[:2])
def test_halving_the_step_with_fastsim(case, rigid):
    """Ratio 10 to 24 as well; below some 1e-5 the points that begin to slide make it first order."""
    options, _, limit = CASES[case]
    contact = table(creep_law=CreepLaw("fastsim"))
    runs = [run(contact, seconds=4.0, h=h, rigid=rigid, **options)[1500:, 0] for h in (1e-3, 5e-4, 2.5e-4)]
    coarse, fine = (rms(step) for step in np.diff(runs, axis=0))
    assert fine < limit
    assert 10.0 < coarse / fine < 24.0


@pytest.mark.slow
def test_negative_control_a_rigid_contact_chatters():
    # eps of 0.5 um instead of 15: the same test must fail, or it proves nothing.
    rigid = table(smoothing=0.22 * 0.5e-6 / table().smoothing_m)
    case = next(options for name, (options, _, _) in CASES.items() if "straight" in name)
    runs = [run(rigid, seconds=4.0, h=h, rigid=True, **case)[1500:, 0] for h in (1e-3, 5e-4, 2.5e-4)]
    coarse, fine = rms(runs[0] - runs[1]), rms(runs[1] - runs[2])
    assert fine > 0.5
    assert coarse / fine < 8.0


@pytest.mark.parametrize("amplitude", [2.5e-3, 4e-3])
def test_free_wheelset_runs_klingels_wavelength(amplitude):
    # No springs but gravity, slow: the first half period against the table's conicity.
    contact = table()
    free = {"rigid": True, "free": 0.0, "soft": (0.0, 8e6, 2.4e6)}
    out = run(contact, seconds=6.0, h=5e-4, V=5.0, y=amplitude, every_s=5e-4, **free)
    y, s = out[:, 2], out[:, 3]
    crossings = np.flatnonzero(np.diff(np.sign(y)))
    first = [s[i] - y[i] * (s[i + 1] - s[i]) / (y[i + 1] - y[i]) for i in crossings[:2]]
    reached = np.abs(y[crossings[0] : crossings[1]]).max()
    expected = 2.0 * np.pi * np.sqrt(0.75 * 0.46 / conicity(contact, reached))
    assert 2.0 * (first[1] - first[0]) == pytest.approx(expected, rel=0.03)


@cache
def cone(conicity_of_wheel):
    """Contact of a cone and what steers it: conicity, half distance, radius at the contact, roll by shift.

    Read off the static equilibrium of a pushed wheelset, which is tested against Wickens' closed forms.
    """
    contact = build_contact(conical_wheel(conicity_of_wheel), rail_60e1(), static_load_n=LOAD_N)
    step = 1e-5
    rest = push_sideways(contact, np.array([-step, step]))
    slope = float(np.diff(rest.radius_left_m - rest.radius_right_m)[0] / (4.0 * step))
    roll = float(np.diff(rest.roll_rad)[0] / (2.0 * step))
    at = contact_state(contact, 1.0, y_m=0.0, z_m=static_height(contact))["tread"]
    return contact, slope, contact.const["tape_circle_half_m"] + at["abscissa_m"], at["radius_m"], roll


def klingel(conicity_of_wheel):
    """Klingel's wavelength for the points of contact, which move by 1 + r roll' per shift of the axle."""
    _, slope, half, radius, roll = cone(conicity_of_wheel)
    return 2.0 * np.pi * np.sqrt(half * radius * (1.0 + radius * roll) / slope)


@pytest.mark.parametrize("lean", [0.05, 0.1, 0.2])
def test_klingels_wavelength_is_the_limit_of_low_speed_and_amplitude(lean):
    """The error shrinks with them (30 m/s, 3 mm; 10, 1; 3, 0.3); extrapolated below 0.2 %, asked 1 %."""
    contact, expected = cone(lean)[0], klingel(lean)
    # Its textbook form, without roll and with the tape circle's half distance and radius.
    assert expected == pytest.approx(2.0 * np.pi * np.sqrt(0.75 * 0.46 / lean), rel=0.03)
    errors = []
    for V, amplitude in ((30.0, 3e-3), (10.0, 1e-3), (3.0, 3e-4)):
        out = run(
            contact, seconds=1.5 * expected / V, h=5e-4, V=V, y=amplitude, every_s=5e-4, rigid=True, free=0.0,
            soft=(0.0, 8e6, 2.4e6),
        )  # fmt: skip
        y, s = out[:, 2], out[:, 3]
        i = np.flatnonzero(np.diff(np.sign(y)))
        crossings = s[i] - y[i] * (s[i + 1] - s[i]) / (y[i + 1] - y[i])
        errors.append(2.0 * (crossings[1] - crossings[0]) / expected - 1.0)
    assert abs(errors[0]) > abs(errors[1]) > abs(errors[2])
    # Inertia against creep forces: second order in the speed.
    assert abs(errors[2] + (errors[2] - errors[1]) * 9.0 / (100.0 - 9.0)) < 2e-3


@pytest.mark.parametrize("lean", [0.05, 0.1, 0.2])
def test_a_rigid_wheelset_settles_where_its_radii_fit_a_balanced_curve(lean):
    """Outward by b r/(conicity R), to 0.2 %: free to yaw, so no steering force shifts it.

    Pure rolling: the radii are as the distances from the curve's centre, r_right/r_left =
    (R + b)/(R - b), and their difference is 2 conicity times the shift.
    """
    contact, slope, half, radius, _ = cone(lean)
    curve = 100.0 / lean
    out = run(
        contact, seconds=80.0, h=1e-3, V=2.0, radius=curve, rigid=True, soft=(0.0, 8e6, 2.4e6), fade_m=60.0
    )
    y, s = out[:, 2], out[:, 3]
    last = s > s[-1] - klingel(lean)
    assert np.ptp(y[last]) < 1e-4
    assert y[last].mean() == pytest.approx(-half * radius / (slope * curve), rel=2e-3)
    assert y[last].mean() < -2.8e-3


def test_independent_wheels_do_not_hunt():
    out = run(table(), seconds=8.0, h=5e-4, V=10.0, y=2e-3, free=0.0)
    y = out[:, 2]
    # Gravity alone brings it back, slowly and without swinging through, where a rigid wheelset swings.
    assert y.min() > 0.0
    assert (np.diff(y[200:]) < 0.0).all()
    rigid = run(table(), seconds=8.0, h=5e-4, V=10.0, y=2e-3, free=0.0, rigid=True, soft=(0.0, 8e6, 2.4e6))
    assert rigid[:, 2].min() < -1e-3


def test_standstill_is_quiet_and_does_not_drift():
    out = run(table(), seconds=4.0, h=5e-4, V=0.0, y=0.0)
    last = out[2000:]
    assert np.abs(last[:, :2]).max() < 1e-4
    assert np.ptp(last[:, 2]) < 1e-8


def test_a_push_at_rest_rings_out_at_any_step():
    # Without its Voigt part the tangential contact spring (about 200 Hz) is undamped at rest.
    for h in (2.5e-4, 2.5e-5):
        out = run(table(), seconds=0.25, h=h, V=0.0, push=1e-3, frame_stiffness=2e6)
        a = out[:, 0] - np.convolve(np.pad(out[:, 0], 10, mode="edge"), np.full(21, 1.0 / 21.0), mode="valid")
        assert rms(a[:20]) > 0.1
        assert rms(a[150:200]) < 5e-3 * rms(a[:20])


@pytest.mark.parametrize("rigid", [False, True])
def test_brake_to_a_stop_and_run_back_is_smooth_and_converges(rigid):
    # 3 m/s to -3 m/s at 1.5 m/s2 over an uneven track: no chatter around V = 0.
    options = {"V": 3.0, "acceleration": -1.5, "turn": 4.0, "amplitude": 1e-3, "lengths": (1.3, 2.1)}
    options |= {"fade_m": 1.0, "rigid": rigid}
    runs = [run(table(), seconds=6.0, h=h, **options) for h in (1e-3, 5e-4, 2.5e-4)]
    a = [r[500:, 0] for r in runs]
    coarse, fine = rms(a[0] - a[1]), rms(a[1] - a[2])
    slow = np.abs(runs[2][500:, 4]) < 0.2
    assert fine < 1e-4
    assert 8.0 < coarse / fine < 24.0
    assert rms(a[2][slow]) < 2.0 * rms(a[2])
