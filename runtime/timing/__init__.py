"""The fixed-rate loop, and what keeps it from being punctual."""
