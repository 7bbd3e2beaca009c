"""The command line `relpos`: options, output, and one module for each command."""
