"""For tests of machines, ours and theirs: a bench in lockstep, copies, a terminal, and a conformance suite.

``pytest --hapticd-machine NAME`` runs the suite; the plugin is ``hapticd.testing.plugin``.
"""
