"""The command line: the only package that knows both the harness and the reports."""
