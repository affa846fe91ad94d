"""Every public noun shows itself in six lines at most, and can be drawn."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import simrail
from simrail import InputError
from simrail.core.shown import MOST_FACTS, WIDEST, Shown, names
from simrail.estimation.choose_odometry import with_odometry
from simrail.ride.ride import simulate
from simrail.scenario.build import Parts
from simrail.scenario.cells import cells
from simrail.sensors.measure import measure


class Long(Shown):
    """Says too much."""

    def _facts(self):
        return "n" * 300, {f"fact {i}": "<b>word</b>\n" * 50 for i in range(20)}


def test_what_is_shown_is_short_and_safe() -> None:
    lines = repr(Long()).split("\n")
    assert len(lines) == 1 + MOST_FACTS
    assert max(len(line) for line in lines) < WIDEST + 20
    assert "<b>word" not in Long()._repr_html_()


def test_names_are_counted_beyond_some() -> None:
    assert names("abc") == "a, b, c"
    assert names(range(9), most=2) == "0, 1 and 7 more"
    assert names([]) == "none"


@pytest.fixture(scope="module")
def nouns(own_cache: None) -> dict[str, object]:
    scenario = simrail.load_scenario(
        "quick_kinematic", overrides=["ride.end_m=60.0", "ride.rest_s=4.0", "imu.grade=ideal"]
    )
    cell = Parts(scenario).resolve(next(iter(cells(scenario))))
    truth = simulate(cell.ride)
    recording = with_odometry(
        measure(truth, name="r", mount=cell.mount, grade=cell.grade, encoder=cell.encoder, seed=1, draw=0),
        "encoder",
    )
    estimate = simrail.estimators.AttitudeEkf().estimate(recording)
    return {
        "scenario": scenario,
        "track": cell.ride.track,
        "laid": simrail.lay(cell.ride.track, cell.ride.irregularity, seed=1),
        "vehicle": cell.ride.vehicle,
        "ride": cell.ride,
        "truth": truth,
        "recording": recording,
        "estimate": estimate,
    }


def test_every_noun_says_what_it_is_in_six_lines(nouns: dict[str, object]) -> None:
    for name, noun in nouns.items():
        text = repr(noun)
        assert text.count("\n") <= MOST_FACTS, name
        assert len(text) < 700, name
        assert type(noun).__name__ in noun._repr_html_()
    assert "60 m" in repr(nouns["ride"])
    assert "250 Hz" in repr(nouns["recording"])


def test_every_noun_can_be_drawn(nouns: dict[str, object], tmp_path: Path) -> None:
    for name in set(nouns) - {"scenario"}:
        figure = simrail.show(nouns[name])
        assert isinstance(figure, Figure)
        figure.savefig(tmp_path / f"{name}.png", dpi=30)


def test_the_truth_is_drawn_where_it_is(nouns: dict[str, object]) -> None:
    recording, truth = nouns["recording"], nouns["truth"]
    moved = truth.motion(simrail.Mount("axle", "front", (0.0, 0.0, 0.6)))
    moved = moved.reindex(recording.imu.index, method="nearest")
    figure = simrail.show(nouns["estimate"], recording=recording, truth=moved)
    lines = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    assert np.allclose(np.degrees(moved["roll_rad"].to_numpy())[-1], lines["truth"][-1], atol=1e-2)
    assert len(figure.axes) == 3


def test_what_cannot_be_drawn_is_told() -> None:
    with pytest.raises(InputError, match="found 'int'; limit: one of TrackDesign"):
        simrail.show(3)
