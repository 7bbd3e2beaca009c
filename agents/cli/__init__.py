"""The command line `relpos`: options, output, and one module per command."""
