import runpy

from setuptools import setup

build = runpy.run_path("csrc/build.py")
# none of these has a pyproject key
setup(
    scripts=["deploy/hapticd"],
    cmdclass={"build_ext": build["BuildBeside"]},
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
