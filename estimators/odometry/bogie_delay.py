"""Speed and way from two IMUs on two bogies: what one feels, the other feels L/V later.

Over an irregular rail both shake alike, one after the other, and the delay times the speed is the distance
between them, which a tape measures. So the delay gives the speed itself, without a wheel, a map or a
calibration, at any speed from a walking pace on, and wheels that are out of round do not matter. Dead
reckoning between stops (`simrail.estimators.odometry.zero_velocity`) carries it through what is too slow or
too smooth, tells the searches where to look, and brings the shape of the speed while the train brakes.

The two IMUs have clocks of their own. How far they are apart is a state, and so is how fast that grows: an
offset of 1 ms is 25 mm/s at 20 m/s and next to nothing at 5 m/s, so that the first seconds after each stop,
of which dead reckoning is sure, tell it. The distance of both is a state likewise, within what a tape leaves
open; one that is off by so much that chance does not do it is refused, with the distance that the ride shows.

The method is ours. Delays of two sensors along a track are an old idea (axle counters, two accelerometers in
a bogie); the search along the shape of the speed, and the states of clock and distance, were derived here.

Not here: the search (`simrail.estimators.odometry.bogie_delay_kernel`) and the filter
(`simrail.estimators.odometry.zero_velocity_kernel`).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import signal
from simrail.estimators.odometry.bogie_delay_kernel import Echo
from simrail.estimators.odometry.vertical import vertical_force
from simrail.estimators.odometry.zero_velocity import (
    RATE_HZ,
    SecondImu,
    Trace,
    ZeroVelocityOdometry,
    ends_of_steps,
)
from simrail.estimators.odometry.zero_velocity_kernel import SPACING

from simrail.core.columns import ACCEL
from simrail.core.errors import InputError
from simrail.core.jit import FloatArray
from simrail.estimation.estimate import Estimate
from simrail.recording.check_form import check_pair
from simrail.recording.recording import Recording, SecondImuSheet

SURE = 6.0
"""Standard deviations by which a ride must contradict the spacing before it is refused."""

HIGHEST_SHARE = 0.4
"""Of the rate: what is above is the IMU's own filter's."""

ORDER = 2
"""Of the low pass and of the high pass in the band pass."""

LEAST_OCTAVES = 1.0
"""Width of the band at least: of a narrower one each wave looks like the next."""

CLOCK_DRIFT_SD = 1e-5
"""By how much two clocks' seconds differ where no sheet says it: a quartz' 10 millionths."""

CLOCK_WANDER_SPSQRTS = 1e-6
"""And by this random walk they wander beside that, by temperature."""


@dataclass(frozen=True)
class BogieDelayOdometry:
    """Odometry from two IMUs on two bogies, by the delay of what they feel, and by zero-velocity updates.

    Attributes
    ----------
    smoothed : bool
        Smooth over the whole ride.
    band_hz : tuple of float
        Band of the vertical force that is compared.
    window_s, every_s : float
        Length of what is compared, and how often.
    least_speed_mps, least_correlation : float
        Slower, nothing is searched; less alike, nothing is believed.
    width_sds, width_mps : float
        A search goes so many standard deviations of the speed to either side, and this far at least.
    floor_mps, floor_share : float
        Standard deviation of a delay's speed beside what noise gives it: two bogies are not alike.
    unlike_m, unlike_s : float
        By so much they make the distance seem another one, over so long: standard deviation, and time.
    frame_lag_s : float
        By so much the frame of a bogie follows what its wheels run over, in that band. A lag that is 6 ms off
        makes the distance seem another one by 6 ms times what the train gains in speed between its two
        bogies, 5 to 15 mm, for as long as it gains any.

    Floor, distance and lag are what delays between IMUs without errors had on five simulated rides of
    ``metro_car_gz18``, whose true way is known: lags of 11.8 to 15.1 ms, 11.9 to 12.3 ms where no wheel is
    out of round; beside that the distance seems another one by 14 to 18 mm, a third of which does not outlast
    a window, and the rest fades within 5 to 7 s; over a whole ride 0 to 8 mm remain.
    """

    smoothed: bool = False
    band_hz: tuple[float, float] = (10.0, 60.0)
    window_s: float = 2.0
    every_s: float = 0.5
    least_speed_mps: float = 3.0
    least_correlation: float = 0.4
    width_sds: float = 4.0
    width_mps: float = 0.3
    floor_mps: float = 0.003
    floor_share: float = 0.0005
    unlike_m: float = 0.013
    unlike_s: float = 6.0
    frame_lag_s: float = 0.012

    needs = ("second_imu",)
    cites = ZeroVelocityOdometry.cites

    @property
    def causal(self) -> bool:
        """The filter is causal, the smoother is not."""
        return not self.smoothed

    @property
    def label(self) -> str:
        """What a reader calls it."""
        return "bogie delay odometry, smoothed" if self.smoothed else "bogie delay odometry"

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if name not in ("smoothed", "band_hz") and not 0.0 < value < math.inf:
                raise InputError("is out of range", field=name, value=value, limit="> 0")
        if not self.least_correlation < 1.0:
            raise InputError(
                "is out of range", field="least_correlation", value=self.least_correlation, limit="< 1"
            )
        if not 0.0 < self.band_hz[0] < self.band_hz[1]:
            raise InputError(
                "is no band", field="band_hz", value=list(self.band_hz), limit="[lowest, highest], Hz"
            )

    def estimate(self, recording: Recording) -> Estimate:
        """Estimate position, speed and acceleration along the track at every sample of the first IMU.

        Raises
        ------
        InputError
            If there is no second IMU, it has another rate than the first or sits too near to it, or where the
            ride shows that it does not sit; if the rate is too low for the band, there is no vertical signal,
            or the ride does not begin at rest.
        """
        trace = self.trace(recording)
        return Estimate(states=self._stops().at_imu_times(trace, recording), mount=recording.mount)

    def trace(self, recording: Recording) -> Trace:
        """Run the filter, and the smoother if wanted; all states at its own steps, and what searches found.

        Raises
        ------
        InputError
            As `estimate`.
        """
        sheet = recording.second_imu_sheet
        if recording.second_imu is None or sheet is None:
            raise InputError(
                "the recording has no second IMU, whose delay is the speed",
                field="second_imu",
                limit="an IMU on another bogie",
                remedy="add [second_imu] to the scenario or the ride file, or use ZeroVelocityOdometry",
            )
        check_pair(recording.imu_sheet.rate_hz, sheet.imu.rate_hz, sheet.spacing_m)
        drift = math.hypot(
            CLOCK_DRIFT_SD,
            math.hypot(recording.imu_sheet.clock_drift, sheet.imu.clock_drift) / math.sqrt(3.0),
        )
        second = SecondImu(
            echo=self._echo(recording, sheet),
            sd=np.array(
                [
                    sheet.clock_offset_sd_s,
                    drift,
                    sheet.spacing_sd_m,
                    self.unlike_m,
                    recording.imu_sheet.accel_scale_error / math.sqrt(3.0),
                ]
            ),
            process=np.array(
                [CLOCK_WANDER_SPSQRTS**2, 0.0, 0.0, 2.0 * self.unlike_m**2 / self.unlike_s, 0.0]
            ),
        )
        trace = self._stops().trace(recording, second=second)
        _judge_spacing(trace, sheet)
        return trace

    def _stops(self) -> ZeroVelocityOdometry:
        return ZeroVelocityOdometry(smoothed=self.smoothed)

    def _echo(self, recording: Recording, sheet: SecondImuSheet) -> Echo:
        """Both signals through the band pass, and what a search asks for."""
        second, rate = recording.second_imu, recording.imu_sheet.rate_hz
        assert second is not None
        low, high = self.band_hz[0], min(self.band_hz[1], HIGHEST_SHARE * rate)
        if high < 2.0**LEAST_OCTAVES * low:
            raise InputError(
                "is too low a rate for the band in which two bogies are compared",
                field="imu_sheet.rate_hz",
                value=rate,
                limit=f">= {2.0**LEAST_OCTAVES * low / HIGHEST_SHARE:g} Hz for waves from {low:g} Hz on",
                remedy="record faster, or set band_hz lower",
            )
        window = round(self.window_s * rate)
        every = max(1, round(self.every_s * RATE_HZ))
        return Echo(
            first=_passed(vertical_force(recording, tells="rest from motion"), low, high, rate),
            second=_passed(second[ACCEL[2]].to_numpy(dtype=np.float64), low, high, rate),
            first_s=np.ascontiguousarray(recording.imu.index.to_numpy(dtype=np.float64)),
            second_s=np.ascontiguousarray(second.index.to_numpy(dtype=np.float64)),
            rate_hz=rate,
            end_s=ends_of_steps(recording),
            spacing_m=sheet.spacing_m,
            every=every,
            window=window,
            # The product of two signals up to `high` has nothing above twice that.
            stride=max(1, int(rate / (2.0 * high))),
            window_s=self.window_s,
            lag_s=_lag_s(low, high, rate) + self.frame_lag_s,
            least_speed_mps=self.least_speed_mps,
            least_correlation=self.least_correlation,
            width_sds=self.width_sds,
            width_mps=self.width_mps,
            delay_variance=3.0 / (8.0 * math.pi**2 * self.window_s * (high**3 - low**3)),
            floor_mps=self.floor_mps,
            floor_share=self.floor_share,
            unlike_s=self.unlike_s,
            shared=max(1.0, self.window_s * RATE_HZ / every),
        )


def _judge_spacing(trace: Trace, sheet: SecondImuSheet) -> None:
    """Refuse a spacing that the ride surely contradicts.

    What was learnt of it, m with variance P from P0 before, has the variance P0 - P if all is as told. The
    ride alone would say m P0/(P0 - P), with the variance P P0/(P0 - P).
    """
    assert trace.last is not None
    learnt, before, after = (
        float(trace.found.states[-1, SPACING]) if len(trace.found.states) else 0.0,
        sheet.spacing_sd_m**2,
        float(trace.last[SPACING, SPACING]),
    )
    known = before - after
    if known <= 0.0 or learnt * learnt < SURE**2 * known:
        return
    alone = sheet.spacing_m + learnt * before / known
    raise InputError(
        "the two IMUs are not so far apart as told, by how the speed grows after stops",
        field="second_imu.spacing_m",
        value=sheet.spacing_m,
        limit=f"{alone:.4g} m to {2.0 * math.sqrt(after * before / known):.2g} m",
        remedy="measure it again; or say with spacing_sd_m how well it is known",
    )


def _passed(values: FloatArray, low_hz: float, high_hz: float, rate_hz: float) -> FloatArray:
    """A signal through a band pass that looks at nothing later."""
    sections = signal.butter(ORDER, [low_hz, high_hz], "bandpass", fs=rate_hz, output="sos")
    return np.ascontiguousarray(signal.sosfilt(sections, values - values[0]))


def _lag_s(low_hz: float, high_hz: float, rate_hz: float) -> float:
    """How late that band pass is: the mean of its group delay over the band."""
    frequencies = np.linspace(low_hz, high_hz, 64)
    polynomials = signal.butter(ORDER, [low_hz, high_hz], "bandpass", fs=rate_hz)
    _, samples = signal.group_delay(polynomials, frequencies, fs=rate_hz)
    return float(samples.mean()) / rate_hz
