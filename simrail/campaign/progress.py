"""Who is told how a campaign, an export or a tuning goes; what it shows, see `simrail.cli.progress_bar`."""

from __future__ import annotations


class Watcher:
    """Is told how a campaign goes; this one keeps silent. Subclass it to show progress."""

    def ride_begins(self, number: int, count: int, name: str) -> None:
        """Ride `number` (from 1) of `count` is simulated, or found in the cache, from now on."""

    def ride_goes(self, done_s: float, total_s: float, speed_mps: float) -> None:
        """The ride has been simulated so far."""

    def ride_ends(self) -> None:
        """The ride is there; its cells are run from now on."""

    def cells_begin(self, done: int, count: int) -> None:
        """Cells are run from now on; `done` of `count` were done before."""

    def cells_done(self, done: int, count: int, failed: int, worker: str) -> None:
        """So many cells of `count` are done, `failed` of them failed; the last by this worker."""

    def told(self, line: str) -> None:
        """Something is worth a line to the user."""

    def recording_written(self, number: int, count: int, name: str) -> None:
        """Recording `number` (from 1) of `count` has been written, by an export."""

    def search_goes(self, name: str, evaluations: int, value: float) -> None:
        """A tuning has evaluated its objective so often for a set of parameters; its least value so far."""
