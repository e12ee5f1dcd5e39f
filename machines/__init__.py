"""One folder a machine: its configuration, checks, limits, controller, simulation and model."""
