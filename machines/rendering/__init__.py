"""What machines share that render a twin with a serial arm: tick, ratings, checks, log, sections."""
