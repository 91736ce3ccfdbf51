"""From a file to a study: parsing, places in the file, overrides, references between sections."""
