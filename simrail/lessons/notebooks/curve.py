"""Lesson 2: centripetal acceleration read as gravity. Served by ``simrail lesson curve``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="simrail: a curve felt as a slope")

with app.setup:
    import marimo as mo
    import numpy as np
    from simrail.estimators.attitude.complementary import ComplementaryFilter
    from simrail.estimators.attitude.ekf import AttitudeEkf

    from simrail import measure, score, with_odometry
    from simrail.lessons.claims import Claim, about, conclusion
    from simrail.lessons.figures import Line, Panel, draw
    from simrail.lessons.rides import ON_BODY, one_curve
    from simrail.lessons.scores import markdown, pick
    from simrail.recording.sheets.imu_file import load_imu
    from simrail.scoring.score import reference_of
    from simrail.sensors.encoder import EncoderSpec

    RADIUS_M = 300.0


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 2 · A curve felt as a slope

    An accelerometer cannot tell gravity from acceleration. On a train that runs straight, its Y axis feels
    $g \sin(\text{roll})$, and *whoever divides by g has the roll*. In a curve it feels $v^2/R$ as well.

    The line below has one left curve of 300 m with 76 mm of cant: the right rail is raised, the train rolls
    by $-2.9°$ (left side down). At 44 km/h cant and speed are in balance: a passenger feels **nothing**, and so
    does the accelerometer, which swears that the train stands level.
    """)
    return


@app.cell(hide_code=True)
def _():
    speed = mo.ui.slider(20, 60, 2, value=44, label="speed, km/h", show_value=True)
    speed
    return (speed,)


@app.function
def recorded(speed_kmh: float, grade_name: str = "lord_3dm_gx4_25", rough: float = 1.0):
    """The ride, and what an IMU and an encoder record of it, with the odometry of the encoder."""
    line = one_curve(speed_kmh, rough)
    recording = measure(
        line.truth,
        name="curve",
        mount=ON_BODY,
        grade=load_imu(grade_name)[1],
        encoder=EncoderSpec("wheel", radius_error=0.0),
        seed=1,
        draw=0,
    )
    return line, with_odometry(recording, "encoder"), reference_of(line.truth, recording)


@app.function
def felt_roll_deg(recording, seconds: float = 2.0):
    """Roll as an accelerometer alone has it, smoothed over so many seconds, deg."""
    roll = np.arctan2(recording.imu["accel_y_mps2"], recording.imu["accel_z_mps2"])
    return np.rad2deg(roll.rolling(round(250.0 * seconds), center=True, min_periods=1).mean().to_numpy())


@app.cell(hide_code=True)
def _(speed):
    _line, _recording, _reference = recorded(speed.value)
    _time = _recording.imu.index.to_numpy()
    _every = slice(None, None, 15)
    _true = np.rad2deg(_reference.motion["roll_rad"].to_numpy())
    _felt = felt_roll_deg(_recording)
    _c = (_time > _line.curve_s[0]) & (_time < _line.curve_s[1])
    mo.vstack(
        [
            mo.Html(
                draw(
                    [
                        Panel(
                            "roll, °",
                            [
                                Line("true", _time[_every], _true[_every], "true", width=2.0),
                                Line("felt by the accelerometer", _time[_every], _felt[_every], "second"),
                            ],
                            spans=[_line.curve_s],
                            limits=(-4.5, 4.5),
                        )
                    ],
                    x_label="time, s (shaded: the full curve)",
                    description="Roll, true and felt",
                    tall_in=2.6,
                )
            ),
            mo.md(
                f"In the full curve: truly **{_true[_c].mean():.2f}°**, felt **{_felt[_c].mean():.2f}°**; "
                f"the difference is {(_felt - _true)[_c].mean():.2f}°, and atan(v²/Rg) is "
                f"{np.rad2deg(np.arctan((speed.value / 3.6) ** 2 / RADIUS_M / 9.81)):.2f}°."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: at which speed does the accelerometer tell the truth?": mo.md(
                "At none but zero. At 44 km/h it feels *nothing*, which is wrong by the whole cant. That a ride is "
                "comfortable says that gravity and curve add up along the floor, not that the floor is level."
            ),
            "Question: twice the speed. How many times the error?": mo.md(
                "Four times: it grows with v². From 22 to 44 km/h: 0.73° to 2.9°."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## A filter believes the accelerometer in the long run

    The gyro is right for a moment, the accelerometer in the mean: so a filter follows the gyro at first and is drawn
    to the accelerometer with a time constant $T$. In a curve that lasts longer than $T$, it ends up with what the
    accelerometer says.

    **Compensation**: a train that knows where it is knows the curve of its track there, and with its speed the
    acceleration $v^2/R$. It takes that off before it asks for gravity.
    """)
    return


@app.cell(hide_code=True)
def _():
    constant = mo.ui.slider(2, 60, 2, value=10, label="time constant T, s", show_value=True)
    compensated = mo.ui.switch(value=False, label="compensation")
    mo.hstack([constant, compensated], justify="start", gap=3, wrap=True)
    return compensated, constant


@app.cell(hide_code=True)
def _(compensated, constant, speed):
    _line, _recording, _reference = recorded(speed.value)
    _time = _recording.imu.index.to_numpy()
    _every = slice(None, None, 15)
    _true = np.rad2deg(_reference.motion["roll_rad"].to_numpy())
    _filter = ComplementaryFilter(time_constant_s=constant.value, compensated=compensated.value)
    _states = _filter.estimate(_recording).states
    _roll = np.rad2deg(_states["roll_rad"].to_numpy())
    _pitch = np.rad2deg((_states["pitch_rad"] - _reference.motion["pitch_rad"]).to_numpy())
    mo.vstack(
        [
            mo.Html(
                draw(
                    [
                        Panel(
                            "roll, °",
                            [
                                Line("true", _time[_every], _true[_every], "true", width=2.0),
                                Line("complementary filter", _time[_every], _roll[_every], "first"),
                            ],
                            spans=[_line.curve_s],
                            limits=(-4.5, 4.5),
                        ),
                        Panel(
                            "errors, °",
                            [
                                Line("of roll", _time[_every], (_roll - _true)[_every], "second"),
                                Line("of pitch", _time[_every], _pitch[_every], "third"),
                            ],
                            spans=[_line.curve_s],
                        ),
                    ],
                    x_label="time, s",
                    description="Roll of a complementary filter",
                )
            ),
            mo.md(f"rms over the ride: **{np.sqrt(np.mean((_roll - _true) ** 2)):.3f}°**"),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: without compensation, make T larger. At 30 s and 44 km/h the roll is almost right. Is that the right T?": mo.md(
                "No: two wrongs cancel. The start pushed with 1 m/s² for ten seconds, which the accelerometer took for a nose that "
                "points up by 5.8° (look at the error of pitch). A slow filter still believes some of that in the curve, and there a "
                "wrong pitch turns the yaw rate into a wrong roll rate, v/R · tan(error of pitch), which happens to pull the other "
                "way. At another speed, or farther from the station, it does not. **A good figure is no proof of a good reason.** And "
                "with T the filter trusts the gyro's bias for longer: b T, lesson 1."
            ),
            "Question: with compensation, what is left?": mo.md(
                "A tenth of a degree: the bias of the accelerometer (a bias of 10 mg is 0.57°!), and the body's own "
                "motion against the track. No compensation knows either."
            ),
        }
    )
    return


@app.function
def rms_deg(estimator, recording, reference, window: str = "curve") -> float:
    """Rms error of the roll."""
    figures = score(estimator.estimate(recording), reference, recording, windows=[window], metrics=["rms"])
    return pick(figures, "roll", "rms", window=window)


@app.cell(hide_code=True)
def _(constant, speed):
    _, _recording, _reference = recorded(speed.value)
    _rows = {
        _name: [rms_deg(_one, _recording, _reference, _w) for _w in ("whole", "straight", "curve")]
        for _name, _one in {
            "EKF, compensated": AttitudeEkf(),
            "EKF, uncompensated": AttitudeEkf(compensated=False),
            "complementary, compensated": ComplementaryFilter(constant.value, compensated=True),
            "complementary, uncompensated": ComplementaryFilter(constant.value),
        }.items()
    }
    mo.md(
        "## Methods side by side\n\nRms error of the roll, °, at the speed and the time constant chosen above.\n\n"
        + markdown(_rows, ["whole ride", "straights", "curve"])
    )
    return


@app.cell(hide_code=True)
def _():
    def _claims():
        line, recording, reference = recorded(44.0, "ideal", 0.0)
        time = recording.imu.index.to_numpy()
        inside = (time > line.curve_s[0]) & (time < line.curve_s[1])
        true = np.rad2deg(reference.motion["roll_rad"].to_numpy())
        speed = reference.motion["speed_mps"].to_numpy()[inside]
        expected = np.rad2deg(np.arctan(speed**2 / RADIUS_M / 9.81)).mean()
        difference = (felt_roll_deg(recording, 0.1) - true)[inside].mean()
        # The IMU, 0.6 m over the rails on a slope of 3 degrees, runs on a radius 3 cm larger: nothing beside 1 %.
        found = [about("felt less true roll in the curve is atan(v²/Rg)", difference, expected, 0.01, "°")]
        _, recording, reference = recorded(44.0)
        with_it = rms_deg(AttitudeEkf(), recording, reference)
        without = rms_deg(AttitudeEkf(compensated=False), recording, reference)
        # The bias of this accelerometer is at most 2 mg, 0.115°; the rails' own cross-level adds about 0.05°.
        found.append(Claim("compensated EKF in the curve: rms error", with_it, 0.0, 0.16, "°"))
        found.append(
            Claim(
                "uncompensated it is drawn to what is felt: rms error", without, 0.5 * expected, expected, "°"
            )
        )
        found.append(Claim("compensation takes most of it away: ratio", with_it / without, 0.0, 0.1))
        return found

    claims = _claims()
    return (claims,)


@app.cell(hide_code=True)
def _(claims):
    mo.md(conclusion(claims, script=mo.app_meta().mode == "script"))
    return


if __name__ == "__main__":
    app.run()
