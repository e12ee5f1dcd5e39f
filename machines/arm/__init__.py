"""Any serial arm that a person holds by a handle on a force-torque sensor."""
