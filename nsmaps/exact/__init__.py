"""What the physics does: systems, their flights and impacts, first returns, families and surfaces."""
