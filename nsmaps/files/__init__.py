"""Files: replaced as a whole when written, and read as untrusted text."""
