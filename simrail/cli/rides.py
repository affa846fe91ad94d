"""``simrail export | estimate``: recordings as files."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from simrail.cli.options import DONE, Form, Scenario, Seed, Settings, number
from simrail.core.errors import InputError, one_of

if TYPE_CHECKING:
    from simrail.recording.files.ned import Frame
    from simrail.recording.files.ride_writer import Format, RideFormat


def export(
    scenario: Scenario,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="A new folder for the recordings.")],
    form: Annotated[
        str, typer.Option("--format", metavar="csv|parquet|mcap", help="Form of the data files.")
    ] = "csv",
    draw: Annotated[int, typer.Option("--draw", min=0, max=999_999, help="Draw of the sensors.")] = 0,
    truth: Annotated[
        bool, typer.Option("--truth", help="Write the true motion beside each recording, too.")
    ] = False,
    contact: Annotated[
        bool,
        typer.Option("--contact", help="Write the forces between wheels and rails, a file per wheel, too."),
    ] = False,
    frame: Annotated[
        str,
        typer.Option(
            "--frame", metavar="flu|ned", help="Axes: forward, left, up, or FRD of the body and NED."
        ),
    ] = "flu",
    seed: Seed = None,
    settings: Settings = None,
) -> int:
    """Write the recordings of a scenario as files: one folder each, one file per sensor."""
    from rich.console import Console

    from simrail.campaign.export import export as export_scenario
    from simrail.campaign.progress import ProgressWatcher
    from simrail.scenario.scenario import load_scenario

    one_of(frame, ("flu", "ned"), "no such axes", field="--frame")
    one_of(form, ("csv", "parquet", "mcap"), "no such format", field="--format")
    axes, chosen = cast("Frame", frame), cast("RideFormat", form)
    read = load_scenario(scenario, overrides=settings or [], seed=seed)
    with ProgressWatcher(Console(stderr=True)) as watcher:
        names = export_scenario(
            read, out, format=chosen, draw=draw, truth=truth, contact=contact, axes=axes, watcher=watcher
        )
    print(f"wrote {number(len(names), 'recording')} into {out}:")
    for name in names:
        print(f"  {name}")
    print(f"next: simrail estimate {out / names[0]}")
    return DONE


def estimate(
    rides: Annotated[
        list[Path],
        typer.Argument(metavar="RIDE.toml", help="A ride file, or a folder that holds a ride.toml."),
    ],
    estimator: Annotated[
        str, typer.Option("--estimator", metavar="NAME", help="A registered estimator, or FILE.py:CLASS.")
    ] = "TrackRelativeSmoother",
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Its folder; results/<ride>_<estimator> if not given."),
    ] = None,
    form: Form = "csv",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="OPTION=VALUE", help="Option of the estimator. Repeatable."),
    ] = None,
    fused: Annotated[
        bool, typer.Option("--fuse", help="Fuse the rails of several rides over the same line.")
    ] = False,
) -> int:
    """Run an estimator on a recorded ride, of a real train or exported; without truth, without scores."""
    ride = rides[0]
    stem = ride.stem if ride.suffix == ".toml" and ride.stem != "ride" else ride.absolute().stem
    stem = ride.absolute().parent.name if stem == "ride" else stem
    folder = out or Path("results") / f"{stem}_{estimator.rpartition(':')[2]}{'_fused' * fused}"
    if fused:
        return _fuse(rides, estimator, folder, settings or [], _format(form))
    if len(rides) > 1:
        raise InputError(
            "are several rides, of which one is estimated at a time",
            field="RIDE.toml",
            value=len(rides),
            limit="1",
            remedy="give one, or add --fuse to fuse their rails",
        )
    from simrail.cli.estimate_ride import estimate_ride
    from simrail.recording.check_field import field_warnings
    from simrail.recording.check_sheet import noise_warnings
    from simrail.report.pages.estimate_page import design_difference_deg, ride_facts

    recording, estimated = estimate_ride(
        ride, estimator, folder, settings=settings or [], format=_format(form)
    )
    for warning in (*noise_warnings(recording), *field_warnings(recording)):
        print(f"warning: {warning}", file=sys.stderr)
    for fact in ride_facts(recording):
        print(fact)
    for angle in ("roll_rad", "pitch_rad"):
        if angle in estimated.states and recording.odometry is not None and recording.track.is_map:
            rms = design_difference_deg(recording, estimated, angle)
            print(f"{angle.removesuffix('_rad')} less design: {rms:.3f} deg rms")
    print("there is no truth beside a recording, hence no scores")
    frames = [name for name in ("innovations", "geometry") if getattr(estimated, name) is not None]
    files = [folder / f"{name}.{form}" for name in ("estimate", *frames)]
    print(f"wrote {', '.join(str(file) for file in files)} and {folder / 'estimate.html'}")
    return DONE


def _fuse(rides: list[Path], estimator: str, folder: Path, settings: list[str], form: "Format") -> int:
    """Fuse the rails of rides, and tell what each was worth."""
    from simrail.cli.fuse_rides import fuse_rides

    fused = fuse_rides(rides, estimator, folder, settings=settings, format=form)
    place = fused.geometry.index
    print(f"{'one pass' if len(rides) == 1 else f'{len(rides)} passes'} over {place[0]:g} to {place[-1]:g} m")
    for ride, row in zip(rides, fused.passes.to_dict("records"), strict=True):
        print(f"  {ride}: moved by {row['shift_m']:+.2f} m{': ' if row['told'] else ''}{row['told']}")
    sd = 1e3 * fused.geometry.filter(like="_sd_m").mean()
    for name, value in sd.dropna().items():
        print(f"{str(name).removesuffix('_sd_m').replace('_', ' ')}: sd {value:.2f} mm, unfiltered")
    print(f"wrote {folder / f'geometry.{form}'} and {folder / 'passes.csv'}")
    return DONE


def _format(word: str) -> "Format":
    """The form that a word stands for."""
    one_of(word, ("csv", "parquet"), "no such format", field="--format")
    return cast("Format", word)
