"""Lesson 1: why a filter drifts. Served by ``simrail lesson drift``; as a script it checks its claims."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="simrail: why a filter drifts")

with app.setup:
    import marimo as mo
    import numpy as np

    from simrail.lessons.claims import Claim, about, conclusion
    from simrail.lessons.figures import Line, Panel, draw
    from simrail.recording.sheets.allan import overlapping_allan
    from simrail.recording.sheets.grades import ImuGrade
    from simrail.report.pages.imu_page import at_rest

    DEGREE = np.pi / 180.0
    HOUR = 3600.0
    RATE_HZ = 10.0
    DRAWS = 24


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 1 · Why a filter drifts

    A gyro says how fast a body turns. Whoever wants to know how it *stands* adds up what the gyro says, and adds
    up its errors as well. Here a train stands still: **every angle below is error**. Each grey line is one device
    of the same data sheet, each from the first sample on.

    Three figures of a data sheet make the error:

    * **angle random walk** $N$ (deg/√h): white noise; its sum grows with $\sqrt{t}$;
    * **turn-on bias** $b$ (deg/h): a constant, another one each time the device is switched on; its sum
      grows with $t$;
    * **bias instability** $B$ (deg/h): a bias that wanders by itself; no calibration takes it away for long.
    """)
    return


@app.cell(hide_code=True)
def _():
    walk = mo.ui.slider(0.0, 2.0, 0.05, value=0.3, label="angle random walk N, deg/√h", show_value=True)
    bias = mo.ui.slider(0, 60, 1, value=10, label="turn-on bias, bound ±, deg/h", show_value=True)
    wander = mo.ui.slider(0, 30, 1, value=5, label="bias instability B, deg/h", show_value=True)
    minutes = mo.ui.slider(1, 20, 1, value=5, label="time, min", show_value=True)
    mo.vstack([walk, bias, wander, minutes])
    return bias, minutes, walk, wander


@app.function
def grade_of(walk_degprth: float, bias_degph: float, wander_degph: float) -> ImuGrade:
    """A gyro of these three figures and nothing else."""
    return ImuGrade(
        "lesson",
        RATE_HZ,
        gyro_noise_radpsqrts=walk_degprth * DEGREE / np.sqrt(HOUR),
        gyro_turn_on_bias_radps=bias_degph * DEGREE / HOUR,
        gyro_bias_instability_radps=wander_degph * DEGREE / HOUR,
    )


@app.function
def devices(grade: ImuGrade, seconds: float, count: int = DRAWS):
    """Roll rates of several devices at rest, rad/s: one column each."""
    return np.column_stack(
        [at_rest(grade, seconds=seconds, seed=seed)["gyro_x_radps"] for seed in range(count)]
    )


@app.function
def angles(rates):
    """What comes of adding up: angle over time, deg."""
    return np.cumsum(rates, axis=0) / RATE_HZ / DEGREE


@app.function
def expected_deg(grade: ImuGrade, time_s, calibrated_s: float = 0.0):
    """Standard deviation of the angle by white noise and constant bias; after so long a calibration at rest."""
    walk = grade.gyro_noise_radpsqrts**2 * time_s
    bias = grade.gyro_turn_on_bias_radps**2 / 3.0  # uniform between its bounds
    if calibrated_s > 0.0:
        bias = grade.gyro_noise_radpsqrts**2 / calibrated_s
    return np.sqrt(walk + bias * time_s**2) / DEGREE


@app.cell(hide_code=True)
def _(bias, minutes, walk, wander):
    _grade = grade_of(walk.value, bias.value, wander.value)
    _angle = angles(devices(_grade, 60.0 * minutes.value))
    _time = np.arange(1, len(_angle) + 1) / RATE_HZ
    _every = max(1, len(_time) // 400)
    _t, _a, _sd = _time[::_every], _angle[::_every], expected_deg(_grade, _time[::_every])
    _lines = [Line("", _t, _a[:, k], "faint", width=0.8) for k in range(DRAWS)]
    _lines += [
        Line("rms of the devices", _t, np.sqrt(np.mean(_a**2, axis=1)), "second", width=2.0),
        Line("by N and bias alone", _t, _sd, "first", dashed=True, width=1.8),
        Line("", _t, -_sd, "first", dashed=True, width=1.8),
    ]
    mo.vstack(
        [
            mo.Html(
                draw(
                    [Panel("angle, °", _lines)],
                    x_label="time, s",
                    description="Angle of devices at rest over time",
                    tall_in=3.0,
                )
            ),
            mo.md(
                f"After {minutes.value} min the rms of {DRAWS} devices is "
                f"**{np.sqrt(np.mean(_angle[-1] ** 2)):.3f}°**; noise and turn-on bias alone make "
                f"{expected_deg(_grade, _time[-1]):.3f}°."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: N of 0.3 deg/√h and a bias of ±10 deg/h. From when on does the bias make more than the noise?": mo.md(
                r"""
    Noise makes $N\sqrt{t}$, a bias uniform within $\pm b$ makes $b\,t/\sqrt{3}$. They are equal at
    $t = 3N^2/b^2 = 3 \cdot 0.09 / 100$ h $= 9.7$ s. **After ten seconds all that counts is the bias.** That is why the
    first thing a good filter does is to stand still and take its mean.
    """
            ),
            "Question: you double the time. By how much does each part of the error grow?": mo.md(
                "The part of the noise by √2, that of a constant bias by 2. Try it: set the other two to zero."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Stand still first

    A train stands before it leaves. The mean of the gyro over that rest is its bias, but for the noise: after $T$
    seconds an error of $N/\sqrt{T}$ is left, which again grows with time.
    """)
    return


@app.cell(hide_code=True)
def _():
    rest = mo.ui.slider(0, 120, 5, value=20, label="rest before the start, s", show_value=True)
    rest
    return (rest,)


@app.function
def after_rest(rates, rest_s: float):
    """Angles after the start, deg: the mean over the rest is taken off."""
    still = round(rest_s * RATE_HZ)
    mean = rates[:still].mean(axis=0) if still else 0.0
    return angles(rates[still:] - mean)


@app.cell(hide_code=True)
def _(bias, minutes, rest, walk, wander):
    _grade = grade_of(walk.value, bias.value, wander.value)
    _rates = devices(_grade, 60.0 * minutes.value + rest.value)
    _angle = after_rest(_rates, rest.value)
    _time = np.arange(1, len(_angle) + 1) / RATE_HZ
    _every = max(1, len(_time) // 400)
    _lines = [Line("", _time[::_every], _angle[::_every, k], "faint", width=0.8) for k in range(DRAWS)]
    _lines.append(
        Line(
            "rms of the devices",
            _time[::_every],
            np.sqrt(np.mean(_angle[::_every] ** 2, axis=1)),
            "second",
            width=2.0,
        )
    )
    mo.vstack(
        [
            mo.Html(
                draw(
                    [Panel("angle, °", _lines)],
                    x_label="time since the start, s",
                    description="Angle of devices at rest after a calibration",
                    tall_in=2.4,
                )
            ),
            mo.md(
                f"With {rest.value} s of rest: **{np.sqrt(np.mean(_angle[-1] ** 2)):.3f}°** after "
                f"{minutes.value} min. What is left wanders: look at B."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    ## Allan deviation: the three figures in one curve

    Take means over $\tau$ seconds and ask how much one mean differs from the next. White noise falls with
    $1/\sqrt{\tau}$ (at $\tau = 1$ s it *is* $N$), a wandering bias makes a floor, and a constant bias is not seen at
    all: it is the same in every mean.
    """)
    return


@app.function
def allan_degph(grade: ImuGrade, seconds: float, seed: int = 1):
    """Averaging times, s, and Allan deviation of one device and by its closed form, deg/h."""
    series = at_rest(grade, seconds=seconds, seed=seed)["gyro_x_radps"].to_numpy()
    tau = np.unique(np.rint(np.geomspace(1.0, 0.15 * len(series), 28))) / RATE_HZ
    scale = HOUR / DEGREE
    return tau, overlapping_allan(series, RATE_HZ, tau) * scale, grade.allan(tau)["gyro"] * scale


@app.cell(hide_code=True)
def _(bias, walk, wander):
    _grade = grade_of(max(walk.value, 0.01), bias.value, wander.value)
    _tau, _found, _closed = allan_degph(_grade, HOUR)
    mo.Html(
        draw(
            [
                Panel(
                    "Allan deviation, deg/h",
                    [
                        Line("one device, one hour", _tau, _found, "second", marks=True),
                        Line("closed form", _tau, _closed, "first"),
                    ],
                    log=True,
                )
            ],
            x_label="averaging time, s",
            description="Allan deviation",
            log_x=True,
            tall_in=2.6,
        )
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: move the turn-on bias. Why does this curve not care, while the angle does?": mo.md(
                "It compares neighbouring means, and a constant is in both. An Allan plot says nothing of turn-on bias: "
                "read that from the sheet, or measure it by switching the device on many times."
            ),
            "Question: a sheet boasts of a bias instability of 5 deg/h. Is that how well the bias is known?": mo.md(
                "No. It is the floor of this curve over 0.664: the best that averaging can do. Its turn-on bias is "
                "another line of the sheet, often a hundred times as large."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    # Claims: at fixed settings, whatever the sliders say; bounds from theory and the number of devices.
    def _claims():
        count, seconds = 60, 300.0
        noise_only = grade_of(0.3, 0.0, 0.0)
        final = angles(devices(noise_only, seconds, count))[-1]
        # The rms of n normal values errs by 1/sqrt(2 n); three and a half times that.
        found = [
            about(
                "noise alone: rms angle after 5 min is N√t",
                np.sqrt(np.mean(final**2)),
                0.3 * np.sqrt(seconds / HOUR),
                3.5 / np.sqrt(2.0 * count),
                "°",
            )
        ]
        bias_only = grade_of(0.0, 10.0, 0.0)
        path = angles(devices(bias_only, seconds, 8))
        found.append(
            about(
                "bias alone: twice the time, twice the angle",
                path[-1, 0] / path[len(path) // 2 - 1, 0],
                2.0,
                1e-3,
            )
        )
        tau, deviation, _ = allan_degph(noise_only, HOUR)
        at_one = float(np.interp(1.0, tau, deviation))
        # An hour has 3600 pairs of means over 1 s, whose variance errs by about 2.3 %.
        found.append(about("Allan deviation at 1 s is N", at_one, 0.3 * np.sqrt(HOUR), 0.08, "deg/h"))
        both = grade_of(0.3, 60.0, 0.0)
        rates = devices(both, seconds + 30.0, count)
        raw = np.sqrt(np.mean(angles(rates[300:])[-1] ** 2))
        rested = np.sqrt(np.mean(after_rest(rates, 30.0)[-1] ** 2))
        found.append(
            about(
                "30 s of rest leave what the noise of that rest makes",
                rested,
                float(expected_deg(both, seconds, calibrated_s=30.0)),
                3.5 / np.sqrt(2.0 * count),
                "°",
            )
        )
        found.append(Claim("and take away most of the error: ratio", rested / raw, 0.0, 0.2))
        return found

    claims = _claims()
    return (claims,)


@app.cell(hide_code=True)
def _(claims):
    mo.md(conclusion(claims, script=mo.app_meta().mode == "script"))
    return


if __name__ == "__main__":
    app.run()
