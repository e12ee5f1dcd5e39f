import runpy

from setuptools import setup

build = runpy.run_path("csrc/build.py")
# cffi and scripts have no pyproject key
setup(
    scripts=["deploy/hapticd"],
    cffi_modules=[
        *(f"csrc/build.py:{floor}" for floor in build["FLOORS"]),
        "csrc/build.py:control",
        "csrc/build.py:devices",
        "csrc/build.py:link",
        "csrc/build.py:plant",
        "csrc/build.py:runtime",
        "csrc/build.py:safety",
    ],
)
