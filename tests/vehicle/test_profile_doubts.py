"""Profiles that are read, and what of them is doubtful."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrail.core.errors import InputError
from simrail.vehicle.contact.profile_files import rail_profile, wheel_profile
from simrail.vehicle.contact.profiles import rail_60e1, s1002


def written(folder: Path, y_m: np.ndarray, z_m: np.ndarray) -> Path:
    path = folder / "profile.txt"
    np.savetxt(path, 1e3 * np.column_stack([y_m, z_m]), fmt="%.4f")
    return path


def doubts(notes: tuple[str, ...]) -> list[str]:
    return [note for note in notes if note.startswith("doubtful")]


def wheel(folder: Path, *, shift_m: float = 0.0, spike_m: float = 0.0, hole: bool = False) -> list[str]:
    sound = s1002()
    y = np.linspace(sound.lateral_m[0], sound.lateral_m[-1], 250)
    z = np.interp(y, sound.lateral_m, sound.depth_m)
    z[150] += spike_m
    kept = ~(hole & (np.abs(y - 0.005) < 0.008))
    return doubts(wheel_profile(written(folder, y[kept] + shift_m, z[kept])).notes)


def test_nothing_of_a_sound_wheel_or_rail_is_doubtful(tmp_path: Path) -> None:
    assert wheel(tmp_path) == []
    head = rail_60e1()
    assert doubts(rail_profile(written(tmp_path, head.lateral_m, head.depth_m)).notes) == []


def test_a_point_that_stands_out_a_hole_and_another_zero_are_doubtful(tmp_path: Path) -> None:
    (spike,) = wheel(tmp_path, spike_m=0.0005)
    assert "line 151 stands 0.5" in spike
    (hole,) = wheel(tmp_path, hole=True)
    assert "no points between" in hole
    (zero,) = wheel(tmp_path, shift_m=0.01)
    assert "flange's tip is 4" in zero and "tape_circle_mm" in zero


def test_a_head_whose_zero_is_its_side_is_doubtful_and_one_upside_down_refused(tmp_path: Path) -> None:
    head = rail_60e1()
    (beside,) = doubts(rail_profile(written(tmp_path, head.lateral_m + 0.036, head.depth_m)).notes)
    assert "middle of the head is at 36.0 mm" in beside
    with pytest.raises(InputError, match=r"upside down.*turn the sign of the second column"):
        rail_profile(written(tmp_path, head.lateral_m, -head.depth_m))
