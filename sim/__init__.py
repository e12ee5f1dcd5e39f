"""The simulated plant: dynamics, devices that speak the same wire, and the operator's hand."""
