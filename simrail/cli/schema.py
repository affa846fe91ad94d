"""``simrail schema``: what an editor needs to complete and judge the files while they are written."""

from pathlib import Path
from typing import Annotated

import typer

from simrail.cli.options import DONE
from simrail.core.errors import one_of

KINDS = ("scenario", "track", "vehicle", "imu", "ride", "spectrum")


def schema(
    kind: Annotated[str, typer.Argument(metavar="KIND", help=f"One of {', '.join(KINDS)}.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write it there; printed if not given.")
    ] = None,
) -> int:
    """Print the JSON schema of a kind of file, for editors.

    Shipped files name theirs in their first line, which editors with a TOML language server read.
    """
    one_of(kind, KINDS, "there is no such kind of file", field="KIND")
    from simrail.core.atomic_files import write_whole
    from simrail.scenario.file_keys import schema_text

    text = schema_text(kind)
    if out is None:
        print(text, end="")
    else:
        print(f"wrote {write_whole(out, text.encode(), what='schema')}")
    return DONE
