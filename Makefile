# `make help` lists what there is. Nothing is needed but git, make and Python; tools/environment gets the rest from PyPI.
.NOTPARALLEL:
.PHONY: help demo test test-core test-addon test-addon-4.5 test-blender test-gui bench package clean

python := .venv/bin/python

help:
	@echo 'make demo      trace an example and compare techniques on it: pictures, table and plots (about 5 minutes the first time)'
	@echo 'make test      all tests; parts: test-core test-addon test-addon-4.5 test-blender test-gui'
	@echo 'make bench     speed against mathutils and Embree'
	@echo 'make package   the extension as a zip, and as release zips with wheels for each platform, in dist/'
	@echo 'make clean     remove what these made, except for the environments .venv and .venv-4.5'

# Both scripts return at once when there is nothing to do.
.PHONY: environment environment-4.5
environment:
	@tools/environment .venv 3.13 3.11
environment-4.5:
	@tools/environment .venv-4.5 3.11 || echo 'THE TESTS IN BPY 4.5 LTS WILL BE LEFT OUT'

demo: environment
	$(python) tools/demo.py

test: environment environment-4.5
	$(python) tools/test.py

test-addon-4.5: environment-4.5
test-core test-addon test-addon-4.5 test-blender test-gui: environment
	$(python) tools/test.py $(@:test-%=%)

bench: environment
	$(python) -m rayscope bench

package: environment
	$(python) tools/package.py

clean:
	rm -rf build dist out .pytest_cache .hypothesis *.egg-info
	find . -name __pycache__ -not -path './.venv*' -not -path './.tools/*' -prune -exec rm -rf {} +
