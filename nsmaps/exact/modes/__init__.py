"""Piecewise-linear systems with modes: from formulas to tables, and compiled code that follows the flow from event to event."""
