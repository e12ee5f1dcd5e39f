"""Hierarchical least squares with inequalities over a C active-set core."""
