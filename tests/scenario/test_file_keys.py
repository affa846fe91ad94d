"""The schemas that editors read judge as the models do, and are those that are shipped."""

import copy
import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from simrail.core.toml_files import FOLDERS, Part, shipped, shipped_folder
from simrail.scenario.file_keys import FILES, keys_of, schema_of, schema_text
from simrail.scenario.key_words import models_in, words_of


def faults(kind: str, data: dict[str, Any]) -> list[str]:
    return [error.message for error in Draft202012Validator(schema_of(kind)).iter_errors(data)]


@pytest.mark.parametrize("kind", FOLDERS)
def test_every_shipped_file_is_good_by_its_schema_and_names_it(kind: str) -> None:
    for path in shipped(kind).values():
        text = path.read_text()
        assert faults(kind, tomllib.loads(text)) == [], path.name
        named = text.partition("\n")[0].removeprefix("#:schema ")
        assert (path.parent / named).resolve() == shipped_folder() / f"schemas/{kind}.schema.json"


@pytest.mark.parametrize("kind", FILES)
def test_the_shipped_schema_is_that_of_the_models(kind: str) -> None:
    """After a change of the models: simrail schema KIND --out scenarios/schemas/KIND.schema.json."""
    assert (shipped_folder() / f"schemas/{kind}.schema.json").read_text() == schema_text(kind)


def test_faulty_files_are_refused() -> None:
    good = tomllib.loads(Path(shipped("scenario")["quick_kinematic"]).read_text())
    assert faults("scenario", good) == []
    for change in (
        lambda data: data.update(sed=1),
        lambda data: data["ride"][0].update(speed_kmh="50"),
        lambda data: data["ride"][0].update(speed_kmh={"uniformly": [20.0, 50.0]}),
        lambda data: data["imu"][0].pop("body"),
        lambda data: data.update(engine=["compiled", "steam"]),
    ):
        bad = copy.deepcopy(good)
        change(bad)
        assert faults("scenario", bad), change


def test_lists_and_distributions_are_accepted() -> None:
    data = tomllib.loads(Path(shipped("scenario")["quick_kinematic"]).read_text())
    for value in ([20.0, 50.0], {"uniform": [20.0, 50.0]}, {"normal": [50.0, 5.0], "bounds": [35.0, 65.0]}):
        data["ride"][0]["speed_kmh"] = value
        assert faults("scenario", data) == []


class Inner(Part):
    """Another.

    Attributes
    ----------
    wide, tall : float
        How far it
        reaches.
    """

    wide: float
    tall: float


class Described(Part):
    """A table."""

    length_m: float = 1.0
    """How long it is,
    in all."""
    other: Inner | None = None


def test_words_stand_below_a_field_or_among_the_attributes() -> None:
    assert words_of(Described) == {"length_m": "How long it is, in all."}
    assert words_of(Inner) == {"wide": "How far it reaches.", "tall": "How far it reaches."}
    assert set(models_in(Described)) == {"Described", "Inner"}


def test_keys_tell_form_limits_and_default() -> None:
    keys = {(key.table, key.name): key for key in keys_of("scenario")}
    speed = keys["[[ride]]", "speed_kmh"]
    assert "a list of such; or a distribution" in speed.form
    assert keys["", "step_s"].default == "0.0005"
    assert "<= 0.001" in keys["", "step_s"].form
    assert keys["[[irregularity.defect]]", "form"].form.startswith('one of "ramp"')


@pytest.mark.parametrize("kind", FILES)
def test_every_key_is_described(kind: str) -> None:
    assert [(key.table, key.name) for key in keys_of(kind) if not key.meaning] == []
