"""A session as it runs: daemon, plant and recorder processes, and the person at the terminal."""
