"""Sections that vary parameters: diagrams, branches, stability and exponents."""
