"""Calibration of force-torque sensors: which poses, how they are led to, and what is written."""
