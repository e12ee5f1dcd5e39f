"""Figures and tables of the papers, run in simulation: our number beside theirs."""
