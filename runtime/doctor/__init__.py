"""Is this host fit to run a machine: one check per setting, each with the command that mends it."""
