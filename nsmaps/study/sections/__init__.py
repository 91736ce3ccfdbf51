"""The sections of a study."""
