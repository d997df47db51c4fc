"""Pictures of snapshots, histories and several runs, and measures over time as files and pictures."""
