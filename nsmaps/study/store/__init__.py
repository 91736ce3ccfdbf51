"""Runs on disk: results as plain data, run folders, checkpoints."""
