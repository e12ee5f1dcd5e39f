"""Built-in machines: TOML configurations, URDF models and the EDS files of their devices."""
