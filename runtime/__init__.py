"""Clock, loop, cycle, modes, recorder, replay, configuration and the command line."""
