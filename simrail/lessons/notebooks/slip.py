"""Lesson 4: what an encoder says when its wheel slips. Served by ``simrail lesson slip``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="simrail: an encoder on a slipping wheel")

with app.setup:
    import marimo as mo
    import numpy as np

    from simrail import measure, with_odometry
    from simrail.lessons.claims import Claim, about, conclusion
    from simrail.lessons.figures import Band, Line, Panel, draw
    from simrail.lessons.rides import ON_BODY, one_curve
    from simrail.recording.sheets.imu_file import load_imu
    from simrail.scoring.score import reference_of
    from simrail.sensors.encoder import EncoderSpec, Slip

    SPEED_KMH = 50.0
    START_S = 30.0
    RAMP_S = 0.25
    NAMES = {"the wheel alone": "encoder", "wheel, accelerometer and line": "curve_matched"}


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 4 · What an encoder says when its wheel slips

    An encoder counts the turns of a wheel: each turn is $2\pi r$ of way, *if the wheel rolls and its radius is known*.
    Leaves on the rail, a motor that pulls too hard or a brake that grips too well, and the wheel turns faster or slower
    than the train runs. **Creepage** $\xi$ is by how much: $\xi = -1$ is a locked wheel, $\xi = +0.2$ one that spins by
    20 %.

    Let the wheel slip 30 s after the recording begins, at 50 km/h.
    """)
    return


@app.cell(hide_code=True)
def _():
    creepage = mo.ui.slider(-1.0, 0.5, 0.05, value=-0.3, label="creepage ξ", show_value=True)
    duration = mo.ui.slider(1, 10, 0.5, value=4, label="for so long, s", show_value=True)
    radius = mo.ui.slider(-1.0, 1.0, 0.1, value=0.0, label="error of the radius, %", show_value=True)
    method = mo.ui.dropdown(list(NAMES), value="the wheel alone", label="odometry")
    mo.vstack([creepage, duration, radius, method])
    return creepage, duration, method, radius


@app.function
def ridden(creepage: float, duration_s: float, radius_percent: float, odometry: str):
    """The ride, and what its recording says of place and speed."""
    line = one_curve(SPEED_KMH)
    slip = (Slip(START_S, duration_s, creepage, RAMP_S),) if creepage else ()
    recording = measure(
        line.truth,
        name="slip",
        mount=ON_BODY,
        grade=load_imu("lord_3dm_gx4_25")[1],
        encoder=EncoderSpec("wheel", radius_error=0.01 * radius_percent, slip=slip),
        seed=1,
        draw=0,
    )
    return line, with_odometry(recording, odometry), reference_of(line.truth, recording)


@app.function
def lost_m(line, creepage: float, duration_s: float) -> float:
    """Way that the wheel counts too much: creepage times what is run meanwhile, half of each ramp taken off."""
    place = np.interp(
        [START_S + 0.5 * RAMP_S, START_S + duration_s - 0.5 * RAMP_S], line.truth.time_s, line.place_m
    )
    return creepage * float(place[1] - place[0])


@app.cell(hide_code=True)
def _(creepage, duration, method, radius):
    _line, _recording, _reference = ridden(creepage.value, duration.value, radius.value, NAMES[method.value])
    _time = _recording.imu.index.to_numpy()
    _every = slice(None, None, 15)
    _t = _time[_every]
    _motion, _told = _reference.motion, _recording.odometry
    _error = (_told["position_m"] - _motion["position_m"]).to_numpy()
    _sd = _told["position_sd_m"].to_numpy()
    _slid = [(START_S, START_S + duration.value)]
    mo.vstack(
        [
            mo.Html(
                draw(
                    [
                        Panel(
                            "speed, km/h",
                            [
                                Line(
                                    "true",
                                    _t,
                                    3.6 * _motion["speed_mps"].to_numpy()[_every],
                                    "true",
                                    width=2.0,
                                ),
                                Line(method.value, _t, 3.6 * _told["speed_mps"].to_numpy()[_every], "first"),
                            ],
                            spans=_slid,
                        ),
                        Panel(
                            "error of place, m",
                            [Line("error", _t, _error[_every], "second", width=1.8)],
                            bands=[
                                Band(
                                    _t,
                                    -1.96 * _sd[_every],
                                    1.96 * _sd[_every],
                                    "first",
                                    "its own 95 % interval",
                                )
                            ],
                            spans=_slid,
                        ),
                    ],
                    x_label="time, s (shaded: the wheel slips)",
                    description="Speed and place by odometry",
                    tall_in=2.0,
                )
            ),
            mo.md(
                f"At the end the place is wrong by **{_error[-1]:+.2f} m**; creepage times way says "
                f"{lost_m(_line, creepage.value, duration.value):+.2f} m. "
                f"The method says of itself: ± {1.96 * _sd[-1]:.2f} m."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: the wheel is locked for 4 s at 50 km/h. How far is the train lost?": mo.md(
                r"$50/3.6 \cdot 4 \approx 55$ m, and it stays lost: an encoder never gets back what it has not counted. "
                "Only something that knows the *place* (a curve that the map has, a balise) brings it back."
            ),
            "Question: look at the interval. Does the wheel alone know that it is lost?": mo.md(
                "No. Its interval counts pulses and radius; that the wheel does not roll is not among what it thinks of. "
                "Small slips hide in it, long ones do not, and it says the same of both."
            ),
            "Question: choose the other odometry. Why does it not follow the wheel?": mo.md(
                "The accelerometer says that the train has not braked so hard: in innovations, the wheel is an outlier. And "
                "where the curve begins the gyro sees it, the map knows where it lies, and the place is found again."
            ),
            "Question: set the slip to zero and the radius to +1 %. How does that error differ?": mo.md(
                "It grows with the *way*, not with time or speed, and it is there all the time: 1 % of 580 m is 5.8 m. A "
                "calibrated radius, or the length of the line between two curves, takes it away."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(
        "## A sweep: how much slip is too much?\n\nError at the end over the creepage, for the duration chosen above."
    )
    return


@app.function
def final_error_m(creepage: float, duration_s: float, odometry: str, radius_percent: float = 0.0) -> float:
    """Error of the place at the end, m."""
    _, recording, reference = ridden(creepage, duration_s, radius_percent, odometry)
    error = recording.odometry["position_m"] - reference.motion["position_m"]
    return float(error.iloc[-1])


@app.cell(hide_code=True)
def _(duration):
    _creepage = np.array([-1.0, -0.6, -0.3, -0.1, 0.1, 0.3])
    _lines = [
        Line(_name, _creepage, np.array([final_error_m(c, duration.value, _one) for c in _creepage]), _colour)
        for (_name, _one), _colour in zip(NAMES.items(), ("second", "first"), strict=True)
    ]
    mo.Html(
        draw(
            [Panel("error at the end, m", _lines)],
            x_label="creepage",
            description="Final error of place over the creepage",
            tall_in=2.2,
        )
    )
    return


@app.cell(hide_code=True)
def _():
    def _claims():
        line = one_curve(SPEED_KMH)
        expected = lost_m(line, -0.3, 4.0)
        alone = final_error_m(-0.3, 4.0, "encoder")
        matched = final_error_m(-0.3, 4.0, "curve_matched")
        found = [
            # Counts are 1.8 mm; the odometry smooths over a second, which moves ends, not the way between.
            about("the wheel alone is lost by creepage times way", alone, expected, 0.02, "m"),
            Claim(
                "with accelerometer and line it is not: size of the error",
                abs(matched),
                0.0,
                0.1 * abs(expected),
                "m",
            ),
        ]
        way = float(line.place_m[-1] - line.place_m[0])
        found.append(
            about(
                "a radius 1 % too large: error over way",
                final_error_m(0.0, 1.0, "encoder", 1.0) / way,
                0.01,
                0.02,
            )
        )
        recording = ridden(-0.3, 4.0, 0.0, "encoder")[1]
        own = 1.96 * float(recording.odometry["position_sd_m"].iloc[-1])
        found.append(
            Claim(
                "the wheel alone does not know it: error over its own interval", abs(alone) / own, 1.5, 100.0
            )
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
