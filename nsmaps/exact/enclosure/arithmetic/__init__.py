"""Ball arithmetic with outward rounding, elementary functions, and formulas in it."""
