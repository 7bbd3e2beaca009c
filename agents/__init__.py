"""Controllers, reports and the command line: what people run."""
