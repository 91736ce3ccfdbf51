"""What a run has shown: headline, verdicts, possible reasons of failure, and tables."""
