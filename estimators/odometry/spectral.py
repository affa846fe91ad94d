"""How fast a train runs by how it shakes: spectral speed (Veillard et al. 2016, paper 003, section II.A).

The vertical accelerometer is cut into frames, and of each the amplitudes of its spectrum are summed up:

    S = sum over k of abs(H_k),     v = slope sqrt(S) + intercept            (paper 003, Eqs. 1 and 2)

Slope and intercept belong to a vehicle, a place on it and the rails: they are found on rides whose speed is
known (`calibrate`), or the intercept where the train stands. Nothing but the vertical accelerometer enters,
and, for its sign, the direction of running (`simrail.estimators.odometry.direction`).

What of the paper is mended or added (EQUATIONS 4):

* The sum as printed begins with k = 0. Of 1024 samples gravity alone makes abs(H_0) = 5.4e3 m/s2 and, by
  Hamming's window, abs(H_1) = 2.3e3, where all that a floor shakes at rest makes some 200: the sum begins at
  k = 2, and each frame's mean is taken off. ``printed = true`` leaves both in: fitted to the ride's own
  speed, on the bogie frame of a metro over 3 km and back (three draws of the rails), that leaves 1.5 to
  3.7 m/s rms in place of 1.4 to 2.7.
* A frame of 1024 samples at 250 Hz is 4.1 s long: its speed is dated at its centre, and known at its end.
  What is said of the present is led on from there. Dated at its end: 1.9 to 3.0 m/s on those rides.
* The paper does not say where its IMU was, nor its rate. A bogie frame shakes by its speed. A floor shakes by
  what stands at any speed: a line fitted to the ride itself (scenario `imu_only`, seed 401, 250 Hz) leaves
  2.4 m/s on the frame and 7.1 on the floor; there 5.1 with silent motors, and 4.3 without equipment and
  passengers as well, beside the sensor's own noise. Motors work when a train is slow: they lift sqrt(S) at 10
  to 15 m/s above that at 20. At 125 Hz the floor has 5.2, at 62.5 Hz, in frames of 512, 4.3: the sum over
  frequencies that tell nothing is what spoils it.
* sqrt(S) is linear in the speed on average only: rough and smooth sections differ by metres per second, over
  hundreds of metres, and a calibration of other rails is wrong for the whole ride. Standard deviations have
  both, the latter as one constant factor of speed and way.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from simrail.estimators.odometry.calibration_file import SpectralCalibration
from simrail.estimators.odometry.direction import BLOCK_S, DIRECTIONS, running_direction
from simrail.estimators.odometry.encoder import EncoderOdometry
from simrail.estimators.odometry.spectral_kernel import led_on, spectral_filter
from simrail.estimators.odometry.standstill import quiet_of
from simrail.estimators.odometry.vertical import vertical_force

from simrail.core.columns import ODOMETRY, ODOMETRY_SD
from simrail.core.errors import InputError, one_of
from simrail.core.jit import FloatArray, IntArray
from simrail.estimation.estimate import Estimate
from simrail.recording.recording import Recording

FRAME = 1024
"""Samples of a frame (paper 003, section II.A)."""

HOP = 128
"""Samples from frame to frame: seven eighths overlap. The paper does not give it."""

LONGEST_FRAME_S = 10.24
"""A train that gains 1 m/s2 is 10 m/s faster at the end of such a frame; 1024 samples at 100 Hz last as
long."""

CALIBRATIONS = ("given", "standstill", "encoder")
"""Slope and intercept given; slope given, intercept from the first rest, as the paper; both from the ride's
own encoder, over the whole ride: an ablation."""

ACCELERATION_MPS2, ACCELERATION_S = 0.7, 10.0
"""Standard deviation and correlation time of the acceleration of a train that stops every kilometre: 1 m/s2
for half of its time, some ten seconds each."""

ROUGH_S = 10.0
"""Correlation time of the error that rough and smooth sections make: 200 m at 20 m/s."""

START_SD_M = 0.05
"""How well the start of a ride is known."""

LEAST_MPS = 0.1
"""Standard deviation that a frame's speed has at least, where a fit leaves less, as at rest."""

RAYLEIGH = math.sqrt(4.0 / math.pi - 1.0)
"""Standard deviation over mean of one amplitude of the spectrum of noise."""

HAMMING_BINS = 1.82
"""Bins that count as one, since Hamming's window makes neighbours share their noise: 1 + 2 (r1^2 + r2^2) with
r1 = .625 and r2 = .133, the correlations of bins one and two apart."""

_CHUNK = 256


class Frames(NamedTuple):
    """Frames of a recording, m of them.

    Attributes
    ----------
    ends : ndarray of int (m,)
        Last sample of each.
    root : ndarray (m,)
        sqrt(S), (m/s2)^0.5; NaN where the recording has a gap.
    """

    ends: IntArray
    root: FloatArray


class Calibration(NamedTuple):
    """v = slope sqrt(S) + intercept, in m/s for S in m/s2, and the rms of what it leaves, m/s."""

    slope: float
    intercept: float
    rms: float


def spectral_sums(vertical: FloatArray, *, frame: int, hop: int, printed: bool = False) -> FloatArray:
    """S of every frame (paper 003, Eq. 2).

    Parameters
    ----------
    vertical : ndarray (n,)
        Vertical specific force, m/s2.
    frame, hop : int
        Samples of a frame, and from one frame to the next.
    printed : bool
        Sum from k = 0 on, with the mean, as the equation stands; else from k = 2 on without it.

    Returns
    -------
    ndarray (m,)
        m/s2; m = 0 of a recording shorter than a frame.
    """
    if len(vertical) < frame:
        return np.zeros(0)
    cut = np.lib.stride_tricks.sliding_window_view(vertical, frame)[::hop]
    first = 0 if printed else 2
    # Periodic: a constant then shows at k = 0 and 1 and nowhere else.
    window = 0.54 - 0.46 * np.cos(2.0 * np.pi / frame * np.arange(frame))
    sums = np.empty(len(cut))
    for begin in range(0, len(cut), _CHUNK):
        part = cut[begin : begin + _CHUNK]
        part = part if printed else part - part.mean(axis=1, keepdims=True)
        sums[begin : begin + _CHUNK] = np.abs(np.fft.rfft(part * window, axis=1)[:, first:]).sum(axis=1)
    return sums


def frames_of(recording: Recording, *, frame: int = FRAME, hop: int = HOP, printed: bool = False) -> Frames:
    """Frames of the vertical accelerometer.

    Raises
    ------
    InputError
        If there is no vertical signal, or the rate is too low for such frames.
    """
    rate = recording.imu_sheet.rate_hz
    if frame / rate > LONGEST_FRAME_S:
        raise InputError(
            f"the rate is too low for frames of {frame} samples: a train changes its speed within one",
            field="imu.rate_hz",
            value=rate,
            limit=f">= {frame / LONGEST_FRAME_S:g} Hz",
            remedy="record faster, or set a shorter frame",
        )
    force = vertical_force(recording, tells="the speed")
    root = np.sqrt(spectral_sums(force, frame=frame, hop=hop, printed=printed))
    ends = frame - 1 + hop * np.arange(len(root), dtype=np.int64)
    if recording.gaps is not None:
        times = recording.imu.index.to_numpy(dtype=np.float64)
        for start, end in recording.gaps[["start_s", "end_s"]].to_numpy(dtype=np.float64):
            root[(times[ends] > start) & (times[ends - frame + 1] < end)] = np.nan
    return Frames(ends, root)


def calibrate(
    recordings: Sequence[Recording],
    speeds: Sequence[FloatArray],
    *,
    frame: int = FRAME,
    hop: int = HOP,
    printed: bool = False,
) -> Calibration:
    """Slope and intercept by least squares over all frames of rides whose speed is known.

    Parameters
    ----------
    recordings : sequence of Recording
        The rides, their IMUs at the place that is to be calibrated.
    speeds : sequence of ndarray (n,)
        Known speed of each at its IMU samples, m/s, of either sign: its magnitude at each frame's centre is
        taken.
    frame, hop, printed
        As in `frames_of`.

    Raises
    ------
    InputError
        If no two speeds differ.
    """
    roots, known = [], []
    for recording, speed in zip(recordings, speeds, strict=True):
        found = frames_of(recording, frame=frame, hop=hop, printed=printed)
        good = np.isfinite(found.root)
        roots.append(found.root[good])
        known.append(np.abs(speed[found.ends[good] - frame // 2]))
    root, v = np.concatenate(roots), np.concatenate(known)
    if len(v) < 3 or np.ptp(v) == 0.0 or np.ptp(root) == 0.0:
        raise InputError(
            "cannot be calibrated on rides of one speed",
            field="calibration",
            value=", ".join(recording.name for recording in recordings),
            limit="frames at two speeds or more",
            remedy="take longer rides that stop and run",
        )
    return _line(root, v)


def _line(root: FloatArray, v: FloatArray) -> Calibration:
    """Least squares of v on sqrt(S); level where sqrt(S) does not vary."""
    off = root - root.mean()
    square = float(off @ off)
    slope = float(off @ (v - v.mean())) / square if square > 0.0 else 0.0
    intercept = float(v.mean() - slope * root.mean())
    return Calibration(slope, intercept, float(np.sqrt(np.mean((v - slope * root - intercept) ** 2))))


class FrameSpeeds(NamedTuple):
    """What frames tell of the speed; m frames.

    Attributes
    ----------
    ends : ndarray of int (m,)
        Last sample of each frame, at which it is known.
    speed : ndarray (m,)
        Signed speed at its centre, m/s; NaN for a frame that tells none.
    direction : ndarray (m,)
        Of running, +-1.
    white_variance : ndarray (m,)
        Of what a frame's own noise adds, (m/s)^2.
    rough_sd_mps : float
        Standard deviation of what sections of the track add.
    """

    ends: IntArray
    speed: FloatArray
    direction: FloatArray
    white_variance: FloatArray
    rough_sd_mps: float


@dataclass(frozen=True)
class SpectralOdometry:
    """Speed by the spectrum of the vertical accelerometer, and position by its sum (paper 003, Eqs. 1 and 2).

    Attributes
    ----------
    slope : float, optional
        rho of Eq. 1, (m/s) / (m/s2)^0.5, from `calibrate` on other rides of the vehicle.
    intercept_mps : float, optional
        beta of Eq. 1, likewise.
    calibration_file : SpectralCalibration, optional
        Both of them by mount, in place of the two numbers. In a scenario, its path.
    calibration : str
        One of `CALIBRATIONS`.
    direction : str
        One of `simrail.estimators.odometry.direction.DIRECTIONS`.
    frame, hop : int
        Samples of a frame, and from one to the next.
    speed_sd_mps : float
        Standard deviation of a frame's speed: 2.5 m/s is paper 003's error; by the encoder, that of its fit.
    calibration_relative_sd : float
        Of the whole ride's speed: what rougher or smoother rails than those of the calibration do. 0.17 is
        the error of the one distance of paper 003.
    printed : bool
        Sum the spectrum as printed, gravity with it.
    """

    slope: float | None = None
    intercept_mps: float | None = None
    calibration: str = "standstill"
    direction: str = "first_acceleration"
    frame: int = FRAME
    hop: int = HOP
    speed_sd_mps: float = 2.5
    calibration_relative_sd: float = 0.17
    printed: bool = False
    calibration_file: SpectralCalibration | None = None

    label = "spectral odometry"
    cites = ("veillard_2016",)

    def __post_init__(self) -> None:
        one_of(self.calibration, CALIBRATIONS, "no such calibration", field="calibration")
        one_of(self.direction, DIRECTIONS, "no such direction", field="direction")
        for name, least in (("frame", 16), ("hop", 1)):
            if getattr(self, name) < least:
                raise InputError(
                    "is out of range", field=name, value=getattr(self, name), limit=f">= {least}"
                )
        if self.calibration_file is not None and (self.slope is not None or self.intercept_mps is not None):
            raise InputError(
                "numbers and a file cannot both be given",
                field="slope" if self.slope is not None else "intercept_mps",
                value=self.slope if self.slope is not None else self.intercept_mps,
                limit="none beside a calibration_file",
                remedy="give up one of the two",
            )
        if self.hop > self.frame:
            raise InputError(
                "leaves samples out", field="hop", value=self.hop, limit=f"<= frame, {self.frame}"
            )
        for name in ("speed_sd_mps", "calibration_relative_sd"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError("is out of range", field=name, value=getattr(self, name), limit="> 0")

    @property
    def causal(self) -> bool:
        """With a calibration that comes from before the ride, or from its first rest."""
        return self.calibration != "encoder"

    @property
    def needs(self) -> tuple[str, ...]:
        """The encoder, where it calibrates or says which way; else the IMU alone."""
        return ("encoder",) if "encoder" in (self.calibration, self.direction) else ()

    @property
    def role(self) -> str:
        """An ablation where the ride's own speed calibrates it: who knows that needs no other."""
        return "ablation" if self.calibration == "encoder" else "method"

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at every IMU sample.

        Raises
        ------
        InputError
            If there is no vertical signal, the rate is too low for the frames, the calibration is not given,
            or the ride has no rest to find it in.
        """
        told, half = self.frame_speeds(recording), self.frame // 2
        led = led_on(
            1.0 / recording.imu_sheet.rate_hz,
            self.frame + self.hop,
            sd=(ACCELERATION_MPS2, told.rough_sd_mps),
            correlation_s=(ACCELERATION_S, ROUGH_S),
        )
        # A train begins its ride at rest; a pace of walking is not excluded.
        start = np.array([START_SD_M**2, 0.1**2, 0.1**2, told.rough_sd_mps**2])
        out = np.empty((len(recording.imu), 6))
        spectral_filter(told.speed, told.white_variance, told.direction, told.ends, half, led, start, out)
        factor = self.calibration_relative_sd * out[:, :3]
        out[:, 3:] = np.sqrt(out[:, 3:] + factor**2)
        out[:, 0] += recording.start_position_m
        states = pd.DataFrame(out, index=recording.imu.index, columns=[*ODOMETRY, *ODOMETRY_SD])
        return Estimate(states=states, mount=recording.mount)

    def frame_speeds(self, recording: Recording) -> FrameSpeeds:
        """What the frames tell, by the calibration; raises as `estimate`."""
        found = frames_of(recording, frame=self.frame, hop=self.hop, printed=self.printed)
        slope, intercept, rms = self._calibration(recording, found)
        direction = running_direction(recording, self.direction)[found.ends]
        noise = 0.5 * RAYLEIGH / math.sqrt(0.5 * self.frame / HAMMING_BINS)
        return FrameSpeeds(
            ends=found.ends,
            speed=direction * (slope * found.root + intercept),
            direction=direction,
            white_variance=(noise * slope * found.root) ** 2,
            rough_sd_mps=rms,
        )

    def _calibration(self, recording: Recording, found: Frames) -> tuple[float, float | FloatArray, float]:
        """Slope, intercept (where it is found on the way, at each frame), and what they leave."""
        if self.calibration == "encoder":
            states = EncoderOdometry().estimate(recording).states
            speed = np.abs(states["speed_mps"].to_numpy(dtype=np.float64))
            good = np.isfinite(found.root)
            if not good.any():
                return Calibration(0.0, 0.0, self.speed_sd_mps)
            fit = _line(found.root[good], speed[found.ends[good] - self.frame // 2])
            return fit._replace(rms=max(fit.rms, LEAST_MPS))
        slope, intercept = self.slope, self.intercept_mps
        if self.calibration_file is not None:
            line = self.calibration_file.of(recording.mount)
            slope, intercept = line.slope, line.intercept_mps
        if slope is None or (intercept is None and self.calibration == "given"):
            raise InputError(
                "is not given: how a vehicle shakes at which speed is found on other rides of it",
                field="slope" if slope is None else "intercept_mps",
                value="none",
                limit="(m/s) per sqrt(m/s2)" if slope is None else "m/s",
                remedy="give a calibration_file, see simrail.estimators.odometry.spectral.calibrate, or set "
                'calibration = "encoder"',
            )
        if self.calibration == "given" and intercept is not None:
            return slope, intercept, self.speed_sd_mps
        return slope, -slope * self._root_at_rest(recording, found), self.speed_sd_mps

    def _root_at_rest(self, recording: Recording, found: Frames) -> FloatArray:
        """Mean sqrt(S) over the frames of the first rest so far, at each frame; NaN before the first such."""
        block = max(1, round(BLOCK_S * recording.imu_sheet.rate_hz))
        quiet = quiet_of(recording, block)
        # Blocks that moved, before each block: a frame rests if none of those that it reaches into did.
        moved = np.concatenate([[0], np.cumsum(~quiet)])
        last = (found.ends + 1) // block
        first = (found.ends - self.frame + 1) // block
        rests = (moved[last] == moved[first]) & np.isfinite(found.root)
        if len(rests) and not rests.any():
            raise InputError(
                "the ride has no rest as long as a frame to find the intercept in",
                field="calibration",
                value=self.calibration,
                limit=f"a rest of {self.frame / recording.imu_sheet.rate_hz:.1f} s",
                remedy='give slope and intercept_mps with calibration = "given"',
            )
        # Only the first rest: the paper calibrates when the system is switched on.
        over = np.cumsum(np.concatenate([[0], np.diff(rests.astype(int)) < 0])) if len(rests) else rests
        counts = rests & (over == 0)
        total = np.cumsum(np.where(counts, found.root, 0.0))
        with np.errstate(invalid="ignore"):
            return np.asarray(total / np.cumsum(counts))
