"""What is wrong with a stored file is told as damage; what is wrong with the machine is not."""

from __future__ import annotations

import pytest

from simrail.core.sealed_files import DamagedError, damage_told


@pytest.mark.parametrize(
    "fault",
    [ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError, EOFError],
)
def test_another_form_is_damage(fault: type[Exception]) -> None:
    with pytest.raises(DamagedError, match="another form"), damage_told():
        raise fault("of a reader")


@pytest.mark.parametrize("fault", [FileNotFoundError, IsADirectoryError, NotADirectoryError])
def test_what_is_missing_is_named(fault: type[OSError]) -> None:
    with pytest.raises(DamagedError, match=r"^body_3\.npy is missing$"), damage_told():
        raise fault(2, "words", "/cache/ride/body_3.npy")


@pytest.mark.parametrize("fault", [PermissionError, MemoryError, OSError, KeyboardInterrupt])
def test_faults_of_the_machine_say_nothing_of_the_file(fault: type[BaseException]) -> None:
    with pytest.raises(fault) as caught, damage_told():
        raise fault("a full disk")
    assert not isinstance(caught.value, DamagedError)


def test_damage_that_is_told_keeps_its_words() -> None:
    with pytest.raises(DamagedError, match=r"^truth is not what was written$"), damage_told():
        raise DamagedError("truth is not what was written")
