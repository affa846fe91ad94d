"""Lesson 6: what rails look like from a bogie. Served by ``simrail lesson rails``."""

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="medium", app_title="simrail: rails from a bogie")

with app.setup:
    from functools import lru_cache

    import marimo as mo
    import numpy as np
    from simrail.estimators.baselines import ZeroTrack
    from simrail.estimators.trajectory.smoother import TrajectorySmoother

    from simrail import Mount, measure, score_geometry, with_odometry
    from simrail.lessons.claims import Claim, conclusion
    from simrail.lessons.figures import Line, Panel, draw
    from simrail.lessons.rides import HEIGHT_M, short_ride
    from simrail.lessons.scores import markdown, pick
    from simrail.recording.sheets.imu_file import load_imu
    from simrail.scoring.geometry import rail_error_of
    from simrail.sensors.encoder import EncoderSpec
    from simrail.track.bands import BANDS

    PLACES = {"axle": "front", "bogie frame": "frame"}
    QUANTITIES = {
        "vertical profile": "vertical_profile",
        "alignment": "alignment",
        "cross-level": "cross_level",
    }
    GRADES = ["consumer", "industrial", "lord_3dm_gx4_25", "tactical", "navigation", "ideal"]
    SHOWN = {"all": None, **{name: BANDS[name] for name in ("D0", "D1", "D2")}}
    WAVES = ", ".join(
        f"{one.name} {one.shortest_m:g} to {one.longest_m:g} m" for one in SHOWN.values() if one
    )


@app.cell(hide_code=True)
def _():
    mo.md(r"""
    # 6 · What rails look like from a bogie

    Rails are not straight: they deviate by millimetres, over wavelengths from a metre to a hundred. A bogie that runs over
    them moves with them, and an IMU on it feels it: twice integrated, acceleration is the shape of the rail. *Twice
    integrated* is the whole trouble: a bias of 1 mg is 5 mm after one second and 18 m after a minute.

    The ride here is one of the multibody engine: a light-metro bogie at 60 km/h over one curve (it ships with simrail).
    Choose where the IMU sits, what is asked of the rails, and in which wavelengths.
    """)
    return


@app.cell(hide_code=True)
def _():
    place = mo.ui.radio(list(PLACES), value="axle", label="IMU on the", inline=True)
    quantity = mo.ui.dropdown(list(QUANTITIES), value="vertical profile", label="quantity")
    band = mo.ui.dropdown(list(SHOWN), value="D1", label=f"wavelengths ({WAVES})")
    grade = mo.ui.dropdown(GRADES, value="lord_3dm_gx4_25", label="IMU")
    smoothed = mo.ui.switch(value=True, label="smoothed (looks back from the end of the ride)")
    device = mo.ui.slider(0, 9, 1, value=0, label="device number", show_value=True)
    mo.vstack(
        [
            device,
            mo.hstack([place, quantity], justify="start", gap=3, wrap=True),
            band,
            mo.hstack([grade, smoothed], justify="start", gap=3, wrap=True),
        ]
    )
    return band, grade, place, quantity, smoothed, device


@app.function
@lru_cache(maxsize=32)
def seen(body: str, grade_name: str, smoothed: bool = True, draw_number: int = 0):
    """What a device on a body makes of the rails: its estimate, and the recording that it is made of."""
    line = short_ride()
    recording = measure(
        line.truth,
        name="rails",
        mount=Mount("imu", body, (0.0, 0.0, HEIGHT_M)),
        grade=load_imu(grade_name)[1],
        encoder=EncoderSpec("rear.left", radius_error_sd=0.001),
        seed=1,
        draw=draw_number,
    )
    recording = with_odometry(recording, "curve_smoothed")
    return TrajectorySmoother(smoothed=smoothed).estimate(recording), recording


@app.function
def curves(estimate, quantity: str, band):
    """Places, true and estimated shape of the rails in a band, mm, where the band counts."""
    line = short_ride()
    error = rail_error_of(estimate, line.rails, quantity, band)
    nothing = estimate.geometry.copy()
    nothing[:] = 0.0
    true = -rail_error_of(replace_geometry(estimate, nothing), line.rails, quantity, band)
    return error.index.to_numpy(), true.to_numpy(), (true + error).to_numpy()


@app.function
def replace_geometry(estimate, geometry):
    """The estimate with another geometry."""
    from dataclasses import replace

    return replace(estimate, geometry=geometry, geometry_draws=None)


@app.cell(hide_code=True)
def _(band, grade, place, quantity, smoothed, device):
    _estimate, _ = seen(PLACES[place.value], grade.value, smoothed.value, device.value)
    _s, _true, _found = curves(_estimate, QUANTITIES[quantity.value], SHOWN[band.value])
    mo.vstack(
        [
            mo.Html(
                draw(
                    [
                        Panel(
                            f"{quantity.value}, mm",
                            [
                                Line("true", _s, _true, "true", width=3.0),
                                Line("estimated", _s, _found, "second", width=1.2),
                            ],
                        ),
                        Panel("error, mm", [Line("", _s, _found - _true, "ink")]),
                    ],
                    x_label="place along the line, m",
                    description="Shape of the rails, true and estimated",
                    tall_in=2.1,
                )
            ),
            mo.md(
                f"Error **{np.sqrt(np.mean((_found - _true) ** 2)):.2f} mm** rms; the shape itself has "
                f"{np.sqrt(np.mean(_true**2)):.2f} mm. Who says that the rails lie as drawn is wrong by the latter."
            ),
        ]
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: choose all wavelengths. Why is the error so much larger than in D1?": mo.md(
                "Long waves are slow: over 100 m at 60 km/h an error of acceleration is integrated for six seconds, twice. The "
                "error of a double integral grows with the square of the wavelength at least. Bands are not a trick: they say "
                "what can be known."
            ),
            "Question: turn smoothing off. What changes, and what is the price?": mo.md(
                "A filter knows only what has been: it corrects itself late, and its long waves come too late. A smoother knows "
                "both sides. The price is time: nothing is known before the end of the ride. For maintenance that does not "
                "matter, for a warning on the train it does."
            ),
            "Question: move the IMU from the axle to the bogie frame and look at D0, then at D2. What happened?": mo.md(
                "The primary suspension is a low-pass filter: short waves do not reach the frame, and what does not move cannot "
                "be felt. And the cross-level seen from the frame is that of the frame, which rolls in its springs."
            ),
        }
    )
    return


@app.function
def rms_mm(estimate, recording, quantity: str, band: str) -> float:
    """Rms error of a quantity in a band; NaN where it cannot be had."""
    figures = score_geometry(estimate, short_ride().rails, recording, windows=["whole"], metrics=["rms"])
    return pick(figures, quantity, "rms", band=band)


@app.cell(hide_code=True)
def _(grade):
    _rows = {}
    for _name, _body in PLACES.items():
        for _words, _smoothed in (("smoother", True), ("filter", False)):
            _estimate, _recording = seen(_body, grade.value, _smoothed)
            _figures = score_geometry(
                _estimate, short_ride().rails, _recording, windows=["whole"], metrics=["rms"]
            )
            _rows[f"{_name}, {_words}"] = [
                *(pick(_figures, "vertical_profile", "rms", band=_b) for _b in ("D0", "D1", "D2")),
                pick(_figures, "cross_level", "rms", band="D1"),
                pick(_figures, "gauge", "rms"),
            ]
    _figures = score_geometry(
        ZeroTrack().estimate(_recording), short_ride().rails, _recording, windows=["whole"], metrics=["rms"]
    )
    _rows["rails as drawn, no IMU"] = [
        *(pick(_figures, "vertical_profile", "rms", band=_b) for _b in ("D0", "D1", "D2")),
        pick(_figures, "cross_level", "rms", band="D1"),
        pick(_figures, "gauge", "rms"),
    ]
    mo.md(
        "## All at once\n\nRms error of device 0, mm:\n\n"
        + markdown(_rows, ["vertical D0", "vertical D1", "vertical D2", "cross-level D1", "gauge"], digits=2)
    )
    return


@app.cell(hide_code=True)
def _():
    mo.accordion(
        {
            "Question: the column of the gauge is empty. Is that a fault of the program?": mo.md(
                "It is the most honest column. One rigid body has one lateral motion: it follows the middle between the rails, "
                "and whether they lie 1 mm farther apart it cannot feel. **Not observable** is an answer; a number there would "
                "be the designer's wish. A camera that sees both rails makes it observable."
            ),
        }
    )
    return


@app.cell(hide_code=True)
def _():
    def _claims():
        axle, recording = seen("front", "lord_3dm_gx4_25")
        slow, _ = seen("front", "lord_3dm_gx4_25", False)
        frame, beside = seen("frame", "lord_3dm_gx4_25")
        drawn = ZeroTrack().estimate(recording)

        def ratio(quantity: str, band: str, one, other) -> float:
            return rms_mm(one[0], one[1], quantity, band) / rms_mm(other[0], other[1], quantity, band)

        on_axle, filtered = (axle, recording), (slow, recording)
        on_frame, nothing = (frame, beside), (drawn, recording)
        return [
            # Thresholds say what is claimed ("most", "half", "none"): nobody has a formula for them.
            Claim(
                "from the axle most of D1 is seen: error over shape",
                ratio("vertical_profile", "D1", on_axle, nothing),
                0.0,
                0.3,
            ),
            Claim(
                "a smoother halves a filter's error in D2: ratio",
                ratio("vertical_profile", "D2", on_axle, filtered),
                0.0,
                0.5,
            ),
            Claim(
                "from the frame nothing of D0 is seen: error over shape",
                ratio("vertical_profile", "D0", on_frame, nothing),
                0.8,
                1.6,
            ),
            Claim(
                "cross-level D1 is seen from the axle, frame over axle",
                ratio("cross_level", "D1", on_frame, on_axle),
                3.0,
                30.0,
            ),
            Claim(
                "the gauge is not observable: share of places without a value",
                float(axle.geometry["gauge_m"].isna().mean()),
                1.0,
                1.0,
            ),
        ]

    claims = _claims()
    return (claims,)


@app.cell(hide_code=True)
def _(claims):
    mo.md(conclusion(claims, script=mo.app_meta().mode == "script"))
    return


if __name__ == "__main__":
    app.run()
