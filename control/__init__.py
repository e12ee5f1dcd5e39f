"""Pure mathematics of the controllers: synchronous, no I/O, no clock, no logging."""
