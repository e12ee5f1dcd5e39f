"""Devices on the bus: wire format, object dictionary, CiA 402, process image, proxies, adapters."""
