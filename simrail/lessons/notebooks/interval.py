"""Lesson 5: is the interval true? Served by ``simrail lesson interval``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="simrail: is the interval true?")

with app.setup:
    from dataclasses import replace

    import marimo as mo
    import numpy as np
    from simrail.estimators.attitude.ekf import AttitudeEkf

    from simrail import measure, score
    from simrail.lessons.claims import Claim, about, conclusion
    from simrail.lessons.figures import Band, Line, Panel, draw
    from simrail.lessons.rides import ON_BODY, one_curve
    from simrail.lessons.scores import pick
    from simrail.recording.sheets.grades import ImuGrade
    from simrail.scoring.score import error_of, reference_of
    from simrail.scoring.statistics import anees_bounds

    GYRO, ACCEL, RATE_HZ = 2.6e-4, 1.0e-2, 250.0
    WHITE = ImuGrade("white", RATE_HZ, gyro_noise_radpsqrts=GYRO, accel_noise_mpsqrts=ACCEL)
    NOMINAL = {"coverage50": 50.0, "coverage90": 90.0, "coverage95": 95.0, "coverage99": 99.0}
    SPEED_KMH = 56.0


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 5 · Is the interval true?

    A Kalman filter gives an angle **and** says how wrong it may be: a standard deviation $\sigma$. Whoever closes a line
    at 1.96 $\sigma$ wants to know whether that is true. Two figures tell:

    * **coverage**: the share of errors inside the interval; 95 % of them should be in the 95 % interval;
    * **NEES**: the mean of $(e/\sigma)^2$, which should be 1. Above: too sure. Below: too shy.

    The IMU here has white noise of known size and nothing else, the rails lie as drawn, so that a filter which is told
    the truth *can* be right. You decide what it is told.
    """)
    return


@app.cell(hide_code=True)
def _():
    sure = mo.ui.slider(
        0.25, 5.0, 0.25, value=1.0, label="the filter thinks its noise is smaller by", show_value=True
    )
    bias = mo.ui.slider(
        0, 10, 1, value=0, label="bias of the accelerometer that it is not told, bound ± mg", show_value=True
    )
    rough = mo.ui.slider(
        0.0, 3.0, 0.5, value=0.0, label="roughness of the rails, × ERRI low", show_value=True
    )
    count = mo.ui.slider(2, 10, 1, value=4, label="devices", show_value=True)
    considers = mo.ui.switch(
        value=False, label="it reads the bias in its data sheet, and counts it in its interval"
    )
    mo.vstack([sure, bias, rough, count, considers])
    return bias, considers, count, rough, sure


@app.function
def told(sure: float, considers: bool = False) -> AttitudeEkf:
    """A filter that takes every noise for so many times smaller than it is; the bias of its sheet it may know."""
    return AttitudeEkf(
        tuning="recommended" if considers else "paper_final",
        rest_bias=False,
        gyro_intensity_rad2ps=(GYRO / sure) ** 2,
        accel_sd_mps2=ACCEL * np.sqrt(RATE_HZ) / sure,
        start_sd_rad=1e-4,
    )


@app.function
def estimated(estimator, bias_mg: float = 0.0, rough: float = 0.0, draw_number: int = 0):
    """Estimate of one device, its recording, and what it is compared with."""
    line = one_curve(SPEED_KMH, rough, rest_s=2.0)
    grade = replace(WHITE, accel_turn_on_bias_mps2=9.81e-3 * bias_mg)
    recording = measure(
        line.truth, name="interval", mount=ON_BODY, grade=grade, odometry="truth", seed=5, draw=draw_number
    )
    return estimator.estimate(recording), recording, reference_of(line.truth, recording)


@app.function
def consistency(estimator, count: int, bias_mg: float = 0.0, rough: float = 0.0):
    """NEES (count,) and shares inside the nominal intervals (count, 4), %, of the roll of so many devices."""
    rows = []
    for number in range(count):
        estimate, recording, reference = estimated(estimator, bias_mg, rough, number)
        figures = score(estimate, reference, recording, windows=["whole"], metrics=["nees", *NOMINAL])
        rows.append([pick(figures, "roll", metric) for metric in ("nees", *NOMINAL)])
    values = np.array(rows)
    return values[:, 0], 100.0 * values[:, 1:]


@app.cell(hide_code=True)
def _(bias, considers, count, rough, sure):
    _filter = told(sure.value, considers.value)
    _estimate, _recording, _reference = estimated(_filter, bias.value, rough.value)
    _time = _recording.imu.index.to_numpy()
    _every = slice(None, None, 15)
    _error = error_of(_estimate, _reference, "roll")
    _sd = np.rad2deg(_estimate.states["roll_sd_rad"].to_numpy())
    _nees, _share = consistency(_filter, count.value, bias.value, rough.value)
    _low, _high = anees_bounds(count.value)
    _nominal = np.array(list(NOMINAL.values()))
    _verdict = (
        "too sure"
        if _nees.mean() > _high
        else "too shy"
        if _nees.mean() < _low
        else "nothing speaks against it"
    )
    mo.vstack(
        [
            mo.Html(
                draw(
                    [
                        Panel(
                            "error of roll, °",
                            [Line("error of one device", _time[_every], _error[_every], "second")],
                            bands=[
                                Band(
                                    _time[_every],
                                    -1.96 * _sd[_every],
                                    1.96 * _sd[_every],
                                    "first",
                                    "its 95 % interval",
                                )
                            ],
                        )
                    ],
                    x_label="time, s",
                    description="Error and interval of the roll",
                    tall_in=2.2,
                )
            ),
            mo.Html(
                draw(
                    [
                        Panel(
                            "found inside, %",
                            [
                                Line("as it should be", _nominal, _nominal, "true", dashed=True),
                                Line("this filter", _nominal, _share.mean(axis=0), "first", marks=True),
                            ],
                            limits=(0.0, 105.0),
                        )
                    ],
                    x_label="nominal interval, %",
                    description="Coverage over the nominal interval",
                    tall_in=2.0,
                )
            ),
            mo.md(
                f"NEES of {count.value} devices: **{_nees.mean():.2f}** (a true one lies within {_low:.2f} and {_high:.2f}): "
                f"**{_verdict}**. Inside the 95 % interval: **{_share[:, 2].mean():.1f} %**."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: the filter thinks its noise three times smaller. What NEES, what coverage?": mo.md(
                r"Its $\sigma$ is three times too small: NEES 9, and $P(|z| < 1.96/3) = 49$ % inside \"95 %\". The estimate itself "
                "is as good as before: the *ratio* of its two noises is the same. **Over-confidence does not show in the rms.**"
            ),
            "Question: set it to 0.5. Is a too shy filter harmless?": mo.md(
                "It alarms nobody, and nobody can use it: whoever has to promise 0.1° must promise 0.2°. And in fusion with "
                "others it gets less weight than it deserves."
            ),
            "Question: give the accelerometer 5 mg of bias. Why does no choice of white noise make it true?": mo.md(
                "The error no longer changes from sample to sample: it stays, 0.29° at 5 mg. A filter that believes in white "
                "noise averages it for the whole ride and becomes ever surer of a wrong angle. A constant wants a *state* of "
                "its own, or at least a place in the interval: turn the switch on. The estimate is as wrong as before, but now "
                "it says so."
            ),
            "Question: why does this lesson need several devices, though one has 15000 samples?": mo.md(
                "Its errors hang together over seconds (or, a bias, for ever). For a bound, one device counts once: that is "
                "how the interval of the NEES above is made."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    def _claims():
        count = 10
        low, high = anees_bounds(count)
        nees, share = consistency(told(1.0), count)
        found = [
            Claim("told the truth: NEES within the bounds of ten devices", float(nees.mean()), low, high),
            Claim("told the truth: share in the 95 % interval", float(share[:, 2].mean()), 90.0, 99.0, "%"),
        ]
        sure, inside = consistency(told(3.0), count)
        # The same gain, hence the same errors: its sigma is a third, but for the short start, so NEES is nine times.
        found.append(
            about("noise thought three times smaller: NEES over that", sure.mean() / nees.mean(), 9.0, 0.1)
        )
        found.append(Claim("and the share in the 95 % interval", float(inside[:, 2].mean()), 35.0, 63.0, "%"))

        def rms(estimator) -> float:
            estimate, _, reference = estimated(estimator)
            return float(np.sqrt(np.mean(np.square(error_of(estimate, reference, "roll")))))

        found.append(about("while its rms is what it was: ratio", rms(told(3.0)) / rms(told(1.0)), 1.0, 0.02))
        biased, _ = consistency(told(1.0), 4, bias_mg=5.0)
        found.append(Claim("5 mg that it is not told: NEES", float(biased.mean()), 5.0, 1e3))
        aware, _ = consistency(told(1.0, considers=True), count, bias_mg=5.0)
        found.append(
            Claim("5 mg that its sheet tells, and it counts: NEES", float(aware.mean()), *anees_bounds(count))
        )
        return found

    claims = _claims()
    return (claims,)


@app.cell(hide_code=True)
def _(claims):
    mo.md(conclusion(claims, script=mo.app_meta().mode == "script"))
    return


if __name__ == "__main__":
    app.run()
