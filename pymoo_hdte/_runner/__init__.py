"""Many independent jobs on workers, kept on disk; results as tables and figures, and their page."""
