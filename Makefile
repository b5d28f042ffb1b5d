# Each target is written out in tools/run, which also works where make is missing.
targets = help demo test lint venv

.PHONY: $(targets)
$(targets):
	@sh tools/run $@
