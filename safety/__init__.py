"""The layers that may only reduce energy: gate, monitor, stop latch, arming."""
