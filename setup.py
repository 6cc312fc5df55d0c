"""The one thing pyproject.toml cannot say: the root folder is `rayscope`, and each folder below core/ and addon/ is a subpackage of it."""
from setuptools import find_namespace_packages, setup

below = find_namespace_packages(".", include=["core", "core.*", "addon", "addon.*"])
setup(package_dir={"rayscope": "."}, packages=["rayscope", *(f"rayscope.{name}" for name in below)])
