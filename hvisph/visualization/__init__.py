"""Pictures of snapshots, histories, measures over time and several runs."""
