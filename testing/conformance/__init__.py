"""What every machine must do, whatever it is made of; the simulated plant judges it.

``pytest --hapticd-machine NAME`` collects these modules; their tests are parametrised over the machines that
were named and over the devices that each of them has.
"""
