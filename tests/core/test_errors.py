"""Several faults of one input: each a line, and of very many the first."""

import pytest

from simrail.core.errors import MOST_TOLD, Faults, InputError


@pytest.mark.parametrize("count", [1, MOST_TOLD, MOST_TOLD + 1, MOST_TOLD + 9])
def test_faults_are_told_a_line_each_and_of_many_the_first(count: int) -> None:
    faults = Faults()
    for i in range(count):
        with faults.gathered():
            raise InputError("is wrong", field=f"key{i}")
    with pytest.raises(InputError) as caught:
        faults.refuse()
    lines = str(caught.value).splitlines()
    told = count if count <= MOST_TOLD + 1 else MOST_TOLD
    assert lines[:told] == [f"key{i}: is wrong" for i in range(told)]
    assert lines[told:] == ([] if told == count else [f"and {count - told} more faults"])


def test_what_is_gathered_within_is_all_told_outside() -> None:
    """Three faults of a part, and one beside it: no block keeps the first of another's alone."""

    def part() -> None:
        inner = Faults()
        for i in range(3):
            with inner.gathered():
                raise InputError("is wrong", field=f"part.key{i}")
        inner.refuse()

    faults = Faults()
    with faults.gathered():
        part()
    with faults.gathered():
        raise InputError("is wrong", field="other")
    with pytest.raises(InputError) as caught:
        faults.refuse()
    assert [fault.field for fault in caught.value.each] == ["part.key0", "part.key1", "part.key2", "other"]
    Faults().refuse()
