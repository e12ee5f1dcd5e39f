from setuptools import setup

# cffi has no pyproject key
setup(
    cffi_modules=[
        "csrc/build.py:bench",
        "csrc/build.py:control",
        "csrc/build.py:devices",
        "csrc/build.py:hqp",
        "csrc/build.py:plant",
        "csrc/build.py:runtime",
        "csrc/build.py:safety",
    ]
)
