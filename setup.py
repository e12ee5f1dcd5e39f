from setuptools import setup

# cffi and scripts have no pyproject key
setup(
    scripts=["deploy/hapticd"],
    cffi_modules=[
        "csrc/build.py:bench",
        "csrc/build.py:control",
        "csrc/build.py:devices",
        "csrc/build.py:link",
        "csrc/build.py:plant",
        "csrc/build.py:runtime",
        "csrc/build.py:safety",
    ],
)
