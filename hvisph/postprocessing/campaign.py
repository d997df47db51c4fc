"""Running what a comparison still lacks, one case after the other."""

from __future__ import annotations

from hvisph.core.errors import CaseError, OutputError
from hvisph.output import file_names
from hvisph.simulation.finalize import Outcome
from hvisph.simulation.listener import Listener
from hvisph.simulation.resume import resume
from hvisph.simulation.run import run

from .comparison import Entry, is_run


def complete(
    entry: Entry, *, threads: int | None = None, force: bool = False, listener: Listener | None = None
) -> Outcome | None:
    """Run the case of an entry, or go on with it where it was interrupted; None where it has been run.

    Parameters
    ----------
    entry
        An entry of `hvisph.postprocessing.comparison.entries`.
    threads, listener
        As of `hvisph.simulation.run.run`.
    force
        Run again what has been run.

    Raises
    ------
    CaseError
        When the case cannot be run.
    OutputError
        When a file cannot be written, or another process is running the case.
    """
    if entry.case is None or (is_run(entry) and not force):
        return None
    begun = (entry.folder / file_names.CASE).is_file()
    if begun and not force:
        # its case has the same hash, or the entry would have another folder
        try:
            return resume(entry.folder, threads=threads, listener=listener)
        except (CaseError, OutputError):
            begun = True  # what is there cannot be gone on with: begin again, or fail for the same reason
    return run(entry.case, entry.folder, force=begun, threads=threads, listener=listener)
