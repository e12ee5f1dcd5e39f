from setuptools import setup

# cffi has no pyproject key
setup(cffi_modules=["csrc/build_devices.py:ffi", "csrc/build_hqp.py:ffi"])
