"""What the files of a run's folder are called."""

SNAPSHOTS = "snapshots"
VTU = "vtu"
CHECKPOINT = "checkpoint"
CASE = "case.yaml"
SERIES = "series.pvd"
HISTORY = "history.csv"
SUMMARY = "summary.json"
LOG = "run.log"
LOCK = ".hvisph"  # marks the folder as a run's, and is locked while one writes it

FOLDERS = (SNAPSHOTS, VTU, CHECKPOINT)
FILES = (CASE, SERIES, HISTORY, SUMMARY, LOG)
