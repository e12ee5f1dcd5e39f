"""The giant between the process image and the gate (HapticGiant)."""
