"""Psychophysics: what people can tell apart of what a machine renders."""
