"""From a TOML file and a model to a machine that is ready to run."""
