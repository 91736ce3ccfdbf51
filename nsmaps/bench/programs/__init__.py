"""The programs that are compared: nsmaps itself, and what others would take for the same returns."""
