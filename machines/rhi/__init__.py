"""A redundant haptic interface, wired into the runtime."""
