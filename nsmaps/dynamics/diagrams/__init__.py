"""Diagrams over parameters: bifurcations, impact speeds."""
