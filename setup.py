from setuptools import setup

# cffi has no pyproject key
setup(cffi_modules=[])
