"""A large campaign made up: scores as a campaign of many axes has them, without running any."""

from __future__ import annotations

from itertools import product

import numpy as np
import pandas as pd

from simrail.score_table import INTEGER_COLUMNS, SCORE_COLUMNS, as_score_table

SPEEDS = (20.0, 40.0, 70.0)
SCALES = (0.5, 1.0, 2.0)
GRADES = ("ideal", "tactical", "industrial", "consumer")
METHODS = ("ekf_compensated", "ekf_uncompensated", "vqf", "design_angles")
CURVES = ("curve:curve 3 R300", "curve:curve 7 R-150", "curve:curve 11 R800")
RADIUS = {CURVES[0]: 300.0, CURVES[1]: 150.0, CURVES[2]: 800.0}
FIGURES = [
    *(("roll", "rms", window) for window in ("whole", "straight", "transition", "curve", *CURVES)),
    *(("pitch", "rms", window) for window in ("whole", "curve")),
    ("yaw_debiased", "rms", "whole"),
    ("roll", "max", "whole"),
    ("roll", "nees", "whole"),
    ("roll", "coverage95", "whole"),
    ("roll", "us_per_sample", "whole"),
]


def campaign(
    *, tracks: int = 10, sensors: int = 20, seed: int = 1, methods: tuple[str, ...] = METHODS
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Scores and cells: 3 speeds x 2 directions x 3 irregularities x 4 grades x draws.

    The roll error of a method that is not compensated grows with v^2/R, that of a grade with its
    noise, all errors with the irregularity; tracks and sensors add a spread of their own.
    """
    rng = np.random.default_rng(seed)
    worlds = list(product(SCALES, SPEEDS, (False, True)))
    cells = pd.DataFrame(
        [
            (w * len(GRADES) + g, scale, speed, back, t, grade, s)
            for w, (scale, speed, back) in enumerate(worlds)
            for t in range(tracks)
            for g, grade in enumerate(GRADES)
            for s in range(sensors)
        ],
        columns=[
            "case",
            "irregularity.scale",
            "ride.speed_kmh",
            "ride.reverse",
            "track_draw",
            "imu",
            "sensor_draw",
        ],
    )
    cells.insert(0, "cell", np.arange(len(cells)))
    cells["imu.grade"] = cells["imu"]
    cells["sample"] = 0
    cells["speed_kmh"] = cells["ride.speed_kmh"]
    cells["direction"] = np.where(cells["ride.reverse"], "backward", "forward")
    fixed = {"ride": "out", "vehicle": "none", "mount": "axle", "odometry": "encoder"}
    for name, value in (fixed | {"track": "test_line", "engine": "kinematic"}).items():
        cells[name] = value
    n, rows = len(cells), len(methods) * len(FIGURES)
    noise = cells["imu"].map(dict(zip(GRADES, (0.0, 0.02, 0.06, 0.2), strict=True))).to_numpy()
    track = rng.normal(size=(len(SCALES) * 6 * tracks)).repeat(len(GRADES) * sensors)
    rough = 0.05 * cells["irregularity.scale"].to_numpy() * np.exp(0.15 * track)
    push = (cells["ride.speed_kmh"].to_numpy() / 3.6) ** 2 / 9.81
    values = np.empty((n, len(methods), len(FIGURES)))
    for m, method in enumerate(methods):
        for f, (quantity, metric, window) in enumerate(FIGURES):
            draw = np.exp(0.1 * rng.normal(size=n))
            error = np.hypot(rough * (3.0 if method == "design_angles" else 1.0), noise * draw)
            if method in ("ekf_uncompensated", "vqf") and "straight" not in window:
                gain = 0.3 if method == "vqf" else 1.0
                error = np.hypot(error, gain * np.rad2deg(push / RADIUS.get(window, 400.0)) * 0.5)
            special = {"nees": 0.9 * draw, "coverage95": 1.0 - 0.05 * draw, "us_per_sample": 0.5 * draw}
            scale = {"max": 3.5}.get(metric, 1.0) * {"pitch": 0.6}.get(quantity, 1.0)
            values[:, m, f] = special.get(metric, scale * error)
    repeated = {
        name: pd.Categorical(cells[name].repeat(rows))
        if name not in INTEGER_COLUMNS
        else cells[name].repeat(rows).to_numpy()
        for name in ("cell", "ride", "vehicle", "mount", "imu", "odometry", "track_draw", "sensor_draw")
    }
    units = {"nees": "1", "coverage95": "1", "us_per_sample": "us"}
    columns = repeated | {
        "scenario": "test",
        "tuning": "default",
        "estimator": np.tile(np.repeat(methods, len(FIGURES)), n),
        "quantity": np.tile([quantity for quantity, _, _ in FIGURES], n * len(methods)),
        "metric": np.tile([metric for _, metric, _ in FIGURES], n * len(methods)),
        "window": np.tile([window for _, _, window in FIGURES], n * len(methods)),
        "unit": np.tile([units.get(metric, "deg") for _, metric, _ in FIGURES], n * len(methods)),
        "band": "full",
        "reference": "truth",
        "value": values.ravel(),
        "n_samples": 1000,
        "status": "ok",
    }
    return as_score_table(pd.DataFrame(columns)[list(SCORE_COLUMNS)]), cells
