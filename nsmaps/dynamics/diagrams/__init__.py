"""Diagrams over parameters: bifurcations, stability over two parameters, impact speeds."""
