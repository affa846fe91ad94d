"""Lesson 3: why no IMU at all is hard to beat. Served by ``simrail lesson baseline``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="simrail: no IMU at all")

with app.setup:
    import marimo as mo
    import numpy as np
    from simrail.estimators.attitude.ekf import AttitudeEkf
    from simrail.estimators.baselines import DesignAngles

    from simrail import measure, score, with_odometry
    from simrail.lessons.claims import Claim, about, conclusion
    from simrail.lessons.figures import Line, Panel, draw
    from simrail.lessons.rides import ON_BODY, one_curve
    from simrail.lessons.scores import markdown, pick
    from simrail.recording.sheets.imu_file import load_imu
    from simrail.scoring.score import reference_of
    from simrail.scoring.statistics import compare
    from simrail.sensors.encoder import EncoderSpec
    from simrail.track.map_errors import EXACT, MapErrors, draw_map

    METHODS = {
        "EKF, compensated": AttitudeEkf(),
        "EKF, uncompensated": AttitudeEkf(compensated=False),
        "design angles, no IMU": DesignAngles(),
    }
    GRADES = ["consumer", "industrial", "lord_3dm_gx4_25", "tactical", "navigation", "ideal"]
    SPEED_KMH = 44.0


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 3 · Why no IMU at all is hard to beat

    A train that knows where it is can look up how its track lies there: **design angles**, from the drawing,
    without any inertial sensor. Its roll is wrong by what the rails deviate from the drawing, often less than
    0.1°. A filter with an IMU has to be better than *that*, or it had better be left out.

    Move the roughness of the rails and choose an IMU: where does the IMU begin to pay?
    """)
    return


@app.cell(hide_code=True)
def _():
    rough = mo.ui.slider(
        0.0, 6.0, 0.5, value=1.0, label="roughness of the rails, × ERRI low", show_value=True
    )
    imu = mo.ui.dropdown(GRADES, value="lord_3dm_gx4_25", label="IMU")
    surveyed = mo.ui.switch(value=False, label="the map has the errors of a survey")
    mo.vstack([rough, mo.hstack([imu, surveyed], justify="start", gap=3, wrap=True)])
    return imu, rough, surveyed


@app.function
def recorded(rough: float, grade_name: str, draw_number: int = 0, *, surveyed: bool = False):
    """One recording with its odometry, and what estimates are compared with."""
    line = one_curve(SPEED_KMH, rough)
    errors = MapErrors() if surveyed else EXACT
    recording = measure(
        line.truth,
        name="baseline",
        mount=ON_BODY,
        grade=load_imu(grade_name)[1],
        encoder=EncoderSpec("wheel", radius_error_sd=0.0005),
        seed=1,
        draw=draw_number,
        track_map=draw_map(line.truth.track, errors, seed=1, draw=0) if surveyed else None,
        map_errors=errors,
    )
    return with_odometry(recording, "encoder"), reference_of(line.truth, recording)


@app.function
def rms_deg(estimate, recording, reference, window: str = "whole", against: str = "truth") -> float:
    """Rms error of the roll."""
    figures = score(estimate, reference, recording, windows=[window], metrics=["rms"])
    return pick(figures, "roll", "rms", window=window, reference=against)


@app.cell(hide_code=True)
def _(imu, rough, surveyed):
    _recording, _reference = recorded(rough.value, imu.value, surveyed=surveyed.value)
    _found = {_name: _one.estimate(_recording) for _name, _one in METHODS.items()}
    _time = _recording.imu.index.to_numpy()
    _every = slice(None, None, 15)
    _true = _reference.motion["roll_rad"].to_numpy()
    _lines = [
        Line(
            _name,
            _time[_every],
            np.rad2deg(_found[_name].states["roll_rad"].to_numpy() - _true)[_every],
            _colour,
        )
        for _name, _colour in (("EKF, compensated", "first"), ("design angles, no IMU", "second"))
    ]
    _windows = ("whole", "straight", "curve")
    _rows = {}
    for _name, _one in _found.items():
        _figures = score(_one, _reference, _recording, windows=_windows, metrics=["rms"])
        _rows[_name] = [
            *(pick(_figures, "roll", "rms", window=_window) for _window in _windows),
            pick(_figures, "roll", "rms", reference="design"),
        ]
    mo.vstack(
        [
            mo.Html(
                draw(
                    [Panel("error of roll, °", _lines)],
                    x_label="time, s",
                    description="Error of the roll with and without an IMU",
                    tall_in=2.4,
                )
            ),
            mo.md(
                "Rms error of the roll, °:\n\n"
                + markdown(_rows, ["whole", "straights", "curve", "*whole, against the design*"])
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: the last column scores against the design track, as some papers do. What is wrong with it?": mo.md(
                "Design angles score (almost) zero there by definition: they are compared with themselves. And a filter "
                "that sees the true rails is *punished* for each millimetre that it finds. It can only be a reference "
                "where the rails are as drawn, and then nobody needs an IMU."
            ),
            "Question: at roughness 1 a good IMU loses to none at all. Does that say that the IMU is bad?": mo.md(
                "It says that the question was an easy one. An accelerometer's bias of 2 mg is 0.11° of roll, and these "
                "rails lie within 0.05° of their drawing. Make the rails rougher, or the map worse, and it turns over."
            ),
            "Question: switch the errors of a survey on. What gets worse, and why not only the design angles?": mo.md(
                "The filter is compensated by the same map: a wrong cant is a wrong roll at its start and a wrong radius a "
                "wrong v²/R. An exact map is an ablation, and tables have to say so."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## One device is no answer

    Each device has a bias of its own. Two methods are compared **on the same devices**: the difference, device by
    device, says more than two means, since whatever both suffer from drops out.
    """)
    return


@app.function
def paired(rough: float, grade_name: str, count: int, *, surveyed: bool = False):
    """Rms of the compensated EKF and of the design angles on so many devices, deg: (count, 2)."""
    rows = []
    for number in range(count):
        recording, reference = recorded(rough, grade_name, number, surveyed=surveyed)
        names = ("EKF, compensated", "design angles, no IMU")
        rows.append([rms_deg(METHODS[name].estimate(recording), recording, reference) for name in names])
    return np.array(rows)


@app.cell(hide_code=True)
def _():
    count = mo.ui.slider(2, 8, 1, value=4, label="devices", show_value=True)
    count
    return (count,)


@app.cell(hide_code=True)
def _(count, imu, rough, surveyed):
    _rms = paired(rough.value, imu.value, count.value, surveyed=surveyed.value)
    _told = compare(_rms[:, 0], _rms[:, 1])
    _number = np.arange(1, count.value + 1)
    mo.vstack(
        [
            mo.Html(
                draw(
                    [
                        Panel(
                            "rms, °",
                            [
                                Line("EKF", _number, _rms[:, 0], "first", marks=True),
                                Line("no IMU", _number, _rms[:, 1], "second", marks=True),
                            ],
                            limits=(0.0, 1.15 * float(_rms.max())),
                        )
                    ],
                    x_label="device",
                    description="Rms of the roll by device",
                )
            ),
            mo.md(
                f"The EKF wins on **{100 * _told.win_rate.value:.0f} %** of the devices "
                f"(95 %: {100 * _told.win_rate.low:.0f} to {100 * _told.win_rate.high:.0f} %); the mean difference is "
                f"**{_told.difference.value:+.3f}°** ({_told.difference.low:+.3f} to {_told.difference.high:+.3f})."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    def _claims():
        recording, reference = recorded(1.0, "lord_3dm_gx4_25")
        design = DesignAngles().estimate(recording)
        truth = rms_deg(design, recording, reference)
        line = one_curve(SPEED_KMH, 1.0)
        position = reference.motion["position_m"].to_numpy()
        z = line.rails.rails(position)
        cross = np.rad2deg((z[:, 1] - z[:, 3]) / line.truth.track.rail_base_m)
        found = [
            # By the odometry's place, some decimetres off, the design is read at another place of the transition.
            about(
                "no IMU: its error is the cross-level of the rails, rms",
                truth,
                np.sqrt(np.mean(cross**2)),
                0.1,
                "°",
            ),
            Claim(
                "against the design it would score (almost) nothing: rms",
                rms_deg(design, recording, reference, against="design"),
                0.0,
                0.2 * truth,
                "°",
            ),
        ]
        smooth = paired(0.5, "lord_3dm_gx4_25", 6)
        rough = paired(6.0, "lord_3dm_gx4_25", 6)
        found.append(
            Claim(
                "on smooth rails the IMU wins on few devices: share",
                float(np.mean(smooth[:, 0] < smooth[:, 1])),
                0.0,
                0.35,
            )
        )
        found.append(
            Claim("on rough rails on all: share", float(np.mean(rough[:, 0] < rough[:, 1])), 0.99, 1.0)
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
