"""A run as one page: `report.html`, which needs nothing but a browser; how to cite it; the versions behind it."""
