"""The score table's labels."""

import pytest

from simrail.scoring.table import LABEL_COLUMNS, labelled, table_of

ROW = ("roll", "full", "truth", "whole", "rms", 1.0, "deg", 9, "ok")


@pytest.mark.parametrize("wrong", ["one less", "one more"])
def test_labels_are_all_of_them_and_no_other(wrong: str) -> None:
    labels: dict[str, object] = dict.fromkeys(LABEL_COLUMNS, "a")
    if wrong == "one less":
        del labels[LABEL_COLUMNS[-1]]
    else:
        labels["colour"] = "red"
    with pytest.raises(ValueError, match="labels must be exactly"):
        labelled([(table_of([ROW]), labels)])
