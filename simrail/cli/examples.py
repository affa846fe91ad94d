"""Lines to copy that stand below the help of each command."""

EXAMPLES: dict[str, tuple[str, ...]] = {
    "run": ("simrail run quick_kinematic", "simrail run go20a --set ride.speed_kmh=70 --out my_results"),
    "check": ("simrail check go20a", "simrail check my_ride.toml"),
    "grade": ("simrail grade consumer --for 'roll<0.5deg'", "simrail grade all --for 'alignment D1<0.5mm'"),
    "export": ("simrail export quick_kinematic --out recordings",),
    "estimate": (
        "simrail estimate my_ride.toml",
        "simrail estimate my_ride.toml --estimator TrackRelativeSmoother --estimator AttitudeEkf",
        "simrail estimate my_ride.toml --units deg,mm",
    ),
    "tune": (
        "simrail tune my_ride.toml",
        "simrail tune scale_track --estimator TrajectorySmoother --method cml",
    ),
    "sensitivity": ("simrail sensitivity sensitivity",),
    "spectra": ("simrail spectra shaking",),
    "vehicle": ("simrail vehicle metro_irw_bogie", "simrail vehicle my_vehicle.toml --out page"),
    "imu": ("simrail imu lord_3dm_gx4_25", "simrail imu my_imu.toml --out page"),
    "figure": ("simrail figure results/go20a", "simrail figure results/go20a answer --out answer.pdf"),
    "film": ("simrail film go20a --from 380 --to 600", "simrail film go20a --gif ride.gif"),
    "lesson": ("simrail lesson", "simrail lesson drift"),
    "new": ("simrail new scenario my_scenario", "simrail new imu my_imu", "simrail new ride my_ride"),
    "schema": ("simrail schema scenario", "simrail schema vehicle --out vehicle.schema.json"),
    "cache": ("simrail cache", "simrail cache --clear"),
    "list": ("simrail list", "simrail list vehicles", "simrail list estimators --bibtex"),
    "open": ("simrail open", "simrail open results/go20a"),
}
"""By the name of the command."""


def below(command: str) -> str:
    """What stands below its help."""
    # A blank line between them: the help is set as text, and lines would run together.
    return "\n\n".join(("Examples:", *EXAMPLES[command]))
