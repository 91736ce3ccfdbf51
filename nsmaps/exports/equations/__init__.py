"""The equations of exact systems as LaTeX documents."""
