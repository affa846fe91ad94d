"""A cached ride of which a byte is another is damaged, or is the same: never another in silence."""

from __future__ import annotations

import json
import zlib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from simrail.core import sealed_files
from simrail.core.sealed_files import (
    HEADER,
    DamagedError,
    plain_of,
    read_sealed_file,
    seal,
    write_sealed_file,
)
from simrail.core.toml_files import load
from simrail.ride import cache as ride_cache
from simrail.ride.ride import Ride, simulate
from simrail.ride.truth import Truth
from simrail.ride.truth_files import load_truth, save_truth
from simrail.track.file import TrackFile
from simrail.track.irregularity import Irregularity
from simrail.vehicle.file import VehicleFile
from simrail.vehicle.speed_profile import SpeedProfile


@pytest.fixture
def ride(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Ride:
    monkeypatch.setenv("SIMRAIL_RIDES", str(tmp_path))
    return Ride(
        name="short",
        track=load(TrackFile, "track", "smooth_curve").design("smooth_curve"),
        irregularity=Irregularity("erri_b176_low", (3.0, 100.0), 20.0),
        track_seed=4,
        vehicle=load(VehicleFile, "vehicle", "metro_irw_bogie").model("metro_irw_bogie"),
        profile=SpeedProfile(30.0, 40.0, 10.0, rest_s=0.2, final_rest_s=0.2),
        engine="kinematic",
        rate_hz=50.0,
    )


def content(value: Any) -> Any:
    """All that a truth says, to be compared."""
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, zlib.crc32(np.ascontiguousarray(value).tobytes())
    if isinstance(value, dict):
        return {key: content(item) for key, item in value.items()}
    if is_dataclass(value):
        return {field.name: content(getattr(value, field.name)) for field in fields(value) if field.compare}
    return repr(value)


def flipped(folder: Path, whole: Truth, *, sample: int, whole_header: bool = False) -> int:
    """Flip a bit of some bytes of each file in turn; how many were told to be damaged."""
    random, expected, told = np.random.default_rng(3), content(whole), 0
    for file in sorted(folder.iterdir()):
        good = file.read_bytes()
        every = whole_header and file.name == HEADER
        places = range(len(good)) if every else random.integers(0, len(good), sample)
        for at in places:
            bad = bytearray(good)
            bad[at] ^= 1 << int(random.integers(8))
            file.write_bytes(bytes(bad))
            try:
                assert content(load_truth(folder)) == expected, (file.name, at)
            except DamagedError as error:
                assert "\n" not in str(error)
                told += 1
        file.write_bytes(good)
    assert content(load_truth(folder)) == expected
    return told


def test_a_flipped_bit_is_never_another_ride(ride: Ride) -> None:
    truth = simulate(ride)
    (folder,) = ride_cache.folder().iterdir()
    assert flipped(folder, truth, sample=6) >= 6 * len(list(folder.iterdir())) - 2  # spaces of the header


@pytest.mark.slow
def test_every_byte_of_a_header_in_turn_and_many_of_the_arrays(ride: Ride) -> None:
    truth = simulate(ride)
    (folder,) = ride_cache.folder().iterdir()
    count = (folder / HEADER).stat().st_size + 100 * (len(list(folder.iterdir())) - 1)
    assert flipped(folder, truth, sample=100, whole_header=True) > 0.9 * count


SHAPES: dict[str, Any] = {
    "list": [],
    "number": 3,
    "nothing": None,
    "empty": {},
    "no digest": {"crc32": {}, "plain": {}},
    "list of checksums": {"digest": "", "crc32": [], "plain": {}},
    "list inside": {"digest": "", "crc32": {}, "plain": []},
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_header_of_another_shape_is_damaged(shape: str, ride: Ride) -> None:
    simulate(ride)
    (folder,) = ride_cache.folder().iterdir()
    (folder / HEADER).write_text(json.dumps(SHAPES[shape]))
    told: list[str] = []
    simulate(ride, told=told.append)
    assert len(told) == 1 and "damaged" in told[0] and "simulated again" in told[0]
    assert simulate(ride, told=told.append) and len(told) == 1
    (folder / HEADER).write_text("[" * 100_000)
    assert [one.name for one in ride_cache.rides()] == ["damaged"]


@pytest.mark.parametrize("key", ["wheels", "bodies", "gravity_mps2", "track", "manifest", "contact_every"])
def test_a_sealed_header_that_says_something_else_is_damaged(key: str, ride: Ride, tmp_path: Path) -> None:
    """Written with its digest by what is no truth."""
    save_truth(simulate(ride), tmp_path / "own")
    plain = plain_of(tmp_path / "own")
    for other in ([], {"a": []}, "text", None):
        seal(tmp_path / "own", plain | {key: other})
        if key == "manifest" and isinstance(other, dict):
            continue
        with pytest.raises(DamagedError):
            load_truth(tmp_path / "own")
    seal(tmp_path / "own", {name: value for name, value in plain.items() if name != key})
    with pytest.raises(DamagedError):
        load_truth(tmp_path / "own")


def test_gravity_in_the_header_is_sealed(ride: Ride) -> None:
    """One bit makes 9.91 of 9.81; it was taken for what was written."""
    simulate(ride)
    (folder,) = ride_cache.folder().iterdir()
    text = (folder / HEADER).read_text()
    assert '"gravity_mps2": 9.81' in text
    (folder / HEADER).write_text(text.replace('"gravity_mps2": 9.81', '"gravity_mps2": 9.91'))
    told: list[str] = []
    assert simulate(ride, told=told.append).gravity_mps2 == 9.81
    assert len(told) == 1


def test_a_sealed_file_is_what_was_written(tmp_path: Path) -> None:
    file = tmp_path / "file"
    write_sealed_file(file, b"content")
    assert read_sealed_file(file) == b"content"
    whole = file.read_bytes()
    for at in range(len(whole)):
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :])
        with pytest.raises(DamagedError):
            read_sealed_file(file)
    for short in (b"", whole[:-1], whole[:20]):
        file.write_bytes(short)
        with pytest.raises(DamagedError):
            read_sealed_file(file)
    with pytest.raises(PermissionError), sealed_files.damage_told():
        raise PermissionError(13, "not allowed", "file")
