"""Live exploration of a system in a browser: pictures whose axes and parameters are changed by hand and computed anew."""
