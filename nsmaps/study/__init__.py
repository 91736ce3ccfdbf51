"""A file in, results out: studies in YAML, their runs, their verdicts, and the folders that keep them."""
